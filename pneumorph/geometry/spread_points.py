"""Contact points for a mesh of one's own: some of its outer nodes, evenly spread."""

from __future__ import annotations

import numpy as np

_CORNER_SHARE = 0.25
"""Corners may be this much of the spacing apart: the two rims of a thin plate both count."""


_FLAT_SHARE = 1e-6
"""Points lie in a plane if they are no further off it than this, relative to their extent."""


def spread_points(
    points: np.ndarray, spacing_mm: float, *, flat: bool = False, images: np.ndarray | None = None
) -> np.ndarray:
    """Choose points so that none of the others is farther than a spacing from a chosen one.

    Corners of the convex hull come first, since a flat floor meets a body there, a quarter of the
    spacing or more apart but for images of each other. The rest is farthest-point sampling
    (Gonzalez 1985): go on with the point farthest from all chosen. Ties go to the first. Where
    points have mirror images, a point and its image are chosen together.

    Args:
        points: Candidates that span a volume [mm], (point, 3).
        spacing_mm: The spacing [mm].
        flat: Whether they may also lie in a plane, such as a flat sole; corners are then those of
            the hull in it.
        images: Number of each point's mirror image, (point,); None without.

    Returns:
        Indices of the chosen points, rising, (n,).

    Raises:
        ValueError: Fewer than four points, all in a plane, unless that is said, all on a line, or a
            spacing that is not positive.
    """
    from scipy.spatial import ConvexHull, QhullError

    if not spacing_mm > 0.0:
        raise ValueError(f"spacing_mm must be positive, got {spacing_mm}")
    try:
        shadow = _shadow(points) if flat and len(points) >= 3 else points
        corners = np.sort(ConvexHull(shadow).vertices)
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
            pair = {farthest} if images is None else {farthest, int(images[farthest])}
            for each in sorted(pair):
                chosen.append(each)
                away = np.linalg.norm(points - points[each], axis=1)
                distance = np.minimum(distance, away)
    return np.sort(chosen)


def _shadow(points: np.ndarray) -> np.ndarray:
    """Points of a plane without the coordinate in which it is least spread, which leaves corners
    corners, (point, 2); all others as they are."""
    off = points - points.mean(axis=0)
    normal = np.linalg.svd(off, full_matrices=False)[2][2]
    if np.ptp(off @ normal) > _FLAT_SHARE * np.ptp(off, axis=0).max():
        return points
    return np.delete(points, int(np.abs(normal).argmax()), axis=1)
