"""Signorini's and Coulomb's laws, word by word."""

from __future__ import annotations

import numpy as np


def assert_coulomb(
    operator: np.ndarray,
    free: np.ndarray,
    friction: float | np.ndarray,
    impulses: np.ndarray,
    tolerance: float,
) -> None:
    """Impulses (point, 3) obey the laws to a velocity [mm/s], without any solver's own residual;
    one coefficient for all or (point,)."""
    velocity = (operator @ impulses.ravel() + free).reshape(-1, 3)
    normal, tangent = impulses[:, 0], impulses[:, 1:]
    friction = np.broadcast_to(friction, normal.shape)
    length, speed = np.linalg.norm(tangent, axis=1), np.linalg.norm(velocity[:, 1:], axis=1)
    assert normal.min() >= 0.0
    assert velocity[:, 0].min() > -tolerance
    assert np.abs(velocity[normal > 0.0, 0]).max() < tolerance
    # The cone holds to rounding: impulses are put into it.
    assert np.all(length <= friction * normal * (1.0 + 1e-14))
    # What slips does so against its impulse: lambda_t |u_t| = -mu lambda_n u_t. Both sides are a
    # velocity times an impulse, so the law's velocity is their difference over mu lambda_n.
    slips = (speed > 10.0 * tolerance) & (friction * normal > 0.0)
    limit = (friction * normal)[slips, None]
    against = tangent[slips] * speed[slips, None] / limit + velocity[slips, 1:]
    assert np.abs(against).max(initial=0.0) < tolerance
