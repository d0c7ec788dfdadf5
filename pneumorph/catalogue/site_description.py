"""A place for a module, as a robot's description has it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked
from pneumorph.geometry.pose import Pose, rotation_about

Vector = tuple[float, float, float]

_SAME_MM = 1e-3
Angle = Annotated[float, Bounds(-360.0, 360.0)]


@dataclass(frozen=True)
class SiteDescription(Checked):
    """A place for a module; its frame is where the module's attachment face comes."""

    position_mm: Vector
    """Middle of the attachment face in the robot's frame [mm]."""
    yaw_deg: Angle = 0.0
    """Where the module points, seen from above, counter-clockwise from forward [degrees]."""
    pitch_deg: Angle = 0.0
    """How much it points down [degrees]."""
    roll_deg: Angle = 0.0
    """Turn about the direction it points in [degrees]."""
    modules: tuple[str, ...] | None = None
    """Names of the modules that may be mounted; all by default."""
    name: str = ""
    """What messages call it; its number, from 0, by default."""

    @property
    def pose(self) -> Pose:
        """The site's frame in the robot's."""
        turn = rotation_about("z", self.yaw_deg) @ rotation_about("y", self.pitch_deg)
        return Pose(turn @ rotation_about("x", self.roll_deg), np.array(self.position_mm))

    def told(self, number: int) -> str:
        """What messages call it.

        Args:
            number: Its place among the sites, from 0.
        """
        return f"sites[{number}]" + (f" ({self.name})" if self.name else "")


def refuse_doubled_sites(sites: Sequence[SiteDescription], exclusions: Sequence[str]) -> None:
    """Refuse two sites of one name, and two in one place that may both carry a module.

    Args:
        sites: The sites.
        exclusions: Numbers of sites of which one at most may carry a module, such as ``0 1``.

    Raises:
        ValueError: There are two; names both.
    """
    apart = [set(text.split()) for text in exclusions]
    for (first, one), (second, other) in combinations(enumerate(sites), 2):
        if one.name and one.name == other.name:
            raise ValueError(
                f"sites[{first}] and sites[{second}] are both called {one.name!r}, expected names "
                "of their own: messages would not tell which"
            )
        distance = np.abs(np.subtract(one.position_mm, other.position_mm)).max()
        together = any({str(first), str(second)} <= each for each in apart)
        if distance < _SAME_MM and not together:
            raise ValueError(
                f"{one.told(first)} and {other.told(second)} are both at "
                f"{list(one.position_mm)} mm, expected places of their own; where one at most "
                f'carries a module, say so: exclusions = ["{first} {second}"] under [designs]'
            )


def refuse_repeated_modules(sites: Sequence[SiteDescription]) -> None:
    """Refuse a site that names a module twice.

    Args:
        sites: The sites.

    Raises:
        ValueError: There is one; names the module.
    """
    for number, site in enumerate(sites):
        for name, count in Counter(site.modules or ()).items():
            if count > 1:
                raise ValueError(
                    f"sites[{number}].modules is {list(site.modules or ())} and names {name!r} "
                    f"{count} times, expected each module once: it says which may be mounted, of "
                    "which a site carries one; another module may be meant"
                )
