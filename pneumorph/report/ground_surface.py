"""The ground that a robot walked on, as pages and films draw it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from pneumorph.base.settings import settings_from_dict
from pneumorph.physics.ground import Ground
from pneumorph.physics.height_grid import HeightGrid
from pneumorph.trajectory import Trajectory

SPACING_MM = 10.0
"""Between the heights that are drawn [mm]."""
AROUND_MM = 250.0
"""How far beyond the robot's way the ground is drawn [mm]."""
AHEAD_MM = 800.0
"""The same of a robot that is still walking, whose way is not known [mm]."""


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
    """The ground of a walk; None of one on a plane or on a height that was given as a function, and
    where the file of its map is no longer there."""
    found = _grid_and_base(trajectory)
    if found is None:
        return None
    grid, base = found
    around = AHEAD_MM if trajectory.status == "running" else AROUND_MM
    way = trajectory.tracked_point_mm[:, :2]
    way = way[np.isfinite(way).all(axis=1)]
    line = 5 * SPACING_MM
    low = np.floor((way.min(axis=0) - around) / line) * line
    high = np.ceil((way.max(axis=0) + around) / line) * line
    x, y = (
        np.linspace(start, end, 1 + round((end - start) / SPACING_MM))
        for start, end in zip(low, high, strict=True)
    )
    return GroundSurface(x, y, base + grid.height(*np.meshgrid(x, y, indexing="ij")))


def ground_below(
    trajectory: Trajectory, points: Float[np.ndarray, "*point 3"]
) -> Float[np.ndarray, "*point"] | None:
    """World heights of the ground of a walk straight below world points [mm]; None as of
    `ground_surface`."""
    found = _grid_and_base(trajectory)
    if found is None:
        return None
    grid, base = found
    below: np.ndarray = base + grid.height(*np.moveaxis(points[..., :2].astype(float), -1, 0))
    return below


def above_floor(
    trajectory: Trajectory, points: Float[np.ndarray, "*point 3"]
) -> Float[np.ndarray, "*point"] | None:
    """How far world points are straight above the floor of a walk, negative below it [mm]; None
    where it is not known: of a height that was given as a function, and where the file of its map
    is no longer there."""
    below: np.ndarray | float | None = ground_below(trajectory, points)
    if below is None:
        below = plane_height_mm(trajectory.metadata)
    if below is None:
        return None
    above: np.ndarray = points[..., 2].astype(float) - below
    return above


def plane_height_mm(metadata: Mapping[str, Any]) -> float | None:
    """Height of the plane on which contact points of a walk rest [mm]; None where it walked on no
    plane, or its metadata does not tell."""
    height = metadata.get("settings", {}).get("floor_height_mm")
    floor = metadata.get("contact", {}).get("floor", "plane")
    plane = str(floor).startswith("plane") and "ground_base_mm" not in metadata
    return float(height) if height is not None and plane else None


def _grid_and_base(trajectory: Trajectory) -> tuple[HeightGrid, float] | None:
    """The heights of a walk's ground, and what they are counted from [mm]."""
    metadata = trajectory.metadata
    base, told = metadata.get("ground_base_mm"), metadata.get("settings", {}).get("ground")
    if base is None or told is None:
        return None
    try:
        ground = settings_from_dict(Ground, told)
        # Beside a floor that was given as a function the settings have the usual plane.
        return None if ground.is_plane else (ground.grid(), float(base))
    except (FileNotFoundError, ValueError):
        return None
