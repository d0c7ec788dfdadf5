"""Maxwell branches at the sampled points of a reduced solid, in modal coordinates.

The law of `pneumorph.fem.maxwell_group` at the points that stand for the others: springs Q_i in
Green's strain E, stress F sum_i 2 mu_i Q_i, and over a step of length h

    Q_i' = exp(-a_i) Q_i + c_i (E' - E),   a_i = h / tau_i,   c_i = (1 - exp(-a_i)) / a_i.

Weights are not negative, so what the dashpots of the sampled points take is not negative either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.maxwell_group import green_strain
from pneumorph.fem.prony import PronySeries
from pneumorph.reduction.sampled_elements import SampledElements


@dataclass(frozen=True, eq=False)
class SampledBranches:
    """Branches of a solid's sampled points. Springs are Q, (branch, point, 3, 3)."""

    elements: SampledElements
    """The points, whose shear modulus is the relaxed one."""
    series: PronySeries
    """How it relaxes."""

    @property
    def shear_moduli(self) -> np.ndarray:
        """mu_i times the measure [mN mm], (branch, point)."""
        moduli: np.ndarray = np.multiply.outer(
            self.series.branch_ratios, self.elements.weighted_lame_constants[1]
        )
        return moduli

    def relaxed(self) -> np.ndarray:
        """Springs after a long rest, wherever that was: without strain."""
        return np.zeros((len(self.series.weights), len(self.elements.measure), 3, 3))

    def decayed(self, springs: np.ndarray, step_s: float) -> np.ndarray:
        """Springs after a step in which nothing moved.

        Args:
            springs: At its start.
            step_s: h [s].
        """
        decay, _ = self.series.step_factors(step_s)
        kept: np.ndarray = decay[:, None, None, None] * springs
        return kept

    def advanced(
        self, springs: np.ndarray, before: np.ndarray, after: np.ndarray, step_s: float
    ) -> np.ndarray:
        """Springs after a step.

        Args:
            springs: At its start.
            before: Modal coordinates then, (mode,).
            after: Modal coordinates at its end, (mode,).
            step_s: h [s].
        """
        _, gain = self.series.step_factors(step_s)
        strained = self._strain(after) - self._strain(before)
        return self.decayed(springs, step_s) + np.multiply.outer(gain, strained)

    def force(self, springs: np.ndarray, alpha: np.ndarray) -> np.ndarray:
        """Generalised force of the branches [mN mm per unit of alpha], (mode,).

        Args:
            springs: At these coordinates.
            alpha: Modal coordinates, (mode,).
        """
        density = 2.0 * np.einsum("np,npab->pab", self.shear_moduli, springs)
        stress = self.elements.gradients(alpha) @ density
        force: np.ndarray = -np.einsum("pia,piam->m", stress, self.elements.mode_gradient)
        return force

    def stiffness(self, alpha: np.ndarray, step_s: float) -> np.ndarray:
        """sum_i c_i 2 mu_i dE (x) dE of a step (mode, mode), without the stress's geometric part.

        It is definite, and zero on rigid motions.

        Args:
            alpha: Modal coordinates, (mode,).
            step_s: h [s].
        """
        moduli = 2.0 * self.series.step_factors(step_s)[1] @ self.shear_moduli
        turned = np.einsum(
            "pia,pibm->pabm", self.elements.gradients(alpha), self.elements.mode_gradient
        )
        rates = 0.5 * (turned + np.swapaxes(turned, 1, 2))
        stiffness: np.ndarray = np.einsum("p,pabm,pabn->mn", moduli, rates, rates, optimize=True)
        return stiffness

    def energy(self, springs: np.ndarray) -> float:
        """Energy in the springs [mN mm]."""
        return float(np.einsum("np,npab,npab->", self.shear_moduli, springs, springs))

    def dissipation(self, springs: np.ndarray) -> float:
        """Power that the dashpots take [mN mm/s]."""
        rates = 2.0 * self.shear_moduli / np.array(self.series.times_s)[:, None]
        return float(np.einsum("np,npab,npab->", rates, springs, springs))

    def _strain(self, alpha: np.ndarray) -> np.ndarray:
        """E at modal coordinates, (point, 3, 3)."""
        gradient = np.moveaxis(self.elements.gradients(alpha), 0, 2)
        return np.moveaxis(green_strain(gradient), 2, 0)
