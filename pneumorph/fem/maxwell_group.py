"""Maxwell branches of a solid: stress that relaxes, blind to rigid motion, never giving energy.

Each branch is a spring and a dashpot in a row, in Green's strain E = (F^T F - I) / 2,

    psi_i = mu_i Q_i : Q_i,   S_i = 2 mu_i Q_i,   dQ_i/dt = dE/dt - Q_i / tau_i,

with Q_i what the spring has of the strain and E - Q_i what the dashpot has. E does not change when
a body turns, so nor does the stress, and what the dashpot takes is 2 mu_i Q_i : Q_i / tau_i, never
negative. For small strain it is a Prony series of the shear modulus; a change of volume, which
rubber hardly shows, is left to the elastic law. Simo, On a fully three-dimensional finite-strain
viscoelastic damage model, Comput. Meth. Appl. Mech. Eng. 60 (1987) 153; Simo and Hughes,
Computational Inelasticity, chapter 10, whose update along a strain that changes evenly in a step of
length h is exact:

    Q' = exp(-a) Q + c (E' - E),   a = h / tau,   c = (1 - exp(-a)) / a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.element_stiffness import contracted_entries
from pneumorph.fem.prony import PronySeries


@dataclass(frozen=True, eq=False)
class ViscousState:
    """What a solid remembers of its past."""

    strain: np.ndarray
    """E at the end of the last step, (3, 3, point)."""
    spring: np.ndarray
    """Q of each branch then, (branch, 3, 3, point)."""


@dataclass(frozen=True, eq=False)
class MaxwellGroup:
    """Branches at the integration points of a solid's elements."""

    group: ElementGroup
    """The elements, whose shear modulus is the relaxed one."""
    series: PronySeries
    """How it relaxes."""

    @property
    def shear_moduli(self) -> np.ndarray:
        """mu_i [kPa], (branch, point)."""
        moduli: np.ndarray = np.multiply.outer(self.series.branch_ratios, self.group.lame_mu)
        return moduli

    def relaxed(self, x: np.ndarray) -> ViscousState:
        """The state after a long rest.

        Args:
            x: Node positions [mm], (node, 3).
        """
        strain = green_strain(self.group.deformation_gradients(x))
        return ViscousState(strain, np.zeros((len(self.series.weights), *strain.shape)))

    def advanced(self, state: ViscousState, x: np.ndarray, step_s: float) -> ViscousState:
        """The state after a step.

        Args:
            state: At its start.
            x: Node positions at its end [mm], (node, 3).
            step_s: h [s].
        """
        strain = green_strain(self.group.deformation_gradients(x))
        decay, gain = self.series.step_factors(step_s)
        change = strain - state.strain
        shape = (-1, 1, 1, 1)
        spring = decay.reshape(shape) * state.spring + gain.reshape(shape) * change
        return ViscousState(strain, spring)

    def forces_by_corner(self, state: ViscousState, x: np.ndarray) -> np.ndarray:
        """Force of the branches on the nodes of every element [mN], (3, k, element).

        Args:
            state: At these positions.
            x: Node positions [mm], (node, 3).
        """
        gradient = self.group.deformation_gradients(x)
        stress = np.einsum("iap,abp->ibp", gradient, self._stress(state)) * self.group.measure
        forces: np.ndarray = -np.einsum("kbp,ibp->ikp", self.group.gradients_by_corner, stress)
        return forces

    def tangent_entries(
        self, state: ViscousState, x: np.ndarray, step_s: float, definite: bool = False
    ) -> np.ndarray:
        """-d(force)/dx at the end of a step.

        Args:
            state: At these positions.
            x: Node positions [mm], (node, 3).
            step_s: h [s].
            definite: Leave the stress's geometric part out; what is left is positive semi-definite,
                and zero on rigid motions.

        Returns:
            Upper triangles [mN/mm], (pair, element), as in `pneumorph.fem.element_stiffness`.
        """
        gradient = self.group.deformation_gradients(x)
        stress = self._stress(state)
        gain = self.series.step_factors(step_s)[1] @ self.shear_moduli
        left = np.einsum("iap,jap->ijp", gradient, gradient) * gain
        tangent = np.einsum("icp,jap->iajcp", gradient, gradient * gain)
        for axis in range(3):
            tangent[:, axis, :, axis] += left
            if not definite:
                tangent[axis, :, axis] += stress
        return contracted_entries(self.group, tangent, definite=False)

    def energy(self, state: ViscousState) -> float:
        """Energy in the springs [mN mm]."""
        density = np.einsum("np,nabp,nabp->p", self.shear_moduli, state.spring, state.spring)
        return float(density @ self.group.measure)

    def dissipation(self, state: ViscousState) -> float:
        """Power that the dashpots take [mN mm/s]."""
        rates = self.shear_moduli / np.array(self.series.times_s)[:, None]
        density = 2.0 * np.einsum("np,nabp,nabp->p", rates, state.spring, state.spring)
        return float(density @ self.group.measure)

    def _stress(self, state: ViscousState) -> np.ndarray:
        """Sum of S_i [kPa], (3, 3, point)."""
        stress: np.ndarray = 2.0 * np.einsum("np,nabp->abp", self.shear_moduli, state.spring)
        return stress


def green_strain(gradient: np.ndarray) -> np.ndarray:
    """E = (F^T F - I) / 2, (3, 3, point).

    Args:
        gradient: F, (3, 3, point).
    """
    strain: np.ndarray = 0.5 * np.einsum("iap,ibp->abp", gradient, gradient)
    strain[[0, 1, 2], [0, 1, 2]] -= 0.5
    return strain
