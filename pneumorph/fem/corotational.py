"""Corotational linear elasticity: Hooke's law in the frame of an element's rotation R.

    eps = sym(R^T F) - I,   sigma = lambda tr(eps) I + 2 mu eps,   P = R sigma.

Mueller and Gross, Interactive Virtual Materials, Graphics Interface 2004. With R the polar factor
it is hyperelastic, psi = mu |F - R|^2 + lambda / 2 (tr(R^T F) - d)^2; with R from edge and face
(Nesme et al. 2005, the paper's choice) it has no potential.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.law import Law, Strain, differentiated_stress
from pneumorph.fem.material import Material
from pneumorph.fem.rotation import dot, element_rotation, polar_rotation_rate
from pneumorph.physics.physics import Rotation


class Corotational:
    """A solid, or a sheet in plane stress.

    Args:
        material: Lame's constants.
        dimension: 3 for a solid, 2 for a sheet.
        rotation: Where R is taken from.
    """

    damped_strain: Strain = "stretch"

    def __init__(self, material: Material, dimension: int, rotation: Rotation = "polar") -> None:
        self._material, self._dimension, self.rotation = material, dimension, rotation
        self._lambda, self._mu = material.lame_constants(dimension)

    def with_rotation(self, rotation: Rotation) -> Corotational:
        """The same law with R taken from elsewhere."""
        if rotation == self.rotation:
            return self
        return Corotational(self._material, self._dimension, rotation)

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,).

        Raises:
            ValueError: R is edge-based; the force then has no potential.
        """
        if self.rotation != "polar":
            raise ValueError(
                f'an energy needs rotation "polar", got {self.rotation!r}: forces with edge-based '
                "rotations have no potential"
            )
        turn = element_rotation(gradient, "polar")
        trace = np.sum(turn * gradient, axis=(0, 1)) - self._dimension
        apart = np.sum((gradient - turn) ** 2, axis=(0, 1))
        energy: np.ndarray = self._mu * apart + 0.5 * self._lambda * trace**2
        return energy

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P = R sigma [kPa], (3, d, point)."""
        turn = element_rotation(gradient, self.rotation)
        d = gradient.shape[1]
        stretch = [[dot(turn[:, a], gradient[:, b]) for b in range(d)] for a in range(d)]
        lambda_trace = self._lambda * (sum(stretch[a][a] for a in range(d)) - d)
        stress = np.empty_like(gradient)
        for b in range(d):
            sigma = [
                lambda_trace + 2.0 * self._mu * (stretch[a][a] - 1.0)
                if a == b
                else self._mu * (stretch[a][b] + stretch[b][a])
                for a in range(d)
            ]
            for axis in range(3):
                stress[axis, b] = sum(turn[axis, a] * sigma[a] for a in range(d))
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, d, 3, d, point); by differences for edge-based rotations.

        2 mu (dF - dR) + lambda tr(R^T dF) R + lambda (tr(R^T F) - d) dR.
        """
        if self.rotation != "polar":
            return differentiated_stress(self, gradient)
        turn = element_rotation(gradient, "polar")
        d = gradient.shape[1]
        trace = np.sum(turn * gradient, axis=(0, 1)) - d
        of_rotation = self._lambda * trace - 2.0 * self._mu
        tangent = of_rotation * polar_rotation_rate(turn, gradient)
        tangent += self._lambda * turn[:, :, None, None] * turn[None, None]
        for axis in range(3):
            for column in range(d):
                tangent[axis, column, axis, column] += 2.0 * self._mu
        return tangent


def law_with_rotation(law: Law, rotation: Rotation) -> Law:
    """The law itself; a corotational one with its rotation taken from `rotation`."""
    return law.with_rotation(rotation) if isinstance(law, Corotational) else law
