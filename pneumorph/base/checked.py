"""Numbers that say beside their name which values they take.

A settings dataclass that begins with `Checked` refuses a value that its annotation does not allow:
one of another kind, numbers that are not finite or beyond their bounds, integers that the engine
cannot hold, and names that are none of a `Literal`::

    @dataclass(frozen=True)
    class Settings(Checked):
        duration_s: Positive = 20.0
        crossover_probability: Share = 0.5
        population: Annotated[int, Bounds(least=2)] = 96
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from numbers import Integral, Real
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np


@dataclass(frozen=True)
class Bounds:
    """Which numbers are allowed, both ends included unless said otherwise."""

    least: float = -math.inf
    most: float = math.inf
    above: float = -math.inf
    """The number is larger than this."""
    below: float = math.inf
    """And smaller than this."""
    why: str = ""
    """What a message adds: the reason, or the likely cause."""

    def __str__(self) -> str:
        if self == Bounds(above=0.0, why=self.why):
            return "positive"
        ends = {"above": self.above, "at least": self.least, "below": self.below,
                "at most": self.most}  # fmt: skip
        return " and ".join(f"{words} {end:g}" for words, end in ends.items() if math.isfinite(end))

    def __contains__(self, number: float) -> bool:
        return self.least <= number <= self.most and self.above < number < self.below


LARGEST_INTEGER = 2**31 - 1
"""What the engine counts with."""

Positive = Annotated[float, Bounds(above=0.0)]
NotNegative = Annotated[float, Bounds(least=0.0)]
Share = Annotated[float, Bounds(0.0, 1.0)]
Count = Annotated[int, Bounds(least=1)]
CountOrNone = Annotated[int, Bounds(least=0)]


class Checked:
    """Base of settings whose values are checked when they are made.

    Raises:
        ValueError: A value is not allowed; names the field, what was expected and what was got.
    """

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, hint in hints_of(kind).items():
            _check(name, getattr(self, name), hint)


@cache
def hints_of(kind: Any) -> dict[str, Any]:
    """Return the annotations of a class by the names of its fields, marks with them; read once."""
    return get_type_hints(kind, include_extras=True)


def _check(name: str, value: Any, hint: Any) -> None:
    """Check one value against its annotation: bounds of numbers, choices, entries of tuples."""
    kind, inner = get_origin(hint), get_args(hint)
    if kind is Annotated:
        _check(name, value, inner[0])
        for bounds in inner[1:]:
            if isinstance(bounds, Bounds) and value not in bounds:
                why = bounds.why and f"; {bounds.why}"
                raise ValueError(f"{name} must be {bounds}, got {value}{why}")
    elif kind is Literal:
        if value not in inner:
            raise ValueError(f"{name} must be one of {', '.join(map(str, inner))}, got {value!r}")
    elif kind is tuple and isinstance(value, Sequence):  # on a command line it may be missing yet
        hints = inner[:1] * len(value) if inner[1:] == (...,) else inner
        if len(value) != len(hints):
            raise ValueError(f"{name} must have {len(hints)} entries, got {value!r}")
        for number, (entry, each) in enumerate(zip(value, hints, strict=True)):
            _check(f"{name}[{number}]", entry, each)
    elif len(inner) == 2 and NoneType in inner:  # may be left out
        if value is not None:
            _check(name, value, inner[0] if inner[1] is NoneType else inner[1])
    elif hint in _KINDS:
        allowed, words = _KINDS[hint]
        if not isinstance(value, allowed) or (hint is not bool and isinstance(value, bool)):
            raise ValueError(f"{name} must be {words}, got {value!r}")
        if hint is float and not math.isfinite(value):
            raise ValueError(f"{name} must be finite, got {value}")
        if hint is int and abs(value) > LARGEST_INTEGER:
            raise ValueError(f"{name} must be at most {LARGEST_INTEGER} in size, got {value}")


_KINDS: dict[Any, tuple[Any, str]] = {
    bool: ((bool, np.bool_), "true or false"),
    int: (Integral, "a whole number"),
    float: (Real, "a number"),
    str: (str, "a text"),
}
"""What a value of each annotation must be, and how a message says so."""


def rises(values: np.ndarray) -> bool:
    """Whether numbers are finite and each is larger than the one before; NaN is neither."""
    return bool(np.isfinite(values).all() and (np.diff(values) > 0.0).all())


def check_range(
    values: np.ndarray, least: float, most: float, name: str, likely_cause: str
) -> None:
    """Refuse an array in which a number is not finite or out of range.

    Args:
        values: Any shape.
        least: Smallest that is allowed.
        most: Largest that is allowed.
        name: What the message calls the array.
        likely_cause: What the message says of how it may have come about.

    Raises:
        ValueError: There is one; names the one that is furthest out.
    """
    values = np.asarray(values, dtype=float)
    # NaN compares false, so this catches it as well.
    outside = ~((values >= least) & (values <= most))
    if not outside.any():
        return
    beyond = np.where(np.isfinite(values), np.maximum(values - most, least - values), np.inf)
    place = np.unravel_index(np.argmax(np.where(outside, beyond, -np.inf)), values.shape)
    raise ValueError(
        f"{name}[{', '.join(str(int(i)) for i in place)}] is {values[place]}, expected a finite "
        f"number from {least:g} to {most:g} ({outside.sum()} of {values.size} are outside; likely "
        f"cause: {likely_cause})"
    )
