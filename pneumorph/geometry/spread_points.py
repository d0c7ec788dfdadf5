"""Contact points for a mesh of one's own: some of its outer nodes, evenly spread."""

from __future__ import annotations

import numpy as np


def spread_points(points: np.ndarray, spacing_mm: float) -> np.ndarray:
    """Choose points so that none of the others is farther than a spacing from a chosen one.

    Farthest-point sampling (Gonzalez 1985): begin with the point farthest from the centre and go on
    with the one farthest from all chosen, so corners come first and chosen points are at least the
    spacing apart. Ties go to the first.

    Args:
        points: Candidates [mm], (point, 3).
        spacing_mm: The spacing [mm].

    Returns:
        Indices of the chosen points, rising, (n,).

    Raises:
        ValueError: No points, or a spacing that is not positive.
    """
    if not len(points):
        raise ValueError("points is empty, expected at least one to choose from")
    if not spacing_mm > 0.0:
        raise ValueError(f"spacing_mm must be positive, got {spacing_mm}")
    distance = np.full(len(points), np.inf)
    farthest = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    chosen = []
    while distance[farthest] > spacing_mm:
        chosen.append(farthest)
        distance = np.minimum(distance, np.linalg.norm(points - points[farthest], axis=1))
        farthest = int(np.argmax(distance))
    return np.sort(chosen)
