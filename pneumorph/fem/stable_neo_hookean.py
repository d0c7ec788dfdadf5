"""Stable neo-Hookean: a rubber whose energy stays finite when an element is crushed or inverted.

    psi = mu / 2 (|F|^2 - 3) - mu (J - 1) + lambda' / 2 (J - 1)^2,   lambda' = lambda + mu,
    P = mu F + (lambda' (J - 1) - mu) cof F.

Smith, de Goes and Kim, Stable Neo-Hookean Flesh Simulation, ACM Trans. Graph. 37 (2018), their
energy before the regularisation of the origin, which would stiffen rubber in shear by a third at
large strain. lambda' makes it Hooke's law with lambda and mu at rest.

A sheet (d = 2) has no stress across it: with a the ratio of areas, the stretch across it is

    t = a (mu + lambda') / (mu + lambda' a^2),   J = a t.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.determinant import (
    SIGNED_PERMUTATIONS,
    add_determinant_curvature,
    determinant,
)
from pneumorph.fem.law import Strain
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import cofactor, cross


class StableNeoHookean:
    """A solid, or a sheet in plane stress.

    Args:
        material: Lame's constants of the solid.
        dimension: 3 for a solid, 2 for a sheet; both follow from F as well.
    """

    damped_strain: Strain = "green"
    separable_volume = True

    def __init__(self, material: Material, dimension: int) -> None:
        self._mu = material.lame_mu
        self._bulk = material.lame_lambda + material.lame_mu

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,)."""
        squares = np.sum(gradient * gradient, axis=(0, 1))
        if gradient.shape[1] == 2:
            area = _area_ratio(gradient)[0]
            across = self._stretch_across(area)
            squares, volume_ratio = squares + across**2, area * across
        else:
            volume_ratio = determinant(gradient)
        swelling = volume_ratio - 1.0
        energy: np.ndarray = (
            0.5 * self._mu * (squares - 3.0) - self._mu * swelling + 0.5 * self._bulk * swelling**2
        )
        return energy

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P [kPa], (3, d, point)."""
        if gradient.shape[1] == 2:
            area, normal = _area_ratio(gradient)
            return self._mu * gradient + self._area_stress(area) * _area_gradient(gradient, normal)
        swelling = determinant(gradient) - 1.0
        stress: np.ndarray = self._mu * gradient + (self._bulk * swelling - self._mu) * cofactor(
            gradient
        )
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, d, 3, d, point)."""
        return (
            self._sheet_tangent(gradient)
            if gradient.shape[1] == 2
            else self._solid_tangent(gradient)
        )

    def _solid_tangent(self, gradient: np.ndarray) -> np.ndarray:
        """mu I + lambda' cof F (x) cof F + (lambda' (J - 1) - mu) d cof F / dF."""
        cof = cofactor(gradient)
        tangent = self._bulk * cof[:, :, None, None] * cof[None, None]
        factor = self._bulk * (determinant(gradient) - 1.0) - self._mu
        add_determinant_curvature(tangent, gradient, factor)
        for i in range(3):
            for a in range(3):
                tangent[i, a, i, a] += self._mu
        return tangent

    def _sheet_tangent(self, gradient: np.ndarray) -> np.ndarray:
        """mu I + g'' da (x) da + g' d2a, with g(a) the part of the energy that depends on a."""
        area, normal = _area_ratio(gradient)
        across, slope = self._stretch_across(area), self._area_stress(area)
        mu, bulk = self._mu, self._bulk
        stretch_rate = (mu + bulk) * (mu - bulk * area**2) / (mu + bulk * area**2) ** 2
        curvature = bulk * across**2 + (2.0 * bulk * area * across - bulk - mu) * stretch_rate
        first = _area_gradient(gradient, normal)
        tangent = (curvature - slope / area) * first[:, :, None, None] * first[None, None]
        # d2a = n . d2m + (dm . dm - (n . dm)^2) / a with m = f_1 x f_2 and da = n . dm.
        change = np.zeros((3, 2, 3, len(area)))  # dm for a unit change of F_ia
        for i, j, k, sign in SIGNED_PERMUTATIONS:
            # (e_i x f_2)_k and (f_1 x e_i)_k
            change[i, 0, k] += sign * gradient[j, 1]
            change[i, 1, k] -= sign * gradient[j, 0]
            tangent[i, 0, j, 1] += sign * slope * normal[k]
            tangent[i, 1, j, 0] -= sign * slope * normal[k]
        tangent += slope / area * np.einsum("iakp,jckp->iajcp", change, change)
        for i in range(3):
            for a in range(2):
                tangent[i, a, i, a] += mu
        return tangent

    def _stretch_across(self, area: np.ndarray) -> np.ndarray:
        """t, where the energy of a sheet is least."""
        return area * (self._mu + self._bulk) / (self._mu + self._bulk * area**2)

    def _area_stress(self, area: np.ndarray) -> np.ndarray:
        """g'(a) = t (lambda' (a t - 1) - mu)."""
        across = self._stretch_across(area)
        return across * (self._bulk * (area * across - 1.0) - self._mu)


def _area_ratio(gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """a = |f_1 x f_2|, (point,), and the unit normal, (3, point)."""
    normal = cross(gradient[:, 0], gradient[:, 1])
    area = np.sqrt(np.sum(normal * normal, axis=0))
    return area, normal / area


def _area_gradient(gradient: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """da/dF, (3, 2, point)."""
    return np.stack([cross(gradient[:, 1], normal), cross(normal, gradient[:, 0])], axis=1)
