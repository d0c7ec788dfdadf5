"""Contact points on the surfaces of boxes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np


def box_surface_grid(
    corner: Sequence[float], size: Sequence[float], spacing_mm: float
) -> np.ndarray:
    """Regular grid on the surface of an axis-aligned box, (point, 3), corners included.

    Args:
        corner: Lowest corner [mm], (3,).
        size: Edge lengths [mm], (3,).
        spacing_mm: Largest distance between neighbours along an edge [mm].
    """
    counts = [int(np.ceil(length / spacing_mm - 1e-9)) for length in size]
    points = []
    for index in itertools.product(*(range(count + 1) for count in counts)):
        if any(i in (0, count) for i, count in zip(index, counts, strict=True)):
            points.append([i / count for i, count in zip(index, counts, strict=True)])
    return np.asarray(corner) + np.array(points) * np.asarray(size)


def outside_of_boxes(
    points: np.ndarray,
    boxes: Sequence[tuple[Sequence[float], Sequence[float]]],
    tolerance: float = 1e-9,
) -> np.ndarray:
    """The points on the outer surface of a union of boxes.

    A point is dropped when a small neighbourhood of it is covered by the boxes: the covered ones
    among its eight octants then are all eight.

    Args:
        points: Candidates [mm], (point, 3).
        boxes: Lowest corner and size of each box [mm].
        tolerance: Size of the neighbourhood is a thousand times this [mm].
    """
    covered = np.ones(len(points), dtype=bool)
    for octant in itertools.product((-1.0, 1.0), repeat=3):
        probe = points + np.array(octant) * 1000.0 * tolerance
        inside = np.zeros(len(points), dtype=bool)
        for corner, size in boxes:
            inside |= np.all((probe > corner) & (probe < np.add(corner, size)), axis=1)
        covered &= inside
    outside: np.ndarray = points[~covered]
    return outside
