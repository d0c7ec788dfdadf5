"""Whether values read from a file have the shape that settings ask for: known keys, lists, names.

What a number or a text must be is said where settings are made (`pneumorph.base.checked`); here a
value is refused that is of another kind altogether, in the words of whoever writes the file.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pneumorph.base.checked import hints_of


def refuse_other_shapes(hint: Any, value: Any, place: str = "") -> None:
    """Refuse a value that is no table, list or name where one is expected, and unknown keys.

    Args:
        hint: What is expected: a settings class, or the annotation of one of its fields.
        value: What was read.
        place: Where it stands, such as ``channels[0]``.

    Raises:
        ValueError: It is of another shape; names its place, and a key's closest neighbour.
    """
    kind, inner = get_origin(hint), get_args(hint)
    if kind is Annotated:
        refuse_other_shapes(inner[0], value, place)
    elif kind in (Union, UnionType):
        others = [each for each in inner if each is not NoneType]
        if len(others) == 1 and not (value is None and NoneType in inner):
            refuse_other_shapes(others[0], value, place)
    elif isinstance(hint, type) and is_dataclass(hint):
        _refuse_other_table(hint, value, place)
    elif kind is Literal:
        # A list may stand in the file, and has no place in a set.
        if not isinstance(value, str | int | bool) or value not in inner:
            raise ValueError(
                f"{place}: expected one of {', '.join(map(str, inner))}, got {value!r:.60}"
            )
    elif kind is tuple:
        _refuse_other_list(inner, value, place)
    elif isinstance(kind, type) and issubclass(kind, Mapping):
        for name, each in table(value, place).items():
            refuse_other_shapes(inner[1], each, f"{place}.{name}")


def table(value: Any, place: str) -> Mapping[str, Any]:
    """A value that must be a table.

    Args:
        value: What was read.
        place: Where it stands.

    Raises:
        ValueError: It is none.
    """
    if not isinstance(value, Mapping):
        raise ValueError(f"{place}: expected a table, got {value!r:.60}")
    return value


def _refuse_other_table(kind: Any, value: Any, place: str) -> None:
    known = [field.name for field in fields(kind)]
    if not isinstance(value, Mapping):
        raise ValueError(
            f"{place or kind.__name__}: expected a table of {', '.join(known)}, got {value!r:.60}"
        )
    before, hints = f"{place}." if place else "", hints_of(kind)
    for key in value:
        if key not in known:
            meant = _meant(key, value[key], known)
            raise ValueError(f"unknown setting {before}{key}: {meant}")
    for field in fields(kind):
        if field.name in value:
            refuse_other_shapes(hints[field.name], value[field.name], f"{before}{field.name}")
        elif field.default is MISSING and field.default_factory is MISSING:
            raise ValueError(f"{before}{field.name} is missing, expected a value")


def _meant(key: Any, value: Any, known: Sequence[str]) -> str:
    """What whoever wrote an unknown key may have meant."""
    group, *rest = str(key).split(".")
    if rest and group in known:
        nested: Any = value
        for name in reversed((group, *rest)):
            nested = {name: nested}
        return f"names of groups nest, expected {nested}"
    close = difflib.get_close_matches(str(key), known, n=1)
    return f"did you mean {close[0]}?" if close else f"expected {', '.join(known)}"


def _refuse_other_list(inner: tuple[Any, ...], value: Any, place: str) -> None:
    if not isinstance(value, Sequence):
        raise ValueError(f"{place}: expected a list, got {value!r:.60}")
    of_any_length = inner[1:] == (...,)
    if isinstance(value, str) or (not of_any_length and len(value) != len(inner)):
        wanted = "a list" if of_any_length else f"a list of {len(inner)} entries"
        raise ValueError(f"{place} is {value!r:.60}, expected {wanted}")
    hints = inner[:1] * len(value) if of_any_length else inner
    for number, (each, hint) in enumerate(zip(value, hints, strict=True)):
        refuse_other_shapes(hint, each, f"{place}[{number}]")
