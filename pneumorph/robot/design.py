"""A design: which candidate locations of the hub carry a leg, and which regulator inflates each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

MINIMUM_LEGS = 3
"""Fewest legs of a crawling design (paper, section III-B)."""
BASELINE_DESIGN = "1.0.0.2.2.0.0.1"
"""Two fore legs on regulator 1 and two hind legs on regulator 2 (paper, section IV)."""


@dataclass(frozen=True, order=True)
class Design:
    """Legs of one robot, told by the regulator of each location.

    Designs are identified by this content, are hashable, and sort lexicographically.

    Attributes:
        assignment: Per location around the hub, 0 for no leg, else the number (from 1) of the
            regulator the leg is connected to. Leg ``k`` of ``n`` sits at ``360 (k + 1/2) / n``
            degrees from the forward axis, counter-clockwise seen from above.
    """

    assignment: tuple[int, ...]

    def __post_init__(self) -> None:
        assignment = tuple(self.assignment)
        if not assignment:
            raise ValueError(
                "assignment has no locations, expected one number per location of the hub"
            )
        for location, regulator in enumerate(assignment):
            if isinstance(regulator, bool) or not isinstance(regulator, int | np.integer):
                raise ValueError(
                    f"assignment[{location}] is {regulator!r}, expected a whole number: 0 for no "
                    "leg, else the number of a regulator"
                )
            if regulator < 0:
                raise ValueError(
                    f"assignment[{location}] is {regulator}, expected 0 for no leg or the number "
                    "of a regulator, counted from 1"
                )
        object.__setattr__(self, "assignment", tuple(int(regulator) for regulator in assignment))

    @classmethod
    def parse(cls, text: str) -> Design:
        """Read a design such as ``1.0.0.2.2.0.0.1``, as `str` writes it.

        Raises:
            ValueError: The text is not whole numbers joined by dots.
        """
        fields = text.strip().split(".")
        if not all(field.isascii() and field.isdigit() for field in fields):
            raise ValueError(
                f"design {text!r} is not whole numbers joined by dots, expected one per location "
                "such as 1.0.0.2.2.0.0.1 (0 = no leg, else the regulator)"
            )
        return cls(tuple(int(field) for field in fields))

    def __str__(self) -> str:
        return ".".join(str(regulator) for regulator in self.assignment)

    @property
    def location_count(self) -> int:
        """Number of candidate locations around the hub."""
        return len(self.assignment)

    @property
    def leg_count(self) -> int:
        """Number of legs."""
        return sum(regulator > 0 for regulator in self.assignment)

    @property
    def legs(self) -> tuple[tuple[int, int], ...]:
        """(location, regulator) of each leg, in order of location; regulators count from 1."""
        return tuple(
            (location, regulator)
            for location, regulator in enumerate(self.assignment)
            if regulator > 0
        )

    def angle_rad(self, location: int) -> float:
        """Direction of a location, counter-clockwise from the forward (x) axis [rad]."""
        return 2.0 * math.pi * (location + 0.5) / self.location_count

    def regulator_order(self) -> tuple[int, ...]:
        """Regulators in order of first appearance: entry ``i`` becomes regulator ``i + 1``."""
        return tuple(dict.fromkeys(regulator for regulator in self.assignment if regulator > 0))

    def canonical(self) -> Design:
        """The same robot with its regulators renumbered in order of first appearance.

        Designs that differ only by the names of their regulators have the same canonical form.
        """
        number = {old: new for new, old in enumerate(self.regulator_order(), start=1)}
        number[0] = 0
        return Design(tuple(number[regulator] for regulator in self.assignment))

    def mirror(self) -> Design:
        """The mirror image about the forward axis, with the regulators' names kept.

        Leg ``k`` of ``n`` goes to location ``n - 1 - k``. The result need not be canonical:
        driven by the same pressures it walks the mirrored path.
        """
        return Design(self.assignment[::-1])

    def one_hot(self, regulator_count: int) -> np.ndarray:
        """One one-hot vector per location, concatenated (paper, appendix A).

        Args:
            regulator_count: Number of regulators ``M``.

        Returns:
            shape (location x (M + 1),) float32; the first entry of each block says "no leg".

        Raises:
            ValueError: A leg's regulator is above ``regulator_count``.
        """
        self.check_regulators(regulator_count)
        return np.eye(regulator_count + 1, dtype=np.float32)[list(self.assignment)].reshape(-1)

    def check_regulators(self, regulator_count: int) -> None:
        """Raise `ValueError` where a leg is on a regulator that does not exist."""
        for location, regulator in enumerate(self.assignment):
            if regulator > regulator_count:
                raise ValueError(
                    f"design {self} connects location {location} to regulator {regulator}, "
                    f"expected 1 to {regulator_count}: this rig has {regulator_count} regulators"
                )
