"""A rigid block on a floor has closed forms for everything the contact solver must get right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.robot.robot import Hub, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.stepper_settings import StepperSettings

GRAVITY = 9800.0
HALF = np.array([20.0, 15.0, 5.0])
MASS = 0.2


def block() -> Robot:
    """A homogeneous box, its eight corners able to touch."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * HALF
    second = MASS * np.diag(HALF**2) / 3.0
    return Robot(Hub(MASS, np.zeros(3), second, np.zeros(3), corners), ())


STEPPER = StepperSettings(contact_tolerance_mm_per_s=1e-7, contact_sweeps=2000)


def physics(**changes) -> Physics:
    fields = {"floor_height_mm": -HALF[2], "mass_damping_per_s": 0.0, "regulator_count": 1}
    return Physics(**(fields | changes))


def run(world: Physics, steps: int, velocity=(0.0, 0.0, 0.0)) -> BatchedSimulator:
    simulator = BatchedSimulator([block()], world, STEPPER, thread_count=1)
    simulator.write(0, "velocity", np.array(velocity))
    simulator.advance(np.zeros((1, 1)), steps)
    assert simulator.status[0] == RobotStatus.RUNNING
    return simulator


def test_normal_impulses_carry_the_weight():
    simulator = run(physics(), 50)
    impulse = simulator.read("impulses")[0]
    # At rest each step's impulse balances gravity's; the solver's tolerance of 1e-7 mm/s times the
    # mass bounds the rest.
    assert impulse[:, 0].sum() == pytest.approx(MASS * GRAVITY * 0.01, rel=1e-6)
    assert np.all(impulse[:, 0] >= 0.0)
    assert abs(simulator.read("position")[0, 2]) < 1e-6


@pytest.mark.parametrize("friction", [0.3, 1.2])
def test_block_sticks_just_under_the_friction_angle_without_creep(friction):
    slope = np.degrees(np.arctan(friction * 0.98))
    simulator = run(physics(friction=friction, floor_slope_deg=slope), 20)
    before = simulator.tracked_point_mm[0]
    simulator.advance(np.zeros((1, 1)), 500)
    # Sticking is exact but for the solver's tolerance of 1e-7 mm/s; 5 s of it stay far below the
    # 0.001 mm/s that a user would see as creep.
    assert np.abs(simulator.tracked_point_mm[0] - before).max() < 5.0 * 1e-5


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_block_slides_over_the_friction_angle_with_the_difference(friction):
    slope = np.arctan(friction * 1.1)
    world = physics(friction=friction, floor_slope_deg=float(np.degrees(slope)))
    steps, h = 40, world.time_step_s
    simulator = run(world, steps)
    acceleration = GRAVITY * (np.sin(slope) - friction * np.cos(slope))
    # Implicit Euler: x = sum of h * (k h a), k = 1..n.
    expected = -acceleration * h * h * steps * (steps + 1) / 2.0
    assert simulator.tracked_point_mm[0, 0] == pytest.approx(expected, rel=1e-5)


def test_sliding_block_stops_after_v_squared_over_two_mu_g():
    friction, speed = 0.4, 400.0
    simulator = run(physics(friction=friction), 100, velocity=(speed, 0.0, 0.0))
    exact = speed**2 / (2.0 * friction * GRAVITY)
    # First order in time: the last step's share is at most v h / 2.
    assert abs(simulator.tracked_point_mm[0, 0] - exact) < speed * 0.01 / 2.0
    assert np.abs(simulator.read("velocity")).max() < 1e-5


def test_friction_opposes_oblique_sliding():
    """The cone is round: the deceleration is mu g along the velocity, whatever its direction."""
    direction = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    simulator = run(physics(friction=0.5), 4, velocity=300.0 * direction)
    velocity = simulator.read("velocity")[0]
    expected = (300.0 - 4 * 0.01 * 0.5 * GRAVITY) * direction
    assert np.abs(velocity - expected).max() < 1e-4


def test_block_dropped_on_the_floor_does_not_pass_through():
    world = physics(floor_height_mm=-HALF[2] - 30.0)
    simulator = run(world, 200)
    assert simulator.read("worst_penetration")[0] < 1e-4
    assert simulator.read("position")[0, 2] == pytest.approx(-30.0, abs=1e-4)


@pytest.mark.parametrize("deep_mm", [0.01, 1.0])
def test_a_block_that_begins_in_the_floor_ends_the_step_on_it(deep_mm: float) -> None:
    """The law is for the gap at the step's end, so a step makes good what was violated before."""
    simulator = run(physics(floor_height_mm=-HALF[2] + deep_mm), 1)
    assert simulator.read("worst_penetration")[0] == pytest.approx(deep_mm)
    assert simulator.read("position")[0, 2] == pytest.approx(deep_mm, abs=1e-8)


@pytest.mark.parametrize("angle_deg", [10.0, 35.0, -60.0])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_lowest_corner_of_a_tilted_block_comes_down_to_the_floor_and_no_further(
    axis: str, angle_deg: float
) -> None:
    """Its gap is where the turned corner is: levelled, another one would be lower, or higher."""
    rotation = rotation_about(axis, angle_deg) @ rotation_about("z", 20.0)
    corners = block().hub.contact_points @ rotation.T
    gap, speed = 0.05, 10.0
    simulator = BatchedSimulator([block()], physics(gravity_mm_per_s2=0.0), STEPPER, 1)
    height = physics().floor_height_mm - corners[:, 2].min() + gap
    start = replace(
        simulator.state(0),
        position=np.array([0.0, 0.0, height]),
        rotation=rotation,
        velocity=np.array([0.0, 0.0, -speed]),
    )
    simulator.set_state(0, start)
    simulator.advance(np.zeros((1, 1)), 1)
    after = simulator.state(0)
    lowest = (block().hub.contact_points @ after.rotation.T)[:, 2].min() + after.position[2]
    # The step moves corners along straight lines; what turning bends of these is the square of the
    # angle, which is speed times step over the arm of 20 mm and more.
    bent = 25.0 * (speed * 0.01 / 20.0) ** 2 / 2.0
    assert lowest == pytest.approx(physics().floor_height_mm, abs=2.0 * bent)
    assert np.count_nonzero(after.impulses[:, 0]) == 1


def test_free_fall_is_implicit_eulers():
    simulator = run(physics(floor_height_mm=-1e6), 30)
    expected = -GRAVITY * 0.01**2 * 30 * 31 / 2.0
    assert simulator.read("position")[0, 2] == pytest.approx(expected, rel=1e-12)


def test_a_free_hub_turns_at_constant_speed():
    simulator = BatchedSimulator(
        [block()], physics(floor_height_mm=-1e6, gravity_mm_per_s2=0.0), STEPPER, thread_count=1
    )
    simulator.write(0, "angular_velocity", np.array([0.0, 0.0, 2.0]))
    simulator.advance(np.zeros((1, 1)), 100)
    rotation = simulator.read("rotation")[0]
    # A principal axis: 2 rad/s for 1 s, by the exponential map exactly.
    expected = [[np.cos(2), -np.sin(2), 0], [np.sin(2), np.cos(2), 0], [0, 0, 1]]
    assert np.abs(rotation - expected).max() < 1e-12
