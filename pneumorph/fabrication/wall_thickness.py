"""Wall thickness of a solid, from rays through its surface."""

from __future__ import annotations

import numpy as np

from pneumorph.fabrication.solid import ClosedSurface

OPPOSITE = -0.5
"""Faces whose normals have a scalar product below are two sides of a wall; at less of an angle they
meet in an edge, where no thickness is defined."""

_CHUNK = 512


def wall_thickness_mm(surface: ClosedSurface, limit_mm: float = 10.0) -> np.ndarray:
    """Distance from the middle of each triangle straight through the solid to the other side [mm].

    Rays run along the inward normal; a ray meets a triangle where its point in the triangle's plane
    has barycentric coordinates that are not negative.

    Args:
        surface: The surface.
        limit_mm: Walls thicker than this are not measured [mm].

    Returns:
        (triangle,); infinite where no opposite side is nearer than the limit.
    """
    corners = surface.nodes[surface.triangles]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = crosses / np.linalg.norm(crosses, axis=1, keepdims=True)
    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    offsets = np.einsum("ti,ti->t", normals, corners[:, 0])
    squares = np.einsum("ti,ti->t", middles, middles)
    result = np.full(len(corners), np.inf)
    for begin in range(0, len(corners), _CHUNK):
        rays = np.arange(begin, min(begin + _CHUNK, len(corners)))
        cosine = normals[rays] @ normals.T
        # Only triangles that face the ray's own and are near can be the other side of a thin wall.
        apart = squares[rays, None] + squares - 2.0 * middles[rays] @ middles.T
        ray, hit = np.nonzero((cosine < OPPOSITE) & (apart < (limit_mm + radii) ** 2))
        distance = (middles[rays] @ normals.T - offsets)[ray, hit] / cosine[ray, hit]
        points = middles[rays[ray]] - distance[:, None] * normals[rays[ray]]
        inside = _inside(points, corners[hit], crosses[hit])
        valid = inside & (distance > 1e-6) & (distance < limit_mm)
        np.minimum.at(result, rays[ray[valid]], distance[valid])
    return result


def _inside(points: np.ndarray, corners: np.ndarray, crosses: np.ndarray) -> np.ndarray:
    """Whether points of the triangles' planes lie in the triangles, (pair,)."""
    square = np.einsum("pi,pi->p", crosses, crosses)
    inside = np.ones(len(points), dtype=bool)
    for corner in range(3):
        a, b = corners[:, corner], corners[:, (corner + 1) % 3]
        area = np.einsum("pi,pi->p", np.cross(b - a, points - a), crosses)
        inside &= area >= -1e-9 * square
    return inside
