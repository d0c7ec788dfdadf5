"""Distributions of one number, written as in a textbook: ``U(0.8, 1.4)``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

_CALL = re.compile(r"(?P<name>[A-Za-z]+)\(\s*(?P<a>[^,\s]+)\s*,\s*(?P<b>[^,\s]+)\s*\)$")
_KINDS = ("U", "N", "LogU")

MOST_REJECTIONS = 100_000
"""Draws that are tried until one agrees with a measurement."""
_FEWEST = 20.0
"""Of as many draws so many must agree with a measurement on average: nothing is found in one of
half a billion cases."""


@dataclass(frozen=True)
class Distribution:
    """A distribution, or a constant.

    ``U(a, b)`` is uniform from a to b, ``LogU(a, b)`` uniform in the logarithm, ``N(m, s)`` normal
    with mean m and standard deviation s, where draws beyond three s are set to three. A plain
    number is a constant.
    """

    kind: str
    first: float
    second: float

    @classmethod
    def parse(cls, text: str, name: str = "distribution") -> Distribution:
        """Read a distribution.

        Args:
            text: What it is.
            name: Of what, for the errors.

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
                f"{name} {text!r} cannot be read, expected a number, U(low, high), "
                "LogU(low, high) or N(mean, deviation)"
            )
        if made.kind in ("U", "LogU") and made.first > made.second:
            raise ValueError(
                f"{name} {text!r} has its bounds in the wrong order, expected "
                f"{made.kind}({made.second:g}, {made.first:g})"
            )
        if (made.kind == "LogU" and made.first <= 0.0) or (made.kind == "N" and made.second < 0.0):
            raise ValueError(f"{name} {text!r} has a bound or deviation that is not positive")
        return made

    @property
    def is_constant(self) -> bool:
        """Whether all draws are the same."""
        return self.lowest == self.highest

    @property
    def lowest(self) -> float:
        """No draw is below."""
        return self.first - 3.0 * self.second if self.kind == "N" else self.first

    @property
    def highest(self) -> float:
        """No draw is above."""
        return self.first + 3.0 * self.second if self.kind == "N" else self.second

    def check_measured(self, name: str, value: float, deviation: float) -> None:
        """Refuse a measurement that no draw could have given.

        Args:
            name: What was measured.
            value: What was found.
            deviation: Its standard deviation.

        Raises:
            ValueError: The deviation is not positive or too small to draw from, the number is no
                distribution, or the value is further than three deviations from all that it may be.
        """
        if not (math.isfinite(value) and 0.0 < deviation < math.inf):
            raise ValueError(
                f"measured {name} is {value:g} with a standard deviation of {deviation:g}, "
                "expected a finite value and a positive deviation"
            )
        if self.is_constant:
            raise ValueError(
                f"{name} is {self.lowest:g} and no distribution, expected one for what was "
                "measured to say more about"
            )
        if not self.lowest - 3.0 * deviation <= value <= self.highest + 3.0 * deviation:
            raise ValueError(
                f"measured {name} is {value:g}, expected {self.lowest:g} to {self.highest:g} give "
                f"or take three standard deviations, {3.0 * deviation:g}; the test, its unit or "
                "the distribution is wrong"
            )
        if self._agreeing(value, deviation) * MOST_REJECTIONS < _FEWEST:
            raise ValueError(
                f"measured {name} is {value:g} with a standard deviation of {deviation:g}, "
                f"expected a wider one: too little of what is drawn from {self.lowest:g} to "
                f"{self.highest:g} agrees with so narrow a result, or one so far off; give the "
                "number itself in place of a distribution"
            )

    def _agreeing(self, value: float, deviation: float) -> float:
        """Share of draws that a measurement accepts, by the trapezium rule."""
        low, high = max(self.lowest, value - 5.0 * deviation), value + 5.0 * deviation
        drawn = np.linspace(low, max(low, min(self.highest, high)), 401)
        likelihood = np.exp(-0.5 * ((drawn - value) / deviation) ** 2)
        return float(np.trapezoid(self._density(drawn) * likelihood, drawn))

    def _density(self, drawn: np.ndarray) -> np.ndarray:
        """Probability density of numbers within the range, (number,) each."""
        if self.kind == "N":
            spread = self.second * math.sqrt(2.0 * math.pi)
            found: np.ndarray = np.exp(-0.5 * ((drawn - self.first) / self.second) ** 2) / spread
            return found
        if self.kind == "LogU":
            return 1.0 / (drawn * math.log(self.second / self.first))
        return np.full(len(drawn), 1.0 / (self.second - self.first))

    def drawn_given(self, drawn: float, value: float, deviation: float) -> float:
        """A draw from the distribution times the likelihood of a measurement, by rejection; of a
        normal that ends at three deviations.

        Args:
            drawn: A draw without it, which decides this one.
            value: What was measured.
            deviation: Its standard deviation.

        Raises:
            ValueError: The measurement is so narrow, or so far off, that nothing was accepted.
        """
        rng = np.random.default_rng(int(np.float64(drawn).view(np.uint64)))
        for _ in range(MOST_REJECTIONS):
            tried = self.draw(rng)
            agrees = rng.random() < math.exp(-0.5 * ((tried - value) / deviation) ** 2)
            # Of a normal nothing is drawn at its ends: those stand for all that lies beyond.
            if agrees and (self.kind != "N" or self.lowest < tried < self.highest):
                return tried
        raise ValueError(
            f"none of {MOST_REJECTIONS} draws agrees with a measurement of {value:g} with a "
            f"standard deviation of {deviation:g}, expected a wider one"
        )

    def draw(self, rng: np.random.Generator) -> float:
        """Draw one number; a constant uses up a random number too, so that others stay the same."""
        uniform, normal = float(rng.random()), float(rng.standard_normal())
        if self.kind == "N":
            return self.first + self.second * min(max(normal, -3.0), 3.0)
        if self.kind == "LogU":
            return float(self.first * (self.second / self.first) ** uniform)
        return self.first + (self.second - self.first) * uniform
