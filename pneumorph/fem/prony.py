"""How a rubber relaxes: a Prony series, the response of springs and dashpots side by side.

Held at a sudden strain, its modulus falls from the instantaneous G_0 to the relaxed G_inf,

    G(t) / G_0 = 1 - sum_i w_i (1 - exp(-t / tau_i)),   G_inf / G_0 = 1 - sum_i w_i,

and shaken at the angular frequency w it answers with

    G*(w) / G_inf = 1 + sum_i k_i (i w tau_i) / (1 + i w tau_i),   k_i = w_i G_0 / G_inf,

whose real part is the storage modulus and whose imaginary part over it the loss factor (Ferry,
Viscoelastic Properties of Polymers, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Positive


@dataclass(frozen=True)
class PronySeries(Checked):
    """Weights and times of Maxwell's branches; none by default, a rubber that does not relax.

    Raises:
        ValueError: A weight or time is not positive, their numbers differ, or the weights sum to
            one or more.
    """

    weights: tuple[Positive, ...] = ()
    """Share w_i of the instantaneous modulus that relaxes in each Maxwell branch."""
    times_s: tuple[Positive, ...] = ()
    """Relaxation time tau_i of each branch [s]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.weights) != len(self.times_s):
            raise ValueError(
                f"got {len(self.weights)} weights and {len(self.times_s)} times_s, expected one "
                "time for each weight"
            )
        if sum(self.weights) >= 1.0:
            raise ValueError(
                f"weights sum to {sum(self.weights):g}, expected less than 1: they are shares of "
                "the instantaneous modulus, and what is left is the relaxed one"
            )

    @property
    def branch_ratios(self) -> np.ndarray:
        """k_i: stiffness of each branch over the relaxed one, (branch,)."""
        return np.array(self.weights) / (1.0 - sum(self.weights))

    def scaled(self, factor: float) -> PronySeries:
        """The same rubber with every branch's stiffness, and so nearly its loss, times a factor.

        The relaxed modulus stays, and with it what a body does that is held still.

        Args:
            factor: New k_i over the old; positive.

        Raises:
            ValueError: It is not positive and finite.
        """
        if not 0.0 < factor < np.inf:
            raise ValueError(f"factor must be positive and finite, got {factor}")
        if factor == 1.0 or not self.weights:
            return self
        ratios = factor * self.branch_ratios
        return PronySeries(tuple((ratios / (1.0 + ratios.sum())).tolist()), self.times_s)

    def step_factors(self, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """exp(-a) and (1 - exp(-a)) / a with a = h / tau_i, two of (branch,).

        What a spring keeps over a step, and what it takes of a strain that changes evenly in it.

        Args:
            step_s: h [s].
        """
        a = step_s / np.array(self.times_s)
        return np.exp(-a), -np.expm1(-a) / a

    def relaxation(self, time_s: np.ndarray) -> np.ndarray:
        """G(t) / G_inf after a sudden strain.

        Args:
            time_s: t [s], any shape.
        """
        left = np.exp(-np.multiply.outer(time_s, 1.0 / np.array(self.times_s)))
        return 1.0 + left @ self.branch_ratios

    def complex_modulus(self, angular_frequency: np.ndarray) -> np.ndarray:
        """G*(w) / G_inf of a small vibration.

        Args:
            angular_frequency: w [rad/s], any shape.
        """
        turned = 1j * np.multiply.outer(angular_frequency, np.array(self.times_s))
        return 1.0 + (turned / (1.0 + turned)) @ self.branch_ratios

    def ramp_springs(self, strains: np.ndarray, step_s: float) -> np.ndarray:
        """What the springs have of strains that began at rest, at their end, (branch, component).

        Args:
            strains: At even times, the first at rest; they change evenly between, (time,
                component).
            step_s: Time from one to the next [s].
        """
        decay, gain = self.step_factors(step_s)
        steps_left = np.arange(len(strains) - 1)[::-1]
        springs: np.ndarray = (gain[:, None] * decay[:, None] ** steps_left) @ np.diff(
            strains, axis=0
        )
        return springs

    def secant_ratio(self, strain: float, strain_rate_per_s: float) -> float:
        """Secant modulus of a tension test at an even rate, over the relaxed modulus.

        It is of branches that act on the strain of the test itself, and depends little on the
        strain chosen where they are fast or slow beside the test. Those of
        `pneumorph.fem.maxwell_group` act on Green's strain and pull harder: at a strain of 50 %
        they add 1.5 to 2.1 times as much to a silicone's stress as this says, see
        `pneumorph.fem.silicones.Silicone.test_ratio`.

        Args:
            strain: Strain at which the two are to agree.
            strain_rate_per_s: Rate of the test [1/s].
        """
        times = np.array(self.times_s) * (strain_rate_per_s / strain)  # over the test's duration
        return float(1.0 + self.branch_ratios @ (times * -np.expm1(-1.0 / times)))
