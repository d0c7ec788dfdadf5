"""Hub and contacts of one step, after the legs' free nodes are eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from pneumorph.fem.full_order_settings import FullOrderSettings


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Motion of the hub and impulses of the contacts."""

    hub_velocity: np.ndarray
    """The hub's unknowns, (unknown,)."""
    impulses: np.ndarray
    """Normal, x, y [mN s], (contact, 3)."""
    residual: float
    """Contact law violated by at most this [mm/s]."""
    sweeps: int
    """Sweeps of the friction solver."""


def solve_contacts(
    matrix: np.ndarray,
    right: np.ndarray,
    coupling: np.ndarray,
    leg_delassus: Sequence[np.ndarray],
    leg_velocity: np.ndarray,
    gaps: np.ndarray,
    warm_start: np.ndarray,
    settings: FullOrderSettings,
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
        gaps: Height above the floor [mm], (contact,).
        warm_start: Impulses to start from [mN s], (contact, 3).
        settings: Friction and tolerance.

    Raises:
        numpy.linalg.LinAlgError: S is not positive definite.
    """
    factor = cho_factor(matrix, lower=True, check_finite=False)
    velocity = cho_solve(factor, right, check_finite=False)
    count = len(gaps)
    if count == 0:
        return ContactSolution(velocity, np.zeros((0, 3)), 0.0, 0)
    import pneumorph._engine as engine

    response = cho_solve(factor, coupling.T, check_finite=False)  # S^-1 C^T
    operator = coupling @ response
    size = sum(len(block) for block in leg_delassus)
    operator[:size, :size] += block_diag(*leg_delassus)
    free = coupling @ velocity + leg_velocity
    free[::3] += gaps / settings.time_step_s
    impulse, residual, sweeps = engine.solve_friction_contacts(
        np.ascontiguousarray(operator),
        free,
        settings.friction,
        np.ascontiguousarray(warm_start.ravel()),
        settings.contact_tolerance_mm_per_s,
        settings.contact_sweeps,
    )
    return ContactSolution(
        velocity + response @ impulse, impulse.reshape(-1, 3), float(residual), int(sweeps)
    )
