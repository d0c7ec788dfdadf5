"""J = det F and its second derivative; the first is the cofactor of `pneumorph.fem.rotation`."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.rotation import cross

SIGNED_PERMUTATIONS = (
    (0, 1, 2, 1.0),
    (1, 2, 0, 1.0),
    (2, 0, 1, 1.0),
    (1, 0, 2, -1.0),
    (2, 1, 0, -1.0),
    (0, 2, 1, -1.0),
)
"""Permutations of three axes with their signs."""


def determinant(gradient: np.ndarray) -> np.ndarray:
    """J of matrices F, (3, 3, point): (point,)."""
    result: np.ndarray = np.sum(gradient[:, 0] * cross(gradient[:, 1], gradient[:, 2]), axis=0)
    return result


def add_determinant_curvature(
    tangent: np.ndarray, gradient: np.ndarray, factor: np.ndarray
) -> None:
    """Add factor d2J/dF2 = factor d(cof F)/dF to a tangent, in place.

    Args:
        tangent: dP/dF, (3, 3, 3, 3, point).
        gradient: F, (3, 3, point).
        factor: What multiplies it, (point,).
    """
    for i, j, k, sign in SIGNED_PERMUTATIONS:
        for a, c, b, other in SIGNED_PERMUTATIONS:
            tangent[i, a, j, c] += sign * other * factor * gradient[k, b]
