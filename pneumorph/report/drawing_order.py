"""In which order convex pieces are drawn over each other, so that the nearer one is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

_ACROSS = 160
"""Lines of sight over the wider side of a view."""
_SAME_MM = 0.05
"""Faces that are less apart lie in one plane: neither hides the other."""


def farthest_first(pieces: Sequence[np.ndarray], away: np.ndarray) -> list[int]:
    """Return the numbers of convex pieces, those that others hide first.

    Of two pieces that overlap in the view, the one is nearer whose front face is nearer along most
    of the lines of sight that meet both: middles of long pieces would not tell.

    Args:
        pieces: Corners of each, (corner, 3).
        away: Unit vector away from the viewer, along an axis of the robot, (3,).
    """
    if len(pieces) == 0:
        return []
    fronts = _fronts(pieces, away)
    count = len(pieces)
    hidden = np.zeros((count, count), dtype=bool)
    for one in range(count):
        seen = np.isfinite(fronts[one])
        if not seen.any():
            continue
        apart = fronts[:, seen] - fronts[one, seen]  # positive where the others are behind
        with np.errstate(invalid="ignore"):
            votes = (apart > _SAME_MM).astype(int) - (apart < -_SAME_MM)
        hidden[one] = np.where(np.isfinite(apart), votes, 0).sum(axis=1) > 0
    depths = np.array([float(np.mean(piece @ away)) for piece in pieces])
    order: list[int] = []
    left = list(range(count))
    while left:
        free = [each for each in left if not hidden[np.ix_([each], left)].any()]
        # Pieces in a ring, each hidden by the next, have no order: the farthest is as good as any.
        chosen = max(free or left, key=lambda each: depths[each])
        order.append(chosen)
        left.remove(chosen)
    return order


def _fronts(pieces: Sequence[np.ndarray], away: np.ndarray) -> np.ndarray:
    """Depth at which each of many lines of sight meets each piece first, (piece, line) [mm];
    infinite where it misses it."""
    across = np.eye(3)[np.argsort(np.abs(away))[:2]]
    every = np.concatenate(pieces) @ across.T
    low, high = every.min(axis=0), every.max(axis=0)
    step = max(float((high - low).max()) / _ACROSS, 1e-9)
    ways = [np.arange(begin + step / 2.0, end, step) for begin, end in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ways), axis=-1).reshape(-1, 2)
    fronts = np.full((len(pieces), len(points)), np.inf)
    for number, piece in enumerate(pieces):
        flat = piece @ across.T
        near = np.all((points >= flat.min(axis=0)) & (points <= flat.max(axis=0)), axis=1)
        if near.any():
            fronts[number, near] = _front(piece, points[near] @ across, away)
    return fronts


def _front(piece: np.ndarray, starts: np.ndarray, away: np.ndarray) -> np.ndarray:
    """The same of one piece, (line,), for lines through points, (line, 3)."""
    planes = ConvexHull(piece).equations  # inside, normal @ point + offset <= 0
    slopes, heights = planes[:, :3] @ away, starts @ planes[:, :3].T + planes[:, 3]
    begin, end = np.full(len(starts), -np.inf), np.full(len(starts), np.inf)
    for slope, height in zip(slopes, heights.T, strict=True):
        if slope > 1e-9:
            end = np.minimum(end, -height / slope)
        elif slope < -1e-9:
            begin = np.maximum(begin, -height / slope)
        else:
            end = np.where(height > 1e-9, -np.inf, end)
    return np.where(begin <= end, begin, np.inf)
