"""Every design that may be built, in a defined order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.robot.design import MINIMUM_LEGS, Design


@dataclass(frozen=True)
class DesignSpace(Checked):
    """Designs of a hub with ``N`` locations, ``M`` regulators and a range of legs.

    The defaults are the paper's (section III-B): 41202 assignments, of which 6972 remain once
    the regulators' names are made canonical.

    Attributes:
        location_count: Candidate locations ``N`` around the hub.
        regulator_count: Regulators ``M``.
        minimum_legs: Fewest legs of a design.
        maximum_legs: Most legs of a design.
        canonical: Keep one design of those that differ only by the names of their regulators.
    """

    location_count: Count = 8
    regulator_count: Count = 3
    minimum_legs: CountOrNone = MINIMUM_LEGS
    maximum_legs: int = 6
    canonical: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.minimum_legs <= self.maximum_legs <= self.location_count:
            raise ValueError(
                f"legs from {self.minimum_legs} to {self.maximum_legs} on {self.location_count} "
                "locations, expected 0 <= minimum_legs <= maximum_legs <= location_count"
            )

    @property
    def size(self) -> int:
        """Number of designs, in closed form.

        Raw: sum over legs ``L`` of ``C(N, L) M^L``. Canonical: ``C(N, L)`` times the ways to
        split ``L`` legs into at most ``M`` unnamed groups, a sum of Stirling numbers.
        """
        legs = range(self.minimum_legs, self.maximum_legs + 1)
        if not self.canonical:
            return sum(comb(self.location_count, leg) * self.regulator_count**leg for leg in legs)
        return sum(
            comb(self.location_count, leg)
            * sum(_stirling(leg, group) for group in range(self.regulator_count + 1))
            for leg in legs
        )

    def __len__(self) -> int:
        return self.size

    def __iter__(self) -> Iterator[Design]:
        return iter(self.designs)

    def __getitem__(self, index: int) -> Design:
        return self.designs[index]

    def __contains__(self, design: object) -> bool:
        return design in self._index

    @cached_property
    def designs(self) -> tuple[Design, ...]:
        """Every design, in lexicographic order of the assignment."""
        return tuple(Design(assignment) for assignment in self._assignments((), 0, 0))

    def _assignments(
        self, start: tuple[int, ...], leg_count: int, highest: int
    ) -> Iterator[tuple[int, ...]]:
        left = self.location_count - len(start)
        if leg_count > self.maximum_legs or leg_count + left < self.minimum_legs:
            return
        if left == 0:
            yield start
            return
        # In canonical form a new name may be at most one above the highest name in use.
        last = self.regulator_count
        if self.canonical:
            last = min(last, highest + 1)
        for regulator in range(last + 1):
            yield from self._assignments(
                (*start, regulator), leg_count + (regulator > 0), max(highest, regulator)
            )

    @cached_property
    def _index(self) -> dict[Design, int]:
        return {design: index for index, design in enumerate(self.designs)}

    def index(self, design: Design) -> int:
        """Place of a design in `designs`; made canonical first if the space is.

        Raises:
            ValueError: The design is not one of this space.
        """
        self.check(design)
        return self._index[design.canonical() if self.canonical else design]

    def check(self, design: Design) -> None:
        """Raise `ValueError`, saying what is wrong, unless the design belongs to the space."""
        if design.location_count != self.location_count:
            raise ValueError(
                f"design {design} has {design.location_count} locations, expected "
                f"{self.location_count}: write a 0 for each location without a leg"
            )
        design.check_regulators(self.regulator_count)
        if design.leg_count < self.minimum_legs:
            raise ValueError(
                f"design {design} has too few legs: {design.leg_count}, expected at least "
                f"{self.minimum_legs}; with fewer the robot cannot stand"
            )
        if design.leg_count > self.maximum_legs:
            raise ValueError(
                f"design {design} has too many legs: {design.leg_count}, expected at most "
                f"{self.maximum_legs}"
            )

    def parse(self, text: str) -> Design:
        """Read a design and check that it belongs to the space; canonical if the space is.

        Raises:
            ValueError: The text is no design, or the design is not of this space.
        """
        design = Design.parse(text)
        self.check(design)
        return design.canonical() if self.canonical else design

    @cached_property
    def one_hot(self) -> np.ndarray:
        """One-hot rows of all designs, shape (design, N (M + 1)) float32."""
        assignment = np.array([design.assignment for design in self.designs])
        return np.eye(self.regulator_count + 1, dtype=np.float32)[assignment].reshape(
            len(self), self.location_count * (self.regulator_count + 1)
        )

    @cached_property
    def mirror_index(self) -> np.ndarray:
        """Index of each design's mirror image, shape (design,); canonical if the space is."""
        return np.array([self.index(design.mirror()) for design in self.designs])

    @cached_property
    def mirror_regulator(self) -> np.ndarray:
        """Which of a design's regulators drives each regulator of its mirror image.

        Regulator ``m`` (from 0) of the canonical mirror image must receive what regulator
        ``mirror_regulator[design, m]`` of the design receives, for the two robots to walk
        mirrored paths. Shape (design, M); unused regulators fill up in rising order.
        """
        names = range(1, self.regulator_count + 1)
        rows = []
        for design in self.designs:
            used = design.mirror().regulator_order() if self.canonical else ()
            order = [*used, *(name for name in names if name not in used)]
            rows.append([name - 1 for name in order])
        return np.array(rows)


def _stirling(element_count: int, group_count: int) -> int:
    """Stirling number of the second kind: ways to split elements into nonempty groups."""
    if group_count == 0:
        return int(element_count == 0)
    if group_count > element_count:
        return 0
    return group_count * _stirling(element_count - 1, group_count) + _stirling(
        element_count - 1, group_count - 1
    )
