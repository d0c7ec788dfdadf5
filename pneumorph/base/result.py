"""Typed results of studies: frozen dataclasses that are saved as JSON and read back equal.

A result is what a study returns, what a verb's ``summary.json`` holds, and what a section of a page
takes. JSON has no NaN: a number that is not finite is written as null and read as NaN.

A class may add numbers that follow from its fields (``derived``, a method that returns them by
name). They are written for those who read the file and passed over when it is read back.

What a robot achieves is told in the unit of its goal: a field with `in_cm` of a result with a
``goal``, and of all results in it, is called so where that is the unit and by its own name
otherwise; ``unit`` stands beside the goal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import cattrs
import cattrs.v
import numpy as np
from cattrs.gen import make_dict_structure_fn

from pneumorph.base.artefact import UNITS, ArtefactError, read_json, write_json
from pneumorph.base.settings import exactly

Result = TypeVar("Result")
_NAME_IN_CM = "name in cm"


def in_cm(name: str) -> dict[str, str]:
    """Metadata of a field in the unit of a goal: what a file calls it where the unit is cm, such as
    ``median_cm``."""
    return {_NAME_IN_CM: name}


def result_to_dict(result: Any, unit: str = "cm") -> dict[str, Any]:
    """Return a result as JSON values: arrays and tuples become lists, paths text, NaN null.

    Args:
        result: The result.
        unit: Unit of what a result without a goal of its own achieved.
    """
    content = _named(result, _converter().unstructure(result), unit)
    derived = result.derived() if hasattr(result, "derived") else {}
    plain: dict[str, Any] = finite({**content, **derived})
    return plain


def result_from_dict(kind: type[Result], content: Mapping[str, Any]) -> Result:
    """Return a result of a class from JSON values; keys that the class has not are passed over.

    Raises:
        ArtefactError: A field is missing or of the wrong type.
    """
    try:
        return _converter().structure(content, kind)
    except cattrs.BaseValidationError as error:
        reasons = "; ".join(cattrs.transform_error(error, format_exception=_reason))
        raise ArtefactError(f"it is no {kind.__name__}: {reasons}") from error


def _reason(error: BaseException, kind: type | None) -> str:
    """What is wrong with a value: what its class says of it, or of which type it should be."""
    own = type(error) is ValueError and not str(error).startswith("expected ")
    return str(error) if own else cattrs.v.format_exception(error, kind)


def save_result(path: Path | str, result: Any) -> Path:
    """Write a result as JSON with its kind and units."""
    header = {"kind": type(result).__name__, "units": UNITS}
    return write_json(path, {**header, **result_to_dict(result)})


def load_result(kind: type[Result], path: Path | str) -> Result:
    """Read what `save_result` wrote.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It is not JSON, of another kind, or damaged.
    """
    content = read_json(path, kind.__name__)
    if content.get("kind") != kind.__name__:
        raise ArtefactError(f"{path} holds a {content.get('kind')}, expected a {kind.__name__}")
    try:
        return result_from_dict(kind, content)
    except ArtefactError as error:
        raise ArtefactError(f"{path} cannot be read: {error}") from error


def _named(result: Any, content: Any, unit: str) -> Any:
    """JSON values of a result with the names that its fields have in their unit."""
    if isinstance(result, Mapping):
        return {key: _named(value, content[key], unit) for key, value in result.items()}
    if isinstance(result, list | tuple):
        return [_named(*both, unit) for both in zip(result, content, strict=True)]
    if not is_dataclass(result):
        return content
    told: dict[str, Any] = {}
    unit = getattr(getattr(result, "goal", None), "unit", unit)
    known = {each.name: each for each in fields(result)}
    for key, value in content.items():
        if key not in known:  # a class may be written by a rule of its own
            told[key] = value
            continue
        name = known[key].metadata.get(_NAME_IN_CM, key) if unit == "cm" else key
        told[name] = _named(getattr(result, key), value, unit)
    if "goal" in told:
        told["unit"] = unit
    return told


def _by_field(kind: type[Any], converter: cattrs.Converter) -> Callable[[Any, Any], Any]:
    """Reads results of a class, whichever names its fields have."""
    read = make_dict_structure_fn(kind, converter)
    names = {
        each.metadata[_NAME_IN_CM]: each.name
        for each in fields(kind)
        if _NAME_IN_CM in each.metadata
    }

    def renamed(content: Any, kind: Any) -> Any:
        if isinstance(content, Mapping):
            content = {names.get(name, name): value for name, value in content.items()}
        return read(content, kind)

    return renamed


def _is_in_a_unit(kind: Any) -> bool:
    return is_dataclass(kind) and any(_NAME_IN_CM in each.metadata for each in fields(kind))


@cache  # it keeps what it has made of each class, which takes longer than to use it
def _converter() -> cattrs.Converter:
    converter = cattrs.Converter()
    converter.register_unstructure_hook(Path, str)
    converter.register_unstructure_hook(np.ndarray, lambda value: value.tolist())
    converter.register_structure_hook(Path, lambda value, _: Path(value))
    converter.register_structure_hook(np.ndarray, lambda value, _: np.array(_known(value)))
    # cattrs would turn 2.7 into the integer 2 and any number into a text.
    for kind, allowed in ((bool, (bool,)), (int, (int,)), (str, (str,))):
        converter.register_structure_hook(
            kind, lambda value, _, allowed=allowed: exactly(value, allowed)
        )
    converter.register_structure_hook(
        float, lambda value, _: math.nan if value is None else float(exactly(value, (int, float)))
    )
    converter.register_structure_hook(Any, lambda value, _: value)
    converter.register_structure_hook_factory(
        _is_in_a_unit, lambda kind: _by_field(kind, converter)
    )
    return converter


def _known(value: Any) -> Any:
    """A list of numbers with NaN where there is null."""
    if isinstance(value, list):
        return [_known(item) for item in value]
    return math.nan if value is None else value


def finite(value: Any) -> Any:
    """JSON values with null for every number that is not finite: JSON has no NaN."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
