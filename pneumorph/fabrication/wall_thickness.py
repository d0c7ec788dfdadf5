"""Wall thickness of a solid, from rays through its surface."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.fabrication.solid import ClosedSurface

OPPOSITE = -0.5
"""Faces whose normals have a scalar product below are two sides of a wall; at less of an angle they
meet in an edge, where no thickness is defined."""

_GROUP = 128
"""Rays that are followed together."""


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
    result = np.full(len(corners), np.inf)
    for rays in _neighbours(middles):
        # Only triangles that face the ray's own and are near can be the other side of a thin wall.
        low, high = middles[rays].min(axis=0), middles[rays].max(axis=0)
        outside = np.maximum(np.maximum(low - middles, middles - high), 0.0)
        near = np.flatnonzero(np.linalg.norm(outside, axis=1) < limit_mm + radii)
        cosine = normals[rays] @ normals[near].T
        ray, other = np.nonzero(cosine < OPPOSITE)
        hit, cosine = near[other], cosine[ray, other]
        start, inwards = middles[rays[ray]], -normals[rays[ray]]
        distance = (np.einsum("pi,pi->p", start, normals[hit]) - offsets[hit]) / cosine
        reached = (distance > 1e-6) & (distance < limit_mm)
        ray, hit, distance = ray[reached], hit[reached], distance[reached]
        points = start[reached] + distance[:, None] * inwards[reached]
        inside = _inside(points, corners[hit], crosses[hit])
        np.minimum.at(result, rays[ray[inside]], distance[inside])
    return result


def _neighbours(points: np.ndarray) -> Iterator[np.ndarray]:
    """Numbers of points in groups that lie together: halved across their longest side."""
    waiting = [np.arange(len(points))]
    while waiting:
        group = waiting.pop()
        if len(group) <= _GROUP:
            yield group
            continue
        longest = int(np.argmax(np.ptp(points[group], axis=0)))
        parted = group[np.argpartition(points[group, longest], len(group) // 2)]
        waiting += np.split(parted, [len(group) // 2])


def _inside(points: np.ndarray, corners: np.ndarray, crosses: np.ndarray) -> np.ndarray:
    """Whether points of the triangles' planes lie in the triangles, (pair,)."""
    square = np.einsum("pi,pi->p", crosses, crosses)
    inside = np.ones(len(points), dtype=bool)
    for corner in range(3):
        a, b = corners[:, corner], corners[:, (corner + 1) % 3]
        area = np.einsum("pi,pi->p", np.cross(b - a, points - a), crosses)
        inside &= area >= -1e-9 * square
    return inside
