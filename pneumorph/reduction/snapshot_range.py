"""The range of modal coordinates that a reduced part has seen: the smallest ellipsoid around them.

Of the snapshots' coordinates A, (snapshot, mode), the leverage of a state is h = a^T (A^T A)^-1 a.
A regression extrapolates where h is larger than that of any observation, even where each coordinate
alone has been as large (Montgomery, Peck and Vining, *Introduction to Linear Regression Analysis*,
hidden extrapolation; Cook 1979). sqrt(h) is the Mahalanobis distance from rest in the second moment
about it, and the same for any basis of the same modes. Here it is relative to the furthest
snapshot: 1 on the ellipsoid, 2 twice as far from rest.
"""

from __future__ import annotations

import math

import numpy as np

RANGE_TOLERANCE = 1.2
"""A robot is out of range from so many times as far as the furthest snapshot on. Walks of the same
pressures that were not among the snapshots stay inside, their rare extremes a little beyond; so
does the step from held-out snapshots to the walks of the reduced robot itself."""
LEAST_AXIS = 2e-4
"""Least half-length of an axis over the furthest snapshot's distance from rest: of a leg whose tip
moves by 60 mm a hundredth of one, a fraction of what modes leave out. Modes that the snapshots
hardly have, such as a tip's answers to small forces, would otherwise tell every robot out of
range."""


def snapshot_range(alpha: np.ndarray, parity: np.ndarray | None = None) -> np.ndarray:
    """Rows W: |W a| is 1 on the ellipsoid of second moments through the furthest snapshot.

    Args:
        alpha: Modal coordinates of the snapshots, (snapshot, mode).
        parity: 1 for each mode that is symmetric, -1 for each that is antisymmetric: the mirror
            images are in range as the snapshots are. None of a part without a mirror.

    Returns:
        (mode, mode): principal axes over their half-lengths [kg^-1/2 mm^-1].
    """
    seen = alpha if parity is None else np.concatenate([alpha, alpha * parity])
    _, lengths, axes = np.linalg.svd(np.linalg.qr(seen, mode="r"))
    lengths = np.pad(lengths, (0, len(axes) - len(lengths)))
    has = lengths > np.finfo(float).eps * len(seen) * lengths[0]  # along others none has moved
    lengths *= range_ratio(axes[has] / lengths[has, None], alpha).max()
    least = LEAST_AXIS * np.linalg.norm(alpha, axis=1).max()
    rows: np.ndarray = axes / np.maximum(lengths, least)[:, None]
    return rows / range_ratio(rows, alpha).max()


def range_ratio(rows: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """How far modal coordinates are from rest, relative to the furthest snapshot, (...).

    Args:
        rows: Those of `snapshot_range`, (mode, mode).
        alpha: Modal coordinates, (..., mode).
    """
    ratio: np.ndarray = np.linalg.norm(alpha @ rows.T, axis=-1)
    return ratio


def known_ratio(ratio: float) -> float | None:
    """A ratio as results have it: None, not NaN, where no leg knows its range."""
    return None if math.isnan(ratio) else float(ratio)


def furthest_ratio(ratios: np.ndarray | None) -> float | None:
    """The largest of several, of any shape; None where none is known."""
    known = np.zeros(0) if ratios is None else ratios[~np.isnan(ratios)]
    return None if known.size == 0 else float(known.max())


def range_note(name: str, ratio: float | None) -> str | None:
    """What to tell of a robot that left the range of its legs' snapshots; None of others."""
    if ratio is None or ratio <= RANGE_TOLERANCE:
        return None
    return (
        f"{name} left the range of its legs' snapshots: a leg went {ratio:.2f} times as far as in "
        "any of them, where the reduced leg extrapolates; reduce it with snapshots of these "
        "pressures, or walk finite elements"
    )
