"""St. Venant-Kirchhoff: linear elasticity in Green's strain.

    E = (F^T F - I) / 2,   psi = lambda / 2 tr(E)^2 + mu E : E,
    P = F S,   S = lambda tr(E) I + 2 mu E.

Exact under rigid motion; softens under strong compression, so for moderate strain only.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.law import Strain
from pneumorph.fem.material import Material


class StVenantKirchhoff:
    """A solid, or a sheet in plane stress.

    Args:
        material: Lame's constants.
        dimension: 3 for a solid, 2 for a sheet.
    """

    damped_strain: Strain = "green"

    def __init__(self, material: Material, dimension: int) -> None:
        self._lambda, self._mu = material.lame_constants(dimension)

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,)."""
        strain = _green_strain(gradient)
        trace = np.einsum("aap->p", strain)
        energy: np.ndarray = 0.5 * self._lambda * trace**2 + self._mu * np.sum(
            strain * strain, axis=(0, 1)
        )
        return energy

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P = F S [kPa], (3, d, point)."""
        stress: np.ndarray = np.einsum("iap,abp->ibp", gradient, self._second_stress(gradient))
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, d, 3, d, point).

        delta_ij S_ac + lambda F_ia F_jc + mu F_ic F_ja + mu delta_ac (F F^T)_ij.
        """
        d = gradient.shape[1]
        second = self._second_stress(gradient)
        left = np.einsum("iap,jap->ijp", gradient, gradient)
        tangent = self._lambda * gradient[:, :, None, None] * gradient[None, None]
        for i in range(3):
            for a in range(d):
                for j in range(3):
                    for c in range(d):
                        tangent[i, a, j, c] += self._mu * gradient[i, c] * gradient[j, a]
                        if i == j:
                            tangent[i, a, j, c] += second[a, c]
                        if a == c:
                            tangent[i, a, j, c] += self._mu * left[i, j]
        return tangent

    def _second_stress(self, gradient: np.ndarray) -> np.ndarray:
        """S [kPa], (d, d, point)."""
        stress = 2.0 * self._mu * _green_strain(gradient)
        pressure = 0.5 * self._lambda / self._mu * np.einsum("aap->p", stress)
        for a in range(len(stress)):
            stress[a, a] += pressure
        return stress


def _green_strain(gradient: np.ndarray) -> np.ndarray:
    """E, (d, d, point)."""
    strain = 0.5 * np.einsum("iap,ibp->abp", gradient, gradient)
    for a in range(gradient.shape[1]):
        strain[a, a] -= 0.5
    return strain
