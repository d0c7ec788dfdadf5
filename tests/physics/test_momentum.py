"""A free, stressed, spinning body keeps its momenta under objective damping.

With r a rigid motion about the nodes' places at the start of a step, r . f = 0 and K r = 0, so the
step (M + h (h + beta) K) v' = M v + h f gives r . M v' = r . M v. The places move along v', which
changes no moment of M v'. So both momenta are kept exactly, whatever the step.
"""

import numpy as np
import pytest
from helpers.element_cases import ORDERS, box_part, wobbled
from helpers.law_cases import SOLIDS

from pneumorph.fem.part_model import PartModel
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.physics.physics import Physics

STEP = 0.002
STEPS = 25


def momenta(part: PartModel, state: SoftHubState) -> tuple[np.ndarray, np.ndarray]:
    """Linear [mN s] and angular about the origin [mN mm s], each (3,)."""
    impulse = part.node_mass[:, None] * state.velocity.reshape(-1, 3)
    return impulse.sum(axis=0), np.cross(state.positions, impulse).sum(axis=0)


def drift(part: PartModel, damping: str) -> tuple[float, float]:
    """Change of both momenta in 25 steps of 2 ms, relative to what they are at the start."""
    physics = Physics(
        time_step_s=STEP, damping=damping, mass_damping_per_s=0.0, gravity_mm_per_s2=0.0
    )
    body = SoftHub(part)
    start = wobbled(part, 0.1)
    spin = np.cross(np.array([3.0, -10.0, 20.0]), start) + np.array([50.0, 0.0, -20.0])
    state = SoftHubState(start, spin.ravel())
    before = momenta(part, state)
    for _ in range(STEPS):
        matrix, right = body.system(state, physics)
        state = body.advance(state, np.linalg.solve(matrix, right), STEP)
    assert np.abs(state.positions - start).max() > 0.5
    changes = [
        float(np.linalg.norm(now - then) / np.linalg.norm(then))
        for now, then in zip(momenta(part, state), before, strict=True)
    ]
    return changes[0], changes[1]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", SOLIDS)
def test_objective_damping_keeps_both_momenta(law, order):
    linear, angular = drift(box_part(law, order), "objective")
    # Rounding of each solve, 1e-16 times the condition of M + h (h + beta) K, up to 1e4.
    assert linear < 1e-10
    assert angular < 1e-10


@pytest.mark.parametrize("law", SOLIDS)
def test_published_damping_takes_a_stressed_bodys_spin(law):
    """Its K is blind to translations alone."""
    linear, angular = drift(box_part(law, "quadratic"), "published")
    assert linear < 1e-10
    assert angular > 0.01
