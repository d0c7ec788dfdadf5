"""Mass integrals against sums over the moved nodes."""

from __future__ import annotations

import numpy as np
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part

PART = synthetic_part()
REDUCED = synthetic_reduced_part(6)


def test_integrals_reproduce_the_inertia_of_any_deformed_state():
    # Identities: both sides are the same sums in another order.
    alpha = np.random.default_rng(3).normal(size=6)
    mass, x = PART.node_mass, REDUCED.positions(alpha)
    first = REDUCED.first_moment + REDUCED.first_moment_modes @ alpha
    assert np.allclose(first, mass @ x, rtol=1e-12)
    cross = REDUCED.second_moment_modes @ alpha
    second = (
        REDUCED.second_moment + cross + cross.T + REDUCED.second_moment_mode_pairs @ alpha @ alpha
    )
    assert np.allclose(second, (mass[:, None] * x).T @ x, rtol=1e-12)
    assert np.isclose(REDUCED.mass, mass.sum())


def test_mode_pairs_contain_the_modal_mass():
    trace = np.trace(REDUCED.second_moment_mode_pairs, axis1=0, axis2=1)
    assert np.abs(trace - np.eye(6)).max() < 1e-6  # modes are rounded to single precision
