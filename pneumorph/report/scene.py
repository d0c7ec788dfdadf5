"""What a film shows of one robot at one instant: triangles in the world and the colour of each."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from pneumorph.geometry.disk import DiskShape
from pneumorph.report.style import DISK_COLOUR, red_green_blue, regulator_colour
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from pneumorph.trajectory import Trajectory

ColourBy = Literal["regulator", "pressure"]
"""What the colour of a leg tells."""

_FULL_COLOUR_KPA = 90.0
_SLACK_TINT = 0.45


@dataclass(frozen=True)
class Actor:
    """One robot of a film.

    Attributes:
        trajectory: What it did, with node positions and skin.
        label: What to write beside it.
        regulators: Regulator of each leg, 1, 2, ..., in the trajectory's order of legs.
        lane_mm: Where to place it across the direction of travel (y).
        disk: The body that carries the legs.
    """

    trajectory: Trajectory
    label: str
    regulators: tuple[int, ...]
    lane_mm: float = 0.0
    disk: DiskShape = field(default_factory=DiskShape)

    def __post_init__(self) -> None:
        nodes, skin = self.trajectory.node_positions_mm, self.trajectory.skin_triangles
        if nodes is None or skin is None:
            raise ValueError(
                f"the trajectory of {self.label!r} holds no node positions or no skin, which"
                " drawing needs; simulate again and record the nodes"
            )
        if nodes.shape[1] != len(self.regulators):
            raise ValueError(
                f"{self.label!r} has {len(self.regulators)} regulators, expected one for each of "
                f"the {nodes.shape[1]} legs of its trajectory"
            )
        if skin.size and skin.max() >= nodes.shape[2]:
            raise ValueError(
                f"the skin of {self.label!r} names node {skin.max()}, its trajectory has "
                f"{nodes.shape[2]} nodes a leg; the two come from different meshes"
            )

    @classmethod
    def of(cls, trajectory: Trajectory, label: str) -> Actor:
        """Return the actor of a trajectory whose metadata names its design.

        Raises:
            ValueError: No design in the metadata, or nothing to draw.
        """
        design = trajectory.metadata.get("design")
        if not isinstance(design, str):
            raise ValueError(
                f"the trajectory of {label!r} does not name its design, expected such as "
                "1.0.0.2.2.0.0.1 in its metadata"
            )
        regulators = tuple(regulator for _, regulator in Design.parse(design).legs)
        return cls(trajectory, label, regulators)

    @cached_property
    def skin(self) -> tuple[np.ndarray, np.ndarray]:
        """World positions of the skin's nodes [mm], (frame, leg, node, 3), and its triangles."""
        thin = self.trajectory.with_skin_only()
        assert thin.node_positions_mm is not None
        assert thin.skin_triangles is not None
        return thin.node_positions_mm, thin.skin_triangles

    @property
    def end_s(self) -> float:
        """Time of its last frame [s]."""
        return float(self.trajectory.time_s[-1])

    @property
    def path_mm(self) -> np.ndarray:
        """Way of the tracked point from above, in its lane, (frame, 2)."""
        return np.asarray(self.trajectory.tracked_point_mm[:, :2] + np.array([0.0, self.lane_mm]))

    def extent_mm(self) -> np.ndarray:
        """Return corners of boxes around all that it will be drawn with, (point, 3)."""
        lane = np.array([0.0, self.lane_mm, 0.0])
        nodes = self.skin[0]
        low, high = (end(nodes, axis=(0, 1, 2)) + lane for end in (np.nanmin, np.nanmax))
        high[2] = max(high[2], low[2] + 45.0)
        corners = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij"))
        hub = self.trajectory.hub_position_mm[[0, -1]] + lane
        side = np.array([self.disk.top_radius_mm, 0.0, 0.0])
        return np.concatenate([corners.reshape(3, -1).T, hub - side, hub + side])

    def frame_at(self, time_s: float) -> int:
        """Return the last recorded frame at or before a time."""
        times = self.trajectory.time_s
        return max(int(np.searchsorted(times, time_s + 1e-9, side="right")) - 1, 0)

    def corners(self, frame: int) -> np.ndarray:
        """Return all surface triangles in the world, legs first, (triangle, 3, 3) mm."""
        nodes, triangles = self.skin
        legs = nodes[frame][:, triangles].reshape(-1, 3, 3)
        disk = _disk_corners(self.disk) @ self.trajectory.hub_rotation[frame].T
        disk += self.trajectory.hub_position_mm[frame]
        return np.concatenate([legs, disk]) + np.array([0.0, self.lane_mm, 0.0])

    def colours(self, frame: int, colour_by: ColourBy = "regulator") -> np.ndarray:
        """Return the colour of each triangle of `corners`, (triangle, 3) in 0..1.

        A leg has its regulator's colour, pale where it is slack and full at 90 kPa, or the
        pressure's colour from 0 to 90 kPa in cividis, made for any colour vision.
        """
        import matplotlib

        pressure = self.trajectory.regulated_kPa[frame][np.array(self.regulators) - 1]
        inflated = np.clip(pressure / _FULL_COLOUR_KPA, 0.0, 1.0)
        if colour_by == "pressure":
            legs = matplotlib.colormaps["cividis"](inflated)[:, :3]
        else:
            full = [red_green_blue(regulator_colour(each)) for each in self.regulators]
            strength = _SLACK_TINT + (1.0 - _SLACK_TINT) * inflated
            legs = 1.0 - strength[:, None] * (1.0 - np.array(full))
        disk = np.tile(red_green_blue(DISK_COLOUR), (len(_disk_corners(self.disk)), 1))
        return np.concatenate([np.repeat(legs, len(self.skin[1]), axis=0), disk])


def _disk_corners(disk: DiskShape, segment_count: int = 40) -> np.ndarray:
    """Return the surface of the disk as triangles with outward normals, (triangle, 3, 3) mm.

    Its profile, from the middle of the bottom over the side to the middle of the top, is turned
    about the axis. Triangles are as small as those of legs, among which they are sorted by depth.
    """
    share = np.linspace(0.0, 1.0, 8)
    low, high, top = disk.bottom_radius_mm, disk.top_radius_mm, disk.top_centre_mm[2]
    radius = np.concatenate([low * share, [(low + high) / 2], high * share[::-1]])
    height = np.repeat([disk.bottom_mm, (disk.bottom_mm + top) / 2, top], [8, 1, 8])
    angle = 2 * np.pi * np.arange(segment_count + 1) / segment_count
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    points = radius[:, None, None] * ring + height[:, None, None] * np.array([0.0, 0.0, 1.0])
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)])
    return corners.reshape(-1, 3, 3)
