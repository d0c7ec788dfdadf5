"""The scripts of the experiments as modules, and their calls."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest
import tyro

REPRODUCE = Path(__file__).parent.parent.parent / "reproduce"


def script(name: str) -> ModuleType:
    """The module of an experiment's run.py."""
    path = REPRODUCE / name / "run.py"
    specification = importlib.util.spec_from_file_location(f"reproduce_{name}", path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module  # where its dataclasses look their annotations up
    specification.loader.exec_module(module)
    return module


def call(name: str, monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    """Run an experiment as its command does."""
    monkeypatch.setattr(sys, "argv", ["run.py", *map(str, arguments)])
    tyro.cli(script(name).main)
