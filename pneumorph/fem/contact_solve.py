"""Hub and contacts of one step, after the legs' free nodes are eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from pneumorph.fem.friction_problem import FrictionProblem, FrictionSolution
from pneumorph.fem.full_order_settings import FullOrderSettings

FIRST_SWEEPS = 20
"""Gauss-Seidel sweeps before the first attempt of Newton's method; each next attempt has four times
as many."""


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Motion of the hub, and impulses and motion of the contacts."""

    hub_velocity: np.ndarray
    """The hub's unknowns, (unknown,)."""
    impulses: np.ndarray
    """Normal, tangent, tangent [mN s], (contact, 3)."""
    velocities: np.ndarray
    """Of the contacts, in the same rows [mm/s], (contact, 3)."""
    residual: float
    """Contact law violated by at most this [mm/s]."""


def solve_contacts(
    matrix: np.ndarray,
    right: np.ndarray,
    coupling: np.ndarray,
    leg_delassus: Sequence[np.ndarray],
    leg_velocity: np.ndarray,
    gaps: np.ndarray,
    warm_start: np.ndarray,
    friction: np.ndarray,
    time_step_s: float,
    numerics: FullOrderSettings,
) -> ContactSolution:
    """Solve S v_h = r + C^T lambda together with the contact laws.

    The velocity of the contact points is u = C v_h + G lambda + u_legs, so that the Delassus
    operator is W = G + C S^-1 C^T; contacts of different legs are coupled by the hub alone.

    Args:
        matrix: S, the hub's matrix with the legs' shares, (unknown, unknown).
        right: r, (unknown,).
        coupling: C, (3 contact, unknown).
        leg_delassus: Blocks of G by leg; the hub's own contacts come last and have none.
        leg_velocity: u_legs, of the contacts with the hub at rest [mm/s], (3 contact,).
        gaps: Gap that each contact would have at the step's end if it did not move [mm],
            (contact,).
        warm_start: Impulses to start from [mN s], (contact, 3).
        friction: Coulomb's coefficient of each contact, (contact,).
        time_step_s: Length of the step [s].
        numerics: Which solver, and its tolerance.

    Raises:
        numpy.linalg.LinAlgError: S is not positive definite.
    """
    factor = cho_factor(matrix, lower=True, check_finite=False)
    velocity = cho_solve(factor, right, check_finite=False)
    if len(gaps) == 0:
        return ContactSolution(velocity, np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    response = cho_solve(factor, coupling.T, check_finite=False)  # S^-1 C^T
    operator = coupling @ response
    size = sum(len(block) for block in leg_delassus)
    operator[:size, :size] += block_diag(*leg_delassus)
    free = coupling @ velocity + leg_velocity
    free[::3] += gaps / time_step_s
    problem = FrictionProblem(operator, free, friction)
    solution = _solve_friction(problem, warm_start, numerics)
    velocities = solution.velocities.copy()
    velocities[:, 0] -= gaps / time_step_s
    return ContactSolution(
        velocity + response @ solution.impulses.ravel(),
        solution.impulses,
        velocities,
        solution.residual,
    )


def _solve_friction(
    problem: FrictionProblem, warm_start: np.ndarray, numerics: FullOrderSettings
) -> FrictionSolution:
    """Sweeps alone, or Newton's method with ever more sweeps before each attempt."""
    tolerance, newton = numerics.contact_tolerance_mm_per_s, numerics.friction_solver == "newton"
    impulses, best = warm_start, None
    sweeps = FIRST_SWEEPS if newton else numerics.contact_sweeps
    left = numerics.contact_sweeps
    while True:
        impulses = problem.sweep(impulses, tolerance, min(sweeps, left))
        solution = problem.newton(impulses, tolerance if newton else np.inf)
        if best is None or solution.residual < best.residual:
            best = solution
        left -= sweeps
        sweeps *= 4
        if best.residual <= tolerance or left <= 0:
            return best
