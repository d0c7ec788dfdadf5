"""How what a hub carries is drawn, in three dimensions and from above: a ball at its place, and a
thin line from the hub to it.

It is drawn over what would hide it, so that one inside the hub is seen too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pneumorph.geometry.robot_shape import RobotShape
from pneumorph.geometry.triangle_distance import nearest_point

_OF_HUB, _LEAST_MM = 0.05, 4.0
"""Radius of the ball relative to the hub's longest side, and at least [mm]."""
_LINE = 0.25
"""Radius of the line relative to the ball's."""
_SIDES = 6
_AROUND = 24


@dataclass(frozen=True, eq=False)
class PayloadMark:
    """The mark, in the robot's frame.

    Attributes:
        place_mm: Where the payload lies [mm], (3,).
        foot_mm: The point of the hub's surface that is nearest to it [mm], (3,).
        radius_mm: Of the ball [mm].
    """

    place_mm: np.ndarray
    foot_mm: np.ndarray
    radius_mm: float

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Triangles of the line and then of the ball, normals outward, (triangle, 3, 3) [mm]."""
        ball = self.place_mm + self.radius_mm * _ball()
        return np.concatenate([self._line(), ball])

    @property
    def outline_mm(self) -> np.ndarray:
        """The ball from above, (corner, 2) [mm]."""
        turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.asarray(self.place_mm[:2] + self.radius_mm * circle)

    @property
    def line_mm(self) -> np.ndarray:
        """Ends of the line from above, the hub's first, (2, 2) [mm]."""
        return np.array([self.foot_mm[:2], self.place_mm[:2]])

    def _line(self) -> np.ndarray:
        along = self.place_mm - self.foot_mm
        length = float(np.linalg.norm(along))
        if length < self.radius_mm:  # inside the ball
            return np.zeros((0, 3, 3))
        along = along / length
        across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        across /= np.linalg.norm(across)
        turn = 2.0 * np.pi * np.arange(_SIDES + 1) / _SIDES
        rim = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), np.cross(along, across))
        low = self.foot_mm + _LINE * self.radius_mm * rim
        high = low + self.place_mm - self.foot_mm
        lower = np.stack([low[:-1], low[1:], high[1:]], axis=1)
        return np.concatenate([lower, np.stack([low[:-1], high[1:], high[:-1]], axis=1)])


def payload_mark(
    place_mm: np.ndarray | None, hub_nodes_mm: np.ndarray, hub_triangles: np.ndarray
) -> PayloadMark | None:
    """Return the mark of what a hub carries; None where it carries nothing.

    Args:
        place_mm: Where that lies in the robot's frame [mm], (3,).
        hub_nodes_mm: The hub's [mm], (node, 3); none of one whose shape is not known.
        hub_triangles: Of its surface, (triangle, 3).
    """
    if place_mm is None:
        return None
    place = np.asarray(place_mm, dtype=float)
    if not len(hub_triangles):
        return PayloadMark(place, place, _LEAST_MM)
    longest = float(np.ptp(hub_nodes_mm, axis=0).max())
    foot = nearest_point(place, hub_nodes_mm[hub_triangles])
    return PayloadMark(place, foot, max(_LEAST_MM, _OF_HUB * longest))


def payload_mark_of(shape: RobotShape) -> PayloadMark | None:
    """Return the mark of what a recorded robot carries; None where it carries nothing."""
    return payload_mark(shape.payload_mm, shape.hub_nodes_mm, shape.hub_triangles)


def _ball() -> np.ndarray:
    """Triangles of a ball of radius 1, normals outward, (triangle, 3, 3)."""
    signs = [(x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    corners = np.array([np.diag(each)[:: each[0] * each[1] * each[2]] for each in signs], float)
    for _ in range(2):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = a + b, b + c, c + a
        quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([
            np.stack([each / np.linalg.norm(each, axis=1, keepdims=True) for each in quarter], 1)
            for quarter in quarters
        ])  # fmt: skip
    return corners
