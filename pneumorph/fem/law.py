"""Elastic laws: stored energy, stress and tangent as functions of the deformation gradient.

A law is one small class in a file of its own, made from a `Material` and the number d of material
dimensions; `pneumorph.fem.law_registry` makes it known by the name that `Material.law` gives.
"""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np

Strain = Literal["stretch", "green"]
"""``stretch``: U - I of F = R U. ``green``: (F^T F - I) / 2."""


class Law(Protocol):
    """A solid (d = 3), or a sheet without stress across it (d = 2).

    Arrays are laid out component first and point last; energy and stress are per volume at rest. A
    law whose energy depends on lambda by lambda/2 (J - 1)^2 alone says so by a further attribute,
    ``separable_volume = True``; only such laws can have `Material.dilatation` ``mean``.
    """

    damped_strain: Strain
    """Strain whose rate objective damping resists."""

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """Stored energy [kPa], (point,), at deformation gradients F, (3, d, point)."""
        ...

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """First Piola-Kirchhoff stress P = d energy / dF [kPa], (3, d, point)."""
        ...

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP / dF [kPa], (3, d, 3, d, point): P's component first, then F's."""
        ...


def differentiated_stress(law: Law, gradient: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """dP / dF by central differences of the stress, exact to about 1e-9 relative.

    For a law whose tangent has no handy formula; its `tangent` may return this.

    Args:
        law: The law.
        gradient: F, (3, d, point).
        step: Step of the differences.

    Returns:
        (3, d, 3, d, point).
    """
    derivative = np.empty((*gradient.shape[:2], *gradient.shape))
    for axis in range(3):
        for column in range(gradient.shape[1]):
            ahead, behind = gradient.copy(), gradient.copy()
            ahead[axis, column] += step
            behind[axis, column] -= step
            change = law.stress(ahead) - law.stress(behind)
            derivative[:, :, axis, column] = change / (2.0 * step)
    return derivative
