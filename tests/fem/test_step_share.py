"""How much of a Newton step is taken."""

import dataclasses

import numpy as np
import pytest
from fem.test_kept_newton import PHYSICS, robot
from fem.test_kept_newton import leg as leg  # a fixture

from pneumorph.fem import kept_newton
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.step_problem import StepProblem
from pneumorph.fem.step_share import ACCURACY, UPHILL, EnergyAlong, share_of_step
from pneumorph.fem.yeoh_constants import yeoh_material


@pytest.mark.parametrize("steepness", [3.0, 80.0, 1e4])
def test_the_lowest_point_of_a_stretched_sheet_is_found(steepness):
    """Energy -s + a s^4 / 4 is lowest where s is the third root of 1 / a."""
    share = share_of_step(lambda s: -1.0 + steepness * s**3)
    assert share == pytest.approx(steepness ** (-1.0 / 3.0), abs=2 * ACCURACY)


def test_all_of_a_step_is_taken_that_is_not_far_beyond_the_lowest_point():
    assert share_of_step(lambda s: -1.0 + 0.9 * s) == 1.0
    assert share_of_step(lambda s: -1.0 + (1.0 + 0.9 * UPHILL) * s) == 1.0
    assert share_of_step(lambda s: -1.0 + (1.0 + 1.1 * UPHILL) * s) < 1.0


def test_a_way_that_is_not_downhill_says_nothing():
    assert share_of_step(lambda s: 1.0 + s) == 1.0
    assert share_of_step(lambda s: np.nan) == 1.0


@pytest.mark.parametrize("beyond", [np.nan, np.inf, 1e300])
def test_elements_that_turn_inside_out_are_uphill(beyond):
    share = share_of_step(lambda s: -1.0 + 3.0 * s if s < 0.5 else beyond)
    assert ACCURACY <= share <= 0.5 + ACCURACY


def test_some_of_a_step_is_always_taken():
    assert share_of_step(lambda s: -1.0 if s == 0.0 else 1e8) == ACCURACY


def newton_step(made, start, command):
    """The energy's slope along the first Newton step from going on, and the step's ends."""
    physics = made.physics
    problem = StepProblem(made, start, command, physics)
    points = made.points_near(start, physics.time_step_s)
    now = kept_newton._evaluated(made, problem, problem.going_on(), points)
    made.kept.begin(start, physics.time_step_s, len(made.legs))
    changes = [np.zeros_like(x) for x in start.positions]
    kept_newton._renew(made, problem, made.kept, now, changes, 1.0)
    target = kept_newton._target(made, problem, made.kept.legs, now)
    energy = EnergyAlong(
        made, now.contacts, now.trial, target, problem.friction, problem.time_step_s
    )
    slope = kept_newton._slope(made, problem, now, target)
    return slope, now.trial, target, energy


def falling(made, speed, across=0.0):
    start = made.initial_state()
    down = np.array([across, 0.0, -speed])
    return dataclasses.replace(
        start,
        hub=dataclasses.replace(start.hub, velocity=np.array([*down, 0.0, 0.0, 0.0])),
        velocities=tuple(np.tile(down, (len(x), 1)) for x in start.positions),
    )


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_a_newton_step_is_downhill_and_ends_where_energy_is_least(leg, friction):
    """A robot that lands, so that its points go from below the floor to where it presses them. In
    steps of 1e-4 s it is linear but for terms of h^2: the energy is a parabola whose lowest point,
    under what the floor allows, is the Newton step's end."""
    physics = dataclasses.replace(PHYSICS, friction=friction, time_step_s=1e-4)
    made = robot(leg, physics=physics)
    start = falling(made, 2e4)  # 2 mm in a step, from 1 mm above the floor
    slope, _, target, energy = newton_step(made, start, np.zeros(2))
    assert target.impulses[:, 0].max() > 0.0
    lifting = energy._lifting_slope(0.0)
    assert lifting > 0.0
    at_start = slope(0.0)
    assert at_start < 0.0
    assert abs(slope(1.0)) < 0.02 * abs(at_start)
    assert slope(0.5) == pytest.approx(0.5 * at_start, rel=0.05)
    # Without what the floor's points are lifted against, it would seem uphill.
    assert at_start + lifting > 0.0


def test_friction_that_holds_a_point_is_downhill_too(leg):
    """A robot that lands and slides, as above. Where friction stops its points their dissipation
    falls with their speed, and with it the parabola's lowest point is the step's end."""
    physics = dataclasses.replace(PHYSICS, friction=5.0, time_step_s=1e-4)
    made = robot(leg, physics=physics)
    start = falling(made, 2e4, across=3e3)
    slope, _, target, energy = newton_step(made, start, np.zeros(2))
    pressed = target.impulses[:, 0] > 0.0
    speeds = np.linalg.norm(target.contact_velocities[pressed, 1:], axis=1)
    assert speeds.min() < 1e-6  # it sticks
    assert energy._friction_slope(0.0) < -0.01 * abs(slope(0.0))
    assert energy._friction_slope(1.0) == pytest.approx(energy._friction_slope(0.0), rel=0.05)
    assert slope(0.0) < 0.0
    assert slope(1.0) <= 0.02 * abs(slope(0.0))


def test_a_point_is_lifted_only_while_it_is_below_the_floor(leg):
    """One that comes out of the floor on the way and goes on is held by nothing afterwards."""
    made = robot(leg, physics=dataclasses.replace(PHYSICS, time_step_s=1e-4))
    _, first, target, energy = newton_step(made, falling(made, 2e4), np.zeros(2))
    velocity = 2.0 * target.hub.velocity - first.hub.velocity
    free = dataclasses.replace(
        target,
        hub=dataclasses.replace(target.hub, velocity=velocity),
        velocities=tuple(
            2.0 * b - a for a, b in zip(first.velocities, target.velocities, strict=True)
        ),
        impulses=np.zeros_like(target.impulses),
    )
    first = dataclasses.replace(first, impulses=target.impulses)
    friction = np.full(len(target.impulses), 0.6)
    beyond = EnergyAlong(made, energy._contacts, first, free, friction, 1e-4)
    assert beyond._lifting_slope(0.0) > 0.0
    assert beyond._lifting_slope(0.9) == 0.0  # twice the way to where it is out
    assert energy._lifting_slope(0.9) == energy._lifting_slope(0.0)


def test_the_slope_is_that_of_the_energy(leg):
    """In the air: kinetic energy of what velocities change, elastic energy, and weight, by a
    central difference, whose error is of the square of its 0.01."""
    physics = dataclasses.replace(PHYSICS, floor_height_mm=-1e3, time_step_s=1e-3)
    elastic = PartModel(leg.mesh, yeoh_material(50.0, 8.0, -1.0), 0.02, leg.membranes, "cavity")
    made = robot(elastic, physics=physics)
    start = falling(made, 100.0)
    rng = np.random.default_rng(0)
    start = dataclasses.replace(
        start, velocities=tuple(v + rng.normal(0.0, 300.0, v.shape) for v in start.velocities)
    )
    slope, first, target, _ = newton_step(made, start, np.zeros(2))
    problem = StepProblem(made, start, np.zeros(2), physics)

    def energy(share):
        trial = problem.between(first, target, share)
        matrix, right = problem.implicit_hub(trial)
        v = trial.hub.velocity
        total = 0.5 * v @ matrix @ v - right @ v
        for mounted, x, v, before in zip(
            made.legs, trial.positions, trial.velocities, start.velocities, strict=True
        ):
            mass = mounted.part.node_mass
            total += 0.5 * mass @ np.sum((v - before) ** 2, axis=1)
            total += mounted.part.elastic_energy(x) - mass @ x @ physics.gravity_vector
        return float(total)

    numeric = (energy(0.51) - energy(0.49)) / 0.02
    assert abs(numeric) > 0.1 * abs(slope(0.0))
    assert slope(0.5) == pytest.approx(numeric, rel=1e-3)
