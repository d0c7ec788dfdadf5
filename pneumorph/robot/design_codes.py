"""Numbers for designs that are too many to be listed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from pneumorph.robot.design import Design, Fitting

_HIGHEST = np.iinfo(np.int64).max


class DesignCodes:
    """A number for each choice of an option at each location, in mixed radix: the last location's
    option counts by one, each other's by the product of the option counts after it.

    The numbers rise in the order of `DesignSpace.designs`; many are of choices that break a rule.
    """

    def __init__(self, options: Sequence[Sequence[Fitting | None]]) -> None:
        """Number the choices.

        Args:
            options: What each location may carry, None for no leg.
        """
        self._options = options
        self._place = [{option: at for at, option in enumerate(each)} for each in options]

    @cached_property
    def _values(self) -> np.ndarray:
        """What an option counts for at each location, (location,) int64.

        Raises:
            ValueError: There are more choices than whole numbers of 64 bit.
        """
        values = [1]
        for each in reversed(self._options):
            values.insert(0, values[0] * len(each))
        if values[0] > _HIGHEST:
            raise ValueError(
                f"the locations' options can be combined in {values[0]:.1e} ways, expected at most "
                f"{_HIGHEST:.1e}, which 64 bit can number; allow fewer locations or options"
            )
        return np.array(values[1:])

    def options(self, design: Design) -> tuple[int, ...] | None:
        """Number of the option at each location; None where a location has another, and of a design
        of more or fewer locations."""
        if design.location_count != len(self._place):
            return None
        chosen = {each.location: each for each in design.fittings}
        found = [place.get(chosen.get(at), -1) for at, place in enumerate(self._place)]
        return None if -1 in found else tuple(found)

    def codes(self, options: np.ndarray) -> np.ndarray:
        """Numbers of choices, (n,) int64, from the options' numbers, (n, location)."""
        numbers: np.ndarray = np.asarray(options, dtype=np.int64) @ self._values
        return numbers

    def digits(self, codes: np.ndarray) -> np.ndarray:
        """Numbers of the options at each location, (n, location), of numbers of choices, (n,)."""
        counts = np.array([len(each) for each in self._options])
        found: np.ndarray = np.asarray(codes, dtype=np.int64)[:, None] // self._values % counts
        return found

    def design(self, code: int) -> Design:
        """The design of a number."""
        (digits,) = self.digits(np.array([code]))
        chosen = [options[at] for options, at in zip(self._options, digits, strict=True)]
        return Design.of(len(chosen), [each for each in chosen if each is not None])
