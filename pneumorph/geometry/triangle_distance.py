"""The point of triangles that is nearest to another point, and how far away it is.

A triangle without area has no plane: its edges alone count, and of an edge without length its end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


def distance_to(point: np.ndarray, triangles: np.ndarray) -> float:
    """Distance of a point from the nearest of triangles [mm]; infinite where there are none.

    Args:
        point: The point [mm], (3,).
        triangles: Their corners [mm], (triangle, 3, 3).
    """
    corners = triangles - point
    planes = _Planes.of(corners)
    normal, square = planes.normal, planes.square
    height = np.abs(np.einsum("ti,ti->t", corners[:, 0], normal)) / np.sqrt(square)
    least = float(np.min(height, where=planes.inside, initial=np.inf))
    for feet in _edge_feet(corners):
        least = min(least, float(np.linalg.norm(feet, axis=1).min(initial=np.inf)))
    return least


def nearest_point(point: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Point of triangles that is nearest to a point [mm], (3,).

    Args:
        point: The point [mm], (3,).
        triangles: Their corners, of one triangle at least [mm], (triangle, 3, 3).
    """
    corners = triangles.astype(float) - point
    feet = np.concatenate([_Planes.of(corners).feet(corners), *_edge_feet(corners)])
    return np.asarray(point + feet[np.argmin(np.einsum("ti,ti->t", feet, feet))])


@dataclass(frozen=True, eq=False)
class _Planes:
    """Planes of triangles, and the feet on them of the origin, by barycentric coordinates."""

    first: np.ndarray
    """From each first corner to the second [mm], (triangle, 3)."""
    second: np.ndarray
    """From each first corner to the last [mm], (triangle, 3)."""
    normal: np.ndarray
    """Twice as long as each area is large [mm^2], (triangle, 3)."""
    square: np.ndarray
    """Its square, 1 where that is zero, (triangle,)."""
    u: np.ndarray
    """Coordinate of the second corner, (triangle,)."""
    v: np.ndarray
    """Coordinate of the last corner, (triangle,)."""
    inside: np.ndarray
    """Whether the foot lies in the triangle, which has an area, (triangle,) bool."""

    @classmethod
    def of(cls, corners: np.ndarray) -> _Planes:
        """Of triangles with these corners, seen from the point, (triangle, 3, 3) [mm]."""
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normal = np.cross(first, second)
        square = np.einsum("ti,ti->t", normal, normal)
        flat = square == 0.0
        square = np.where(flat, 1.0, square)
        u = np.einsum("ti,ti->t", np.cross(-corners[:, 0], second), normal) / square
        v = np.einsum("ti,ti->t", np.cross(first, -corners[:, 0]), normal) / square
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & ~flat
        return cls(first, second, normal, square, u, v, inside)

    def feet(self, corners: np.ndarray) -> np.ndarray:
        """The feet that lie in their triangles [mm], (foot, 3)."""
        feet = corners[:, 0] + self.u[:, None] * self.first + self.v[:, None] * self.second
        return np.asarray(feet[self.inside])


def _edge_feet(corners: np.ndarray) -> Iterator[np.ndarray]:
    """Points of the three edges that are nearest to the origin [mm], each (triangle, 3)."""
    for begin, end in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, end] - corners[:, begin]
        long = np.einsum("ti,ti->t", edge, edge)
        along = -np.einsum("ti,ti->t", corners[:, begin], edge)
        along = np.clip(along / np.where(long == 0.0, 1.0, long), 0.0, 1.0)
        yield corners[:, begin] + along[:, None] * edge
