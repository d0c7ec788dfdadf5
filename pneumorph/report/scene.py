"""What a film shows of one robot at one instant: triangles in the world and the colour of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import DISK_COLOUR, regulator_colour

if TYPE_CHECKING:
    from pneumorph.trajectory import Trajectory

_FULL_COLOUR_KPA = 90.0
_SLACK_TINT = 0.45


@dataclass(frozen=True)
class DiskShape:
    """The disk that carries the legs, a truncated cone, in the coordinates of the hub.

    Attributes:
        bottom_radius_mm: Radius below.
        top_radius_mm: Radius above.
        bottom_mm: Height of the lower face in the hub's coordinates.
        top_mm: Height of the upper face.
    """

    bottom_radius_mm: float = 50.0
    top_radius_mm: float = 54.5
    bottom_mm: float = 26.92
    top_mm: float = 44.92

    def corners(self, segment_count: int = 40) -> np.ndarray:
        """Return its surface as triangles with outward normals, (triangle, 3, 3) mm."""
        angle = 2 * np.pi * np.arange(segment_count + 1) / segment_count
        ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        low = self.bottom_radius_mm * ring + [0, 0, self.bottom_mm]
        high = self.top_radius_mm * ring + [0, 0, self.top_mm]
        top = np.broadcast_to([0.0, 0.0, self.top_mm], (segment_count, 3))
        bottom = np.broadcast_to([0.0, 0.0, self.bottom_mm], (segment_count, 3))
        return np.concatenate(
            [
                np.stack([low[:-1], low[1:], high[1:]], axis=1),
                np.stack([low[:-1], high[1:], high[:-1]], axis=1),
                np.stack([top, high[:-1], high[1:]], axis=1),
                np.stack([bottom, low[1:], low[:-1]], axis=1),
            ]
        )


@dataclass(frozen=True)
class Actor:
    """One robot of a film.

    Attributes:
        trajectory: What it did, with node positions.
        skin: Outer surface of a leg, (triangle, 3) indices into the trajectory's nodes.
        regulators: Regulator of each leg, 1, 2, ..., in the trajectory's order of legs.
        label: What to write beside it.
        lane_mm: Where to place it across the direction of travel (y).
        disk: The body that carries the legs.
    """

    trajectory: Trajectory
    skin: np.ndarray
    regulators: tuple[int, ...]
    label: str
    lane_mm: float = 0.0
    disk: DiskShape = DiskShape()

    def __post_init__(self) -> None:
        nodes = self.trajectory.node_positions_mm
        if nodes is None:
            raise ValueError(
                f"the trajectory of {self.label!r} holds no node positions; it was saved with "
                "record_nodes=False, so simulate it again with them to film it"
            )
        if nodes.shape[1] != len(self.regulators):
            raise ValueError(
                f"{self.label!r} has {len(self.regulators)} regulators, expected one for each of "
                f"the {nodes.shape[1]} legs of its trajectory"
            )
        if self.skin.size and self.skin.max() >= nodes.shape[2]:
            raise ValueError(
                f"the skin of {self.label!r} names node {self.skin.max()}, its trajectory has "
                f"{nodes.shape[2]} nodes a leg; the two come from different meshes"
            )

    def frame_at(self, time_s: float) -> int:
        """Return the last recorded frame at or before a time."""
        times = self.trajectory.time_s
        later = int(np.searchsorted(times, time_s + 1e-9, side="right"))
        return max(later - 1, 0)

    def corners(self, frame: int) -> np.ndarray:
        """Return all surface triangles in the world, legs first, (triangle, 3, 3) mm."""
        nodes = self.trajectory.node_positions_mm
        assert nodes is not None
        legs = nodes[frame][:, self.skin].reshape(-1, 3, 3)
        disk = (
            self.disk.corners() @ self.trajectory.hub_rotation[frame].T
            + self.trajectory.hub_position_mm[frame]
        )
        return np.concatenate([legs, disk]) + np.array([0.0, self.lane_mm, 0.0])

    def colours(self, frame: int) -> np.ndarray:
        """Return the colour of each triangle of `corners`, (triangle, 3) in 0..1.

        A leg has its regulator's colour, pale where it is slack and full at 90 kPa.
        """
        pressures = self.trajectory.regulated_kPa[frame]
        colours = []
        for regulator in self.regulators:
            inflated = np.clip(pressures[regulator - 1] / _FULL_COLOUR_KPA, 0.0, 1.0)
            strength = _SLACK_TINT + (1.0 - _SLACK_TINT) * inflated
            full = np.array(red_green_blue(regulator_colour(regulator)))
            colours.append(np.tile(1.0 - strength * (1.0 - full), (len(self.skin), 1)))
        disk = np.tile(red_green_blue(DISK_COLOUR), (len(self.disk.corners()), 1))
        return np.concatenate([*colours, disk])


def red_green_blue(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue in 0..1 of a colour written as ``#RRGGBB``."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue
