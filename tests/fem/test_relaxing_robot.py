"""A robot whose legs relax: what it remembers is part of its state, and takes energy alone."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.small_robot import small_leg, small_robot

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.part_ingredients import materials_text
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.state_file import state_from_arrays, state_to_arrays
from pneumorph.physics.physics import Physics

SERIES = PronySeries((0.1, 0.2), (0.65, 0.02))
STANDING = Physics(
    floor_height_mm=0.0,
    regulator_count=2,
    damping="objective",
    mass_damping_per_s=0.0,
    stiffness_damping_s=0.0,
)
COMMANDS = np.tile([20.0, 5.0], (6, 1))
INTEGRATORS = ("linearly_implicit", "implicit_euler")


def relaxing_leg(series: PronySeries | None) -> PartModel:
    leg = small_leg()
    return PartModel(
        leg.mesh, leg.material, leg.mass_kg, leg.membranes, "cavity", relaxation=series
    )


def robot(series: PronySeries | None = SERIES, integrator: str = "implicit_euler"):
    numerics = FullOrderSettings(integrator=integrator)
    return small_robot(STANDING, leg=relaxing_leg(series), numerics=numerics)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_branches_of_no_weight_change_nothing(integrator):
    """Weights of 1e-12 move nodes by as little of what they move."""
    faint, none = (
        each.rollout(each.initial_state(), COMMANDS)[0]
        for each in (robot(PronySeries((1e-12,), (0.1,)), integrator), robot(None, integrator))
    )
    for x, y in zip(faint.positions, none.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-8)
    assert none.memories == (None, None)


def test_how_a_solid_relaxes_is_part_of_what_it_is():
    """Walks are kept by what they were made with."""
    elastic, relaxing, other = (
        materials_text(relaxing_leg(each)) for each in (None, SERIES, PronySeries((0.1,), (0.65,)))
    )
    assert len({tuple(elastic), tuple(relaxing), tuple(other)}) == 3
    assert elastic == materials_text(relaxing_leg(PronySeries())) == relaxing[:-1]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_leg_that_relaxes_gives_way_more_slowly(integrator):
    """Branches of 100 s do not relax in 0.06 s: as stiff as if the modulus were 1 / 0.7 times so
    high, and softer the sooner they relax."""
    tips = []
    for time_s in (1e-4, 0.02, 100.0):
        made = robot(PronySeries((0.3,), (time_s,)), integrator)
        start = made.initial_state()
        state, _ = made.rollout(start, COMMANDS)
        right = made.legs[0].part.mesh.node_set("right")
        tips.append(np.linalg.norm((state.positions[0] - start.positions[0])[right]))
    assert tips[0] > tips[1] > tips[2] > 0.0


def test_a_saved_state_goes_on_to_the_same_bits():
    made = robot()
    state, _ = made.rollout(made.initial_state(), COMMANDS)
    restored = state_from_arrays(made, state_to_arrays(state))
    ends = [made.step(each, COMMANDS[0]) for each in (state, restored)]
    for x, y in zip(*(end.positions for end in ends), strict=True):
        np.testing.assert_array_equal(x, y)
    for a, b in zip(*(end.memories for end in ends), strict=True):
        np.testing.assert_array_equal(a.spring, b.spring)


def test_converged_steps_of_both_integrators_meet():
    """Both are of first order: at a quarter of the step they are nearer by more than half."""
    gaps = []
    for step in (4e-3, 1e-3):
        physics = replace(STANDING, time_step_s=step)
        ends = []
        for integrator in INTEGRATORS:
            made = small_robot(
                physics,
                leg=relaxing_leg(SERIES),
                numerics=FullOrderSettings(integrator=integrator),
            )
            commands = np.tile([5.0, 2.0], (round(0.02 / step), 1))
            ends.append(made.rollout(made.initial_state(), commands)[0].positions[0])
        gaps.append(np.linalg.norm(ends[0] - ends[1]))
    assert gaps[1] < 0.5 * gaps[0]
