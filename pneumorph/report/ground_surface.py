"""The ground that a robot walked on, as pages and films draw it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pneumorph.base.settings import settings_from_dict
from pneumorph.physics.ground import Ground
from pneumorph.trajectory import Trajectory

SPACING_MM = 10.0
"""Between the heights that are drawn [mm]."""
AROUND_MM = 250.0
"""How far beyond the robot's way the ground is drawn [mm]."""


@dataclass(frozen=True, eq=False)
class GroundSurface:
    """Heights around a robot's way, in the world."""

    x_mm: Float[np.ndarray, " column"]
    """Where the columns are [mm], a grid line on every fifth."""
    y_mm: Float[np.ndarray, " row"]
    """Where the rows are [mm]."""
    height_mm: Float[np.ndarray, "column row"]
    """World heights [mm]."""

    @property
    def points(self) -> Float[np.ndarray, "column row 3"]:
        """World positions of the nodes [mm]."""
        x, y = np.meshgrid(self.x_mm, self.y_mm, indexing="ij")
        return np.stack([x, y, self.height_mm], axis=2)

    @property
    def triangles(self) -> Float[np.ndarray, "triangle 3 3"]:
        """Two of each cell, their corners counter-clockwise from above [mm]."""
        at = self.points
        low, right, left, high = at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]
        pairs = np.stack([np.stack([low, right, high], 2), np.stack([low, high, left], 2)], 2)
        return pairs.reshape(-1, 3, 3)


def ground_surface(trajectory: Trajectory) -> GroundSurface | None:
    """The ground of a walk; None of one on a plane, and where the file of its map is no longer
    there."""
    metadata = trajectory.metadata
    base, told = metadata.get("ground_base_mm"), metadata.get("settings", {}).get("ground")
    if base is None or told is None:
        return None
    try:
        grid = settings_from_dict(Ground, told).grid()
    except (FileNotFoundError, ValueError):
        return None
    way = trajectory.tracked_point_mm[:, :2]
    way = way[np.isfinite(way).all(axis=1)]
    line = 5 * SPACING_MM
    low = np.floor((way.min(axis=0) - AROUND_MM) / line) * line
    high = np.ceil((way.max(axis=0) + AROUND_MM) / line) * line
    x, y = (
        np.linspace(start, end, 1 + round((end - start) / SPACING_MM))
        for start, end in zip(low, high, strict=True)
    )
    return GroundSurface(x, y, base + grid.height(*np.meshgrid(x, y, indexing="ij")))
