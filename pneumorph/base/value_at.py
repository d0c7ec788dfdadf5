"""A value of a file by its place, of the type that is expected there."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pneumorph.base.artefact import ArtefactError

Kind = TypeVar("Kind")


def value_at(content: Any, place: str, kind: type[Kind], file: Path, made_by: str) -> Kind:
    """A value by its place, such as ``pairs.0.design``.

    Args:
        content: What the file holds.
        place: Names of tables and numbers of lists, separated by points.
        kind: Type of the value; an integer stands for a float.
        file: The file, which messages name.
        made_by: What it is of, which messages name.

    Raises:
        ArtefactError: There is none, or one of another type.
    """
    value = content
    for name in place.split("."):
        try:
            value = value[int(name) if isinstance(value, list) else name]
        except (KeyError, IndexError, TypeError, ValueError):
            raise ArtefactError(
                f"{file} has no {place}, expected a {_said(kind)}; it is damaged or of a run that "
                f"has none ({made_by})"
            ) from None
    if kind is float and type(value) is int:
        value = float(value)
    if not isinstance(value, kind):
        raise ArtefactError(
            f"{file} has {value!r:.60} as {place}, expected a {_said(kind)}; it is damaged"
        )
    return value


def _said(kind: type) -> str:
    """A type, for a person."""
    words = {dict: "table of values", str: "text", float: "number", int: "whole number"}
    return words.get(kind, kind.__name__)
