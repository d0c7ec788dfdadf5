"""A leg from above in as many parts as it has chambers, each where its chamber is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_LEAST_APART = 0.1
"""Chambers that lie less far apart, relative to the outline's size in that direction, are one above
the other."""


def chamber_bands(
    outline: np.ndarray, count: int, centres_mm: np.ndarray | None = None
) -> list[np.ndarray]:
    """Cut a convex outline in parts as wide as each other.

    Args:
        outline: Its corners, (corner, 2).
        count: Number of chambers.
        centres_mm: Middle of each chamber, (chamber, 2): parts lie along or across the outline, as
            these do, and in their order. None where that is not known: chambers come one after the
            other outwards, the first nearest to the origin, as they do where they lie one above the
            other, and where there are centres of another number of chambers.

    Returns:
        Corners of each chamber's part, in the chambers' order.
    """
    if count <= 1 or len(outline) == 0:
        return [outline] * count
    direction, order = _line(outline, count, centres_mm)
    along = outline @ direction
    parts = [outline] * count
    cuts = np.linspace(along.min(), along.max(), count + 1)[1:-1]
    for number, cut in zip(order[:-1], cuts, strict=True):
        parts[number] = _beyond(outline, -direction, -cut)
        outline = _beyond(outline, direction, cut)
    parts[order[-1]] = outline
    return parts


def _line(
    outline: np.ndarray, count: int, centres_mm: np.ndarray | None
) -> tuple[np.ndarray, Sequence[int]]:
    """Direction in which chambers follow each other, and their order in it; arguments as of
    `chamber_bands`."""
    if centres_mm is not None and len(centres_mm) == count:
        # Along the longest edge, or across it.
        edges = np.roll(outline, -1, axis=0) - outline
        lengths = np.linalg.norm(edges, axis=1)
        x, y = edges[np.argmax(lengths)] / lengths.max()
        axes = np.array([[x, y], [-y, x]])
        spread = np.ptp(centres_mm @ axes.T, axis=0) / np.ptp(outline @ axes.T, axis=0)
        if spread.max() >= _LEAST_APART:
            direction = axes[np.argmax(spread)]
            return direction, np.argsort(centres_mm @ direction, kind="stable").tolist()
    return way_out(outline)[1], range(count)


def way_out(outline: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle of an outline (corner, 2), and the direction to it from the origin."""
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    return middle, middle / max(float(np.linalg.norm(middle)), 1.0)


def _beyond(outline: np.ndarray, direction: np.ndarray, least: float) -> np.ndarray:
    """What of a convex outline is at least so far in a direction (Sutherland and Hodgman 1974)."""
    kept = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        before, after = start @ direction - least, end @ direction - least
        if before >= 0.0:
            kept.append(start)
        if before * after < 0.0:
            kept.append(start + before / (before - after) * (end - start))
    return np.array(kept).reshape(-1, 2)
