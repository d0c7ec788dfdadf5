"""What is known of the friction of surfaces that robots stand on: ranges, and whose word they are.

Nobody has measured Dragon Skin 30 on the floor of the paper's robots. These are not measurements of
it but the width of not knowing: draw from them rather than take a middle for a value.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

SHEET_SURFACE = "sheet"
"""A leg's underside."""
SKIN_SURFACE = "skin"
"""All else of a leg."""
HUB_SURFACE = "hub"
"""What carries the legs, where its description says nothing else."""
SURFACE_NAMES = (SHEET_SURFACE, SKIN_SURFACE, HUB_SURFACE)
"""A robot may touch the floor with some of them only, as one of legs that end in their sheets
does."""


def names_of_friction(known: Collection[str]) -> set[str]:
    """Surfaces that friction may be given for: those of a robot, and where it names these as others
    do also the others'.

    Args:
        known: Names of what it may touch the floor with.
    """
    return set(known) | (set(SURFACE_NAMES) if set(known) & set(SURFACE_NAMES) else set())


@dataclass(frozen=True)
class SurfaceFriction:
    """Range of Coulomb's coefficient of a kind of surface."""

    low: float
    high: float
    source: str
    """Where the ends are from, and on which counterface."""

    @property
    def middle(self) -> float:
        """Geometric mean of the ends: one value where one must be, and no measurement."""
        return math.sqrt(self.low * self.high)

    @property
    def nominal(self) -> float:
        """The middle to two digits, which is all that a robot needs that was never measured."""
        return round(self.middle, 2)

    @property
    def distribution(self) -> str:
        """The range as a distribution for a `Randomisation`."""
        return f"U({self.low:g}, {self.high:g})"


SILICONE = SurfaceFriction(
    0.25,
    1.2,
    "Makers of silicone rubber state from under 0.25 (treated) to over 0.75, and about 1.0 for an "
    "untreated, tacky surface, counterface not said; the paper took 1.2 by eye. Of silicones of "
    "soft robots it depends on contact pressure, temperature and counterface (Berthold, "
    "Burgner-Kahrs, Wangenheim and Kahms, Meccanica 58, 2023, 2165).",
)
"""Bare silicone rubber."""

SILICONE_OVER_SHEET = SurfaceFriction(
    0.25,
    1.2,
    "Not measured by anybody: an assumption, the range of bare silicone.",
)
"""A thin layer of silicone on a sheet of paper or fabric: the underside of a PneuNet."""

PRINTED_PLASTIC = SurfaceFriction(
    0.12,
    0.4,
    "Printed PLA on printed PLA 0.12 to 0.38, by the direction of the filaments, tilted plane "
    "(Santana, Alves and da Costa Sabino Netto 2020); plastic on wood 0.4 in handbooks.",
)
"""A printed part, such as a hub's rim."""
