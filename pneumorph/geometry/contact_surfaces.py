"""Which named region of a mesh a contact point lies on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.geometry.surface import surface_area
from pneumorph.geometry.triangle_distance import distance_to

TOUCH_MM = 1e-6
"""Regions that are nearer or further than this from each other touch a point alike [mm]."""


@dataclass(frozen=True, eq=False)
class ContactSurfaces:
    """What contact points lie on.

    Raises:
        ValueError: Not one area for each name, or an area is negative or not finite.
    """

    names: np.ndarray
    """Name of each point's surface, empty where nobody named it, (point,)."""
    area_mm2: np.ndarray
    """Area that each point stands for [mm^2], zero where it is not known, (point,)."""
    elsewhere: frozenset[str] = frozenset()
    """Names that none of the points has, and robots of the same kind may have."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", np.array(self.names, dtype=str))
        object.__setattr__(self, "area_mm2", np.array(self.area_mm2, dtype=float))
        if self.names.ndim != 1 or self.names.shape != self.area_mm2.shape:
            raise ValueError(
                f"area_mm2 must have shape {self.names.shape}, one for each name, got "
                f"{self.area_mm2.shape}"
            )
        if not np.all((self.area_mm2 >= 0.0) & np.isfinite(self.area_mm2)):
            raise ValueError("area_mm2 must be finite and not negative")

    @classmethod
    def unnamed(cls, count: int) -> ContactSurfaces:
        """Points of which nothing is known."""
        return cls(np.full(count, ""), np.zeros(count))

    @classmethod
    def of_one(cls, name: str, area_mm2: float, count: int) -> ContactSurfaces:
        """Points of one surface, whose area they share alike."""
        return cls(np.full(count, name), np.full(count, area_mm2 / max(count, 1)))

    @classmethod
    def joined(cls, parts: Sequence[ContactSurfaces]) -> ContactSurfaces:
        """The points of several bodies, one after the other."""
        return cls(
            np.concatenate([part.names for part in parts]),
            np.concatenate([part.area_mm2 for part in parts]),
        )

    def known_names(self) -> list[str]:
        """The names that there are."""
        return sorted(set(self.names.tolist()) - {""})


def surfaces_at(
    nodes: np.ndarray, regions: Mapping[str, np.ndarray], points: np.ndarray
) -> ContactSurfaces:
    """Name the region that each point lies on, or is nearest to.

    Where regions overlap or meet, a point belongs to the one of the smallest area: that of a sole
    on a skin that is all of the boundary, edges included. Each point stands for its region's area
    over the number of the region's points.

    Args:
        nodes: Positions [mm], (node, 3).
        regions: Triangles of the outer surface by name, each (triangle, 3).
        points: Positions [mm], (point, 3).
    """
    areas = {name: surface_area(nodes, triangles) for name, triangles in regions.items()}
    order = sorted(areas, key=lambda name: (areas[name], name))
    names = np.full(len(points), "", dtype=object)
    nearest = np.full(len(points), np.inf)
    for name in order:
        distance = np.array([distance_to(point, nodes[regions[name]]) for point in points])
        nearer = distance < nearest - TOUCH_MM
        names[nearer], nearest[nearer] = name, distance[nearer]
    counts = {name: int(np.count_nonzero(names == name)) for name in order}
    share = {name: areas[name] / max(counts[name], 1) for name in order}
    return ContactSurfaces(names, np.array([share.get(name, 0.0) for name in names]))
