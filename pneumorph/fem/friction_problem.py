"""Unilateral contact with Coulomb friction at many points of a full robot: the engine's solvers.

The points' velocities are u = W lambda + q, rows normal, tangent, tangent; impulses lambda obey
equation (28) of docs/physics.md at each, which is solved by Newton's method (31) or by projected
Gauss-Seidel sweeps. The law is not regularised. The method is that of reduced robots,
``engine/friction_newton.hpp``, over a dense W.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import pneumorph._engine as _engine


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Impulses of the contacts and how well they obey the law."""

    impulses: np.ndarray
    """Normal, tangent, tangent [mN s], (contact, 3); always within the cone."""
    velocities: np.ndarray
    """Velocities u of the contacts, in the same rows [mm/s], (contact, 3)."""
    residual: float
    """Largest velocity by which a contact violates its law [mm/s], (30)."""


class FrictionProblem:
    """Contacts coupled by a dense operator.

    Args:
        operator: The Delassus operator W of (27) [1/kg], symmetric, (3 contact, 3 contact).
        free: q: velocities without impulses, gap over time step included [mm/s], (3 contact,).
        friction: Coulomb's coefficient mu, one for all or (contact,).

    Raises:
        ValueError: Shapes do not fit together.
    """

    def __init__(
        self, operator: np.ndarray, free: np.ndarray, friction: float | np.ndarray
    ) -> None:
        self.operator: np.ndarray = np.ascontiguousarray(operator, dtype=float)
        self.free: np.ndarray = np.ascontiguousarray(free, dtype=float)
        self.friction: np.ndarray = np.full(len(free) // 3, friction, dtype=float)
        self._solver = _engine.Friction(self.operator, self.free, self.friction)

    def solution(self, impulses: np.ndarray) -> FrictionSolution:
        """Return impulses (contact, 3), put into the cone, with their velocities and residual."""
        return self.newton(impulses, np.inf)

    def sweep(self, start: np.ndarray, tolerance: float, sweep_count: int) -> np.ndarray:
        """Return impulses after projected Gauss-Seidel sweeps from a start, (contact, 3).

        Args:
            start: Impulses to start from [mN s], (contact, 3).
            tolerance: Stop when a sweep removes no larger violation than this [mm/s].
            sweep_count: Most sweeps.
        """
        swept: np.ndarray = self._solver.sweep(_floats(start), tolerance, sweep_count)
        return swept

    def newton(self, start: np.ndarray, tolerance: float) -> FrictionSolution:
        """Return the best that Newton's method finds from a start.

        Args:
            start: Impulses to start from [mN s], (contact, 3).
            tolerance: Stop when no law is violated by more than this [mm/s].
        """
        return FrictionSolution(*self._solver.newton(_floats(start), tolerance))


def _floats(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array, dtype=float)
