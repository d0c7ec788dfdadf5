"""Values that JSON and TOML can hold, from the values that Python programs have at hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np


def plain(value: Any, place: str) -> Any:
    """A value as files hold it: NumPy's numbers and arrays are Python's, paths texts.

    Args:
        value: A number, a text, a path, None, or tables, dataclasses and lists of them.
        place: What messages call it, such as ``sites[0]``.

    Raises:
        ValueError: There is something else in it, or a list with None in it; names its place.
    """
    if isinstance(value, np.generic):
        value = float(value) if isinstance(value, np.floating) else value.item()
    elif isinstance(value, np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, Path):
        return str(value)
    if is_dataclass(value) and not isinstance(value, type):
        value = {each.name: getattr(value, each.name) for each in fields(value)}
    if isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str):
                raise ValueError(f"{place} has the name {name!r:.60}, expected a text")
        return {str(name): plain(each, f"{place}.{name}") for name, each in value.items()}
    if isinstance(value, list | tuple) and not any(each is None for each in value):
        return [plain(each, f"{place}[{number}]") for number, each in enumerate(value)]
    raise ValueError(
        f"{place} is {value!r:.60}, expected a number, a text, true or false, or a table or list "
        "of them"
    )
