"""What a solid covers in a view, such as a hub from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

_SAME_MM = 1e-3
"""Nodes that are less apart in the view are one."""
_ALONG = 1e-4
"""Triangles that are turned from the line of sight by less (sine of the angle) cover nothing."""


def silhouette(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Corners of one polygon around what a closed surface covers, (corner, 2); none of no surface.

    A line of sight that meets it meets a triangle that faces the viewer, so these cover what all
    do. The edges that no two of them share close to loops, around holes the other way round, and
    these make one polygon that goes from loop to loop and back on the same way. It is to be filled
    by the nonzero rule, as everything here does: one part may lie over another.

    Args:
        points: The nodes: to the right in the view, up, and towards the viewer [mm], (node, 3).
        triangles: Their triangles, normals outward, (triangle, 3).
    """
    if not len(triangles):
        return np.zeros((0, 2))
    normal = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
    )
    facing = triangles[normal[:, 2] > _ALONG * np.linalg.norm(normal, axis=1)]
    grid = np.round(points[:, :2] / _SAME_MM)
    _, first, place = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    loops = [
        _cornered(points[first[loop], :2].astype(float)) for loop in _loops(place.ravel()[facing])
    ]
    return _joined([loop for loop in loops if len(loop) > 2])


def is_covered(places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which places in the view a surface covers, (place,).

    Args:
        places: To the right and up [mm], (place, 2).
        points: As of `silhouette`.
        triangles: As there, however their normals are.
    """
    a, b, c = points[triangles, :2].transpose(1, 0, 2)
    sides = []
    for begin, end in ((a, b), (b, c), (c, a)):
        along, to = end - begin, places[:, None] - begin
        sides.append(along[:, 0] * to[..., 1] - along[:, 1] * to[..., 0])
    inside = np.all(np.array(sides) >= 0.0, axis=0) | np.all(np.array(sides) <= 0.0, axis=0)
    has_area = np.abs(np.sum(sides, axis=0)) > _SAME_MM**2
    return np.asarray((inside & has_area).any(axis=1))


def _loops(triangles: np.ndarray) -> list[list[int]]:
    """Closed ways along the edges that are no other triangle's the other way round."""
    ends: dict[int, list[int]] = {}
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    for begin, end in edges[edges[:, 0] != edges[:, 1]].tolist():
        if begin in ends.get(end, ()):
            ends[end].remove(begin)
        else:
            ends.setdefault(begin, []).append(end)
    loops = []
    for start, left in ends.items():
        while left:
            loop = [start]
            while (further := ends[loop[-1]].pop()) != start:
                loop.append(further)
            loops.append(loop)
    return loops


def _cornered(loop: np.ndarray) -> np.ndarray:
    """A loop without nodes on straight ways, (corner, 2)."""
    before, after = loop - np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0) - loop
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    long = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray(loop[np.abs(turn) > 1e-6 * long])


def _joined(loops: Sequence[np.ndarray]) -> np.ndarray:
    """One polygon of loops, the longest first, each from the nearest corner and back to it."""
    whole = np.zeros((0, 2))
    for loop in sorted(loops, key=lambda each: -float(np.ptp(each, axis=0).sum())):
        if not len(whole):
            whole = loop
            continue
        at, of = np.unravel_index(np.argmin(cdist(whole, loop)), (len(whole), len(loop)))
        there = np.roll(loop, -of, axis=0)
        whole = np.concatenate([whole[: at + 1], there, there[:1], whole[at:]])
    return whole
