"""Packages that an extra installs, imported where they are needed."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType


def optional_package(module: str, need: str, extra: str, instead: str = "") -> ModuleType:
    """A module that an extra installs.

    Args:
        module: Its name, such as ``netgen.occ``.
        need: What needs which package, such as ``sorotraj files need PyYAML``.
        extra: The extra that installs it.
        instead: What can be done without, to end the message.

    Raises:
        ModuleNotFoundError: It is not installed; says how to install it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{need}, which is not installed; install the extra with pip install "
            f"'pneumorph[{extra}]'{instead}"
        ) from error
