"""The contact law of the reference: by its words, and by differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.coulomb import assert_coulomb
from helpers.crawlers import crawlers

from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reference_contact import (
    FrictionLaw,
    contact_kinematics,
    projection,
    projection_slope,
    solve_friction,
)
from pneumorph.simulation.reference_step import modes_of, moved_state, unknowns_of


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("rank", [90, 40])
def test_impulses_obey_the_law(friction, rank):
    """Thirty points; with more of their freedoms than the body has W is singular."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(90, rank)) / np.sqrt(90.0)
    # Velocities that the body could give its points, but for a fall of all.
    free = 100.0 * root @ rng.normal(size=rank) + np.tile([-30.0, 0.0, 0.0], 30) * (rank == 90)
    operator = root @ root.T
    law = FrictionLaw(operator, free, np.full(30, friction))
    impulses = solve_friction(law, np.zeros((30, 3)), 1e-9)
    # The residual is a velocity at each point's own scale; the words see it to a factor of ten.
    assert_coulomb(operator, free, friction, impulses, 1e-8)
    assert 0 < np.count_nonzero(impulses[:, 0]) < 30


def test_a_law_that_is_not_met_is_told():
    law = FrictionLaw(np.eye(3), np.array([-2.0, 3.0, 0.0]), np.array([0.5]))
    np.testing.assert_allclose(solve_friction(law, np.zeros((1, 3)), 1e-12), [[2.0, -1.0, 0.0]])
    with pytest.raises(ArithmeticError, match=r"friction at 1 points .* expected -1"):
        solve_friction(law, np.zeros((1, 3)), -1.0)


def test_a_wrong_solution_has_a_residual_in_velocity():
    """One contact of 1 kg pushed on by 2 mm/s, too little impulse: it goes on at what is left."""
    law = FrictionLaw(np.eye(3), np.array([-2.0, 0.0, 0.0]), np.array([0.5]))
    assert law.residual(np.array([[1.5, 0.0, 0.0]])) == pytest.approx(0.5)
    assert law.residual(np.array([[2.0, 0.0, 0.0]])) == 0.0


def test_the_projections_slope_is_its_derivative():
    """At a free, a sticking and two slipping points, by central differences."""
    impulses = np.array([[-1.0, 2.0, 1.0], [3.0, 0.4, -0.5], [2.0, 3.0, 1.0], [1.0, -0.2, 0.9]])
    step, friction = 1e-6, np.array([0.5, 0.5, 0.5, 0.3])
    slopes = projection_slope(impulses, friction)
    for column, axis in enumerate(np.eye(3)):
        ahead, behind = (projection(impulses + by * axis, friction) for by in (step, -step))
        # Third derivatives of some units times the step squared, and rounding over the step.
        np.testing.assert_allclose(slopes[:, :, column], (ahead - behind) / (2 * step), atol=1e-9)


def test_points_move_as_their_jacobian_says():
    """(18) is the rate of (11) as (24) moves the robot on."""
    robot = crawlers()[2]
    rng = np.random.default_rng(2)
    simulator = BatchedSimulator([robot], Physics(regulator_count=2), thread_count=1)
    rest = simulator.state(0)
    shape = rest.modes.shape
    state = replace(
        rest,
        position=rng.normal(size=3),
        rotation=rotation_about("x", 20.0) @ rotation_about("z", 50.0),
        velocity=30.0 * rng.normal(size=3),
        angular_velocity=rng.normal(size=3),
        modes=0.3 * rng.normal(size=shape),
        mode_rates=rng.normal(size=shape),
    )

    def positions(at):
        return contact_kinematics(robot, at.position, at.rotation, modes_of(robot, at))[0]

    velocity, step = unknowns_of(robot, state), 1e-4
    ahead, behind = (positions(moved_state(robot, state, velocity, h)) for h in (step, -step))
    rates = ((ahead - behind) / (2.0 * step))[:, [2, 0, 1]]
    _, jacobian = contact_kinematics(robot, state.position, state.rotation, modes_of(robot, state))
    # Third derivatives, arms of 150 mm times (1 rad/s)^3, times the step squared over six.
    np.testing.assert_allclose(jacobian @ velocity, rates, atol=1e-5)
