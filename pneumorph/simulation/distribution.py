"""Distributions of one number, written as in a textbook: ``U(0.8, 1.4)``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

_CALL = re.compile(r"(?P<name>[A-Za-z]+)\(\s*(?P<a>[^,\s]+)\s*,\s*(?P<b>[^,\s]+)\s*\)$")
_KINDS = ("U", "N", "LogU")


@dataclass(frozen=True)
class Distribution:
    """A distribution, or a constant.

    ``U(a, b)`` is uniform from a to b, ``LogU(a, b)`` uniform in the logarithm, ``N(m, s)`` normal
    with mean m and standard deviation s, cut off at three s. A plain number is a constant.
    """

    kind: str
    first: float
    second: float

    @classmethod
    def parse(cls, text: str) -> Distribution:
        """Read a distribution.

        Raises:
            ValueError: Not one of the forms, or numbers in the wrong order.
        """
        match = _CALL.match(text.strip())
        try:
            if match is None:
                value = float(text)
                made = cls("constant", value, value)
            else:
                made = cls(match["name"], float(match["a"]), float(match["b"]))
        except ValueError:
            made = cls("unreadable", math.nan, math.nan)
        if made.kind not in ("constant", *_KINDS) or not math.isfinite(made.first + made.second):
            raise ValueError(
                f"distribution {text!r} cannot be read, expected a number, U(low, high), "
                "LogU(low, high) or N(mean, deviation)"
            )
        if made.kind in ("U", "LogU") and made.first > made.second:
            raise ValueError(f"distribution {text!r} has its bounds in the wrong order")
        if (made.kind == "LogU" and made.first <= 0.0) or (made.kind == "N" and made.second < 0.0):
            raise ValueError(f"distribution {text!r} has a bound or deviation that is not positive")
        return made

    @property
    def lowest(self) -> float:
        """No draw is below."""
        return self.first - 3.0 * self.second if self.kind == "N" else self.first

    @property
    def highest(self) -> float:
        """No draw is above."""
        return self.first + 3.0 * self.second if self.kind == "N" else self.second

    def draw(self, rng: np.random.Generator) -> float:
        """Draw one number; a constant uses up a random number too, so that others stay the same."""
        uniform, normal = float(rng.random()), float(rng.standard_normal())
        if self.kind == "N":
            return self.first + self.second * min(max(normal, -3.0), 3.0)
        if self.kind == "LogU":
            return float(self.first * (self.second / self.first) ** uniform)
        return self.first + (self.second - self.first) * uniform
