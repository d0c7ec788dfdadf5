"""Contact points for a mesh of one's own: some of its outer nodes, evenly spread."""

from __future__ import annotations

import numpy as np

_CORNER_SHARE = 0.25
"""Corners may be this much of the spacing apart: the two rims of a thin plate both count."""


def spread_points(points: np.ndarray, spacing_mm: float) -> np.ndarray:
    """Choose points so that none of the others is farther than a spacing from a chosen one.

    Corners of the convex hull come first, since a flat floor meets a body there, a quarter of the
    spacing or more apart. The rest is farthest-point sampling (Gonzalez 1985): go on with the point
    farthest from all chosen. Ties go to the first.

    Args:
        points: Candidates that span a volume [mm], (point, 3).
        spacing_mm: The spacing [mm].

    Returns:
        Indices of the chosen points, rising, (n,).

    Raises:
        ValueError: Fewer than four points, all in a plane, or a spacing that is not positive.
    """
    from scipy.spatial import ConvexHull, QhullError

    if not spacing_mm > 0.0:
        raise ValueError(f"spacing_mm must be positive, got {spacing_mm}")
    try:
        corners = np.sort(ConvexHull(points).vertices)
    except (QhullError, ValueError) as error:
        raise ValueError(
            f"points, of shape {np.shape(points)}, span no volume; expected four or more that do "
            "not lie in a plane"
        ) from error
    distance = np.full(len(points), np.inf)
    chosen: list[int] = []
    for candidates, least in (
        (corners, _CORNER_SHARE * spacing_mm),
        (np.arange(len(points)), spacing_mm),
    ):
        while distance[candidates].max() > least:
            farthest = int(candidates[np.argmax(distance[candidates])])
            chosen.append(farthest)
            away = np.linalg.norm(points - points[farthest], axis=1)
            distance = np.minimum(distance, away)
    return np.sort(chosen)
