"""Results of studies without making a study."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from pneumorph.physics.air import Air
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics

_CHECKED = {
    Physics: Physics(
        friction_by_surface=(("hub", 0.3), ("sheet", 0.5)),
        friction_pressure=FrictionPressure(-0.3),
        air=Air("orifice", filling_mm3_per_s_kPa=(70.0, 80.0, 90.0)),
    )
}
"""Settings within a result, whose numbers have bounds."""


def example(hint: Any) -> Any:
    """A value of a type: no default is taken, so that every field is seen to be read back."""
    kind, inner = get_origin(hint), get_args(hint)
    if kind in (Union, types.UnionType):
        return example(next(each for each in inner if each is not types.NoneType))
    if kind is tuple:
        return tuple(example(each) for each in inner if each is not ...)
    if kind is list:
        return [example(inner[0])]
    if kind in (dict, Mapping):
        return {"name": example(inner[1])}
    if kind is Literal:
        return inner[-1]
    if hint in _CHECKED:
        return _CHECKED[hint]
    if dataclasses.is_dataclass(hint):
        hints = get_type_hints(hint)
        values = {field.name: example(hints[field.name]) for field in dataclasses.fields(hint)}
        return hint(**values)  # type: ignore[operator]
    if hint is np.ndarray:
        return np.array([[1.5, np.nan]])
    return {str: "text", int: 3, float: 0.1, bool: True, Any: {"a": [1, None]}}[hint]
