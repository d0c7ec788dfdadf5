"""Yeoh's law: rubber whose stiffness changes with strain, fitted to tension tests.

    psi = C1 y + C2 y^2 + C3 y^3 + K/2 (J - 1)^2,   y = J^(-2/3) |F|^2 - 3,
    P = 2 psi'(y) J^(-2/3) (F - |F|^2 / (3 J) cof F) + K (J - 1) cof F.

Yeoh, Some forms of the strain energy function for rubber, Rubber Chem. Technol. 66 (1993) 754; the
invariant without the change of volume as in Holzapfel, Nonlinear Solid Mechanics, section 6.4. At
rest it is Hooke's law with mu = 2 C1 and K = lambda + 2 mu / 3. C2 = C3 = 0 is neo-Hookean rubber.

A point that is turned inside out has no energy: it becomes NaN, so a step to it fails.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.determinant import add_determinant_curvature, determinant
from pneumorph.fem.law import Strain
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import cofactor
from pneumorph.fem.yeoh_constants import refuse_falling_stress


class Yeoh:
    """A solid; sheets are refused.

    Args:
        material: Lame's constants, and C2 and C3 over C1.
        dimension: 3.

    Raises:
        ValueError: A sheet is wanted, or stress falls with strain before strains reach 100 %.
    """

    damped_strain: Strain = "green"
    separable_volume = True

    def __init__(self, material: Material, dimension: int) -> None:
        if dimension != 3:
            raise ValueError(
                f"yeoh is a law of solids (dimension 3), got {dimension}; give the sheet "
                "st_venant_kirchhoff or stable_neo_hookean"
            )
        first = 0.5 * material.lame_mu
        self._constants = (
            first,
            first * material.yeoh_c2_over_c1,
            first * material.yeoh_c3_over_c1,
        )
        refuse_falling_stress(*self._constants)
        self._bulk = material.lame_lambda + 2.0 * material.lame_mu / 3.0

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,)."""
        first, second, third = self._constants
        volume_ratio, _, y = _invariants(gradient)
        energy: np.ndarray = y * (first + y * (second + y * third))
        return energy + 0.5 * self._bulk * (volume_ratio - 1.0) ** 2

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P [kPa], (3, 3, point)."""
        volume_ratio, shrink, y = _invariants(gradient)
        slope = 2.0 * self._slope(y) * shrink
        squares = (y + 3.0) / shrink
        along = self._bulk * (volume_ratio - 1.0) - slope * squares / (3.0 * volume_ratio)
        stress: np.ndarray = slope * gradient + along * cofactor(gradient)
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, 3, 3, 3, point).

        psi'' dy (x) dy + K dJ (x) dJ + psi' d2y + K (J - 1) d2J with dJ = cof F and
        d2y = 2 J^(-2/3) (I - 2 / (3 J) (F (x) dJ + dJ (x) F) + 5 |F|^2 / (9 J^2) dJ (x) dJ
        - |F|^2 / (3 J) d2J).
        """
        volume_ratio, shrink, y = _invariants(gradient)
        cof, slope = cofactor(gradient), 2.0 * self._slope(y) * shrink
        squares = (y + 3.0) / shrink
        change = 2.0 * shrink * (gradient - squares / (3.0 * volume_ratio) * cof)
        _, second, third = self._constants
        tangent = _dyad((2.0 * second + 6.0 * third * y) * change, change)
        mixed = _dyad(-2.0 / 3.0 * slope / volume_ratio * gradient, cof)
        tangent += mixed + np.transpose(mixed, (2, 3, 0, 1, 4))
        tangent += _dyad((5.0 / 9.0 * slope * squares / volume_ratio**2 + self._bulk) * cof, cof)
        along = self._bulk * (volume_ratio - 1.0) - slope * squares / (3.0 * volume_ratio)
        add_determinant_curvature(tangent, gradient, along)
        for i in range(3):
            for a in range(3):
                tangent[i, a, i, a] += slope
        return tangent

    def _slope(self, y: np.ndarray) -> np.ndarray:
        """psi'(y) = C1 + 2 C2 y + 3 C3 y^2."""
        first, second, third = self._constants
        return first + y * (2.0 * second + 3.0 * third * y)


def _invariants(gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """J, J^(-2/3) and y; NaN where J is not positive."""
    volume_ratio = determinant(gradient)
    volume_ratio = np.where(volume_ratio > 0.0, volume_ratio, np.nan)
    shrink = np.cbrt(volume_ratio) ** -2
    return volume_ratio, shrink, shrink * np.sum(gradient * gradient, axis=(0, 1)) - 3.0


def _dyad(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """first (x) second at every point, (3, 3, 3, 3, point)."""
    return first[:, :, None, None] * second[None, None]
