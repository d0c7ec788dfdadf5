"""Few modes that hold every shape of the legs on a page: what makes a replay small.

Seen in its hub's frame, and turned about the hub's axis to where location 0 would be, a leg of a
reduced robot moves in the affine space of its reduced modes, the same space for every leg and every
robot. So the proper orthogonal decomposition of all recorded shapes ends at the number of reduced
modes, exact to rounding. Legs of finite elements need more modes; they are added until no node is
off by more than a tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_SAMPLE_COUNT = 600
"""Shapes decomposed at first; more cost time and hardly change the modes."""
_ROUND_LIMIT = 5
"""What is left beyond the tolerance after so many samples is told as the replay's error."""


@dataclass(frozen=True, eq=False)
class LegModes:
    """A mean shape and modes, in single precision."""

    mean: np.ndarray
    """Mean position of the nodes [mm], (3 node,)."""
    modes: np.ndarray
    """Orthonormal modes, (mode, 3 node)."""

    def coefficients(self, shapes: np.ndarray) -> np.ndarray:
        """Coordinates of shapes (shape, 3 node) in the modes [mm], (shape, mode) float32."""
        away = shapes - self.mean
        return np.asarray(away @ self.modes.T.astype(float), dtype=np.float32)

    def shapes(self, coefficients: np.ndarray) -> np.ndarray:
        """Shapes that coordinates stand for [mm], (shape, 3 node)."""
        return np.asarray(self.mean + coefficients.astype(float) @ self.modes.astype(float))


def leg_modes(shapes: Sequence[np.ndarray], tolerance_mm: float) -> LegModes:
    """Return modes that hold all shapes to a tolerance.

    Args:
        shapes: Shapes of legs in their own frame [mm], each array (shape, 3 node).
        tolerance_mm: How far a coordinate of a node may be off [mm]. Single precision is the limit.

    Raises:
        ValueError: The tolerance is not positive, or a shape is not finite.
    """
    if not tolerance_mm > 0.0:
        raise ValueError(f"tolerance_mm is {tolerance_mm}, expected above 0")
    if not all(np.isfinite(each).all() for each in shapes):
        raise ValueError("node positions must be finite to be replayed; the simulation diverged")
    rng = np.random.default_rng(0)
    sample = _sampled(shapes, rng)
    for _ in range(_ROUND_LIMIT):
        mean = sample.mean(axis=0).astype(np.float32)
        found = LegModes(mean, _leading(sample - mean, tolerance_mm))
        # Shapes outside the sample may need what it does not hold.
        beyond = _sampled([_beyond(found, each, tolerance_mm) for each in shapes], rng)
        if len(beyond) == 0:
            break
        sample = np.concatenate([sample, beyond])
    return found


def _sampled(shapes: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Return some of the shapes in double precision, (shape, 3 node)."""
    counts = [len(each) for each in shapes]
    share = min(1.0, _SAMPLE_COUNT / max(sum(counts), 1))
    # At random, for an even stride could meet the same leg every time.
    chosen = [np.sort(rng.permutation(count)[: math.ceil(share * count)]) for count in counts]
    return np.concatenate([each[some] for each, some in zip(shapes, chosen, strict=True)]).astype(
        float
    )


def _leading(residual: np.ndarray, tolerance_mm: float) -> np.ndarray:
    """Return the fewest right singular vectors that leave no entry above the tolerance.

    By Sirovich's method of snapshots: from the eigenvectors of the shapes' products, ten times as
    fast as a singular value decomposition. Squares round at 1e-16, so modes below 1e-7 of the first
    are lost, which is single precision.
    """
    squares, left = np.linalg.eigh(residual @ residual.T)
    values = np.sqrt(np.maximum(squares[::-1], 0.0))
    left = left[:, ::-1][:, values > 1e-7 * values[0]]
    scores = left * values[: left.shape[1]]
    right = left.T @ residual / values[: left.shape[1], None]
    few, many = 0, len(right)
    while few < many:
        middle = (few + many) // 2
        rest = residual - scores[:, :middle] @ right[:middle]
        few, many = (few, middle) if np.abs(rest).max() <= tolerance_mm else (middle + 1, many)
    return right[:many].astype(np.float32)


def _beyond(found: LegModes, shapes: np.ndarray, tolerance_mm: float) -> np.ndarray:
    """Return those shapes that modes do not hold to the tolerance."""
    error = np.abs(shapes - found.shapes(found.coefficients(shapes))).max(axis=1)
    return np.asarray(shapes[error > tolerance_mm])
