"""A block of finite elements on floors: closed forms of everything its contact must get right."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub, RigidHubState
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.floor import Floor, HeightField
from pneumorph.physics.physics import Physics

GRAVITY = 9800.0
MASS = 0.03 + 2 * 0.02
PENETRATION_LIMIT_MM = 0.05


def block(floor: Floor | None = None, **changes: object) -> FullRobot:
    """A rigid box 16 x 12 x 9 mm and two stiff elastic ones at its ends, all flat on z = 0."""
    end = box_mesh((20.0, 12.0, 9.0), (2, 1, 1))
    end = dataclasses.replace(
        end,
        node_sets={"attachment": end.node_sets["left"]},
        contact_points=end.nodes[end.nodes[:, 2] < 1e-9],
    )
    part = PartModel(end, Material(3e4, 0.3), 0.02)
    middle = box_mesh((16.0, 12.0, 9.0), (1, 1, 1))
    middle = dataclasses.replace(middle, nodes=middle.nodes - [8.0, 6.0, 0.0])
    bottom = middle.nodes[middle.nodes[:, 2] < 1e-9]
    place = Pose(np.eye(3), np.array([8.0, -6.0, 0.0]))
    mounts = [(part, Pose(rotation_about("z", angle)).compose(place), 0) for angle in (0.0, 180.0)]
    numerical = {each.name for each in dataclasses.fields(FullOrderSettings)}
    numerics = FullOrderSettings(**{k: v for k, v in changes.items() if k in numerical})
    physics = Physics(
        **({"floor_height_mm": 0.0, "regulator_count": 1, "mass_damping_per_s": 0.0}
           | {k: v for k, v in changes.items() if k not in numerical})
    )  # fmt: skip
    hub = RigidHub(middle, 0.03, bottom)
    return FullRobot(hub, mounts, physics, floor=floor, numerics=numerics)


def placed(robot: FullRobot, rotation=None, offset=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    """The initial state turned about the origin, moved and pushed."""
    rotation = np.eye(3) if rotation is None else rotation
    state, offset, velocity = robot.initial_state(), np.array(offset), np.array(velocity)
    hub = RigidHubState(
        rotation @ state.hub.centre + offset, rotation, np.concatenate([velocity, np.zeros(3)])
    )
    return dataclasses.replace(
        state,
        hub=hub,
        positions=tuple(x @ rotation.T + offset for x in state.positions),
        velocities=tuple(v + velocity for v in state.velocities),
    )


def run(robot: FullRobot, state: FullRobotState, steps: int) -> list[FullRobotState]:
    """States after each step; every one obeys the contact law to 1e-6 mm/s.

    The solver's own tolerance of 1e-7 is at the edge of rounding here: more points press than the
    nearly rigid block has freedoms, and their operator is singular."""
    states: list[FullRobotState] = []
    commands = np.zeros((steps, 1))
    _, trajectory = robot.rollout(state, commands, steps, record_nodes=False, observe=states.append)
    assert trajectory.status == "completed"
    contact = trajectory.metadata["contact"]
    assert contact["worst_residual_mm_per_s"] == max(s.contact_residual for s in states)
    assert contact["deepest_penetration_mm"] == max(s.penetration_mm for s in states)
    assert contact["worst_residual_mm_per_s"] < 1e-6
    return states


def total_impulse(robot: FullRobot, state: FullRobotState) -> np.ndarray:
    """Sum of the contacts' impulses in world axes [mN s], (3,)."""
    frames = np.concatenate([robot.floor.frames(each) for each in robot.contact_positions(state)])
    return np.einsum("pra,pr->a", frames, state.impulses)


@pytest.mark.parametrize("slope", [0.0, 15.0])
def test_the_floor_carries_the_weight(slope):
    robot = block(floor_slope_deg=slope)
    state = run(robot, robot.initial_state(), 60)[-1]
    expected = -0.01 * MASS * robot.physics.gravity_vector
    # The block settles by d = 2.5e-4 mm under its weight, relaxing by 1 / (1 + h / beta) a step,
    # beta 0.1 s: after 60 steps m d h / beta^2 / 1.1^60 = 6e-8 mN s are not yet carried.
    np.testing.assert_allclose(total_impulse(robot, state), expected, atol=1e-7)
    assert state.impulses[:, 0].min() >= 0.0


@pytest.mark.parametrize("friction", [0.3, 1.2])
def test_it_sticks_just_under_the_friction_angle_without_creep(friction):
    robot = block(friction=friction, floor_slope_deg=0.99 * np.degrees(np.arctan(friction)))
    states = run(robot, robot.initial_state(), 160)
    way = np.array(states[-1].positions) - np.array(states[59].positions)
    assert np.abs(way).max() < 1e-3  # in 1 s
    # Each step's velocity is zero to the solver's tolerance.
    pressed = states[-1].impulses[:, 0] > 0.0
    assert np.count_nonzero(pressed) >= 3
    assert np.abs(states[-1].contact_velocities[pressed]).max() < 1e-6


@pytest.mark.parametrize("friction", [0.3, 1.2])
def test_it_slides_just_over_the_friction_angle_with_the_difference(friction):
    slope = 1.01 * np.arctan(friction)
    robot = block(friction=friction, floor_slope_deg=float(np.degrees(slope)))
    states = run(robot, robot.initial_state(), 100)
    expected = -GRAVITY * (np.sin(slope) - friction * np.cos(slope))
    speed = np.array([state.hub.velocity[0] for state in states[59:]])
    measured = (speed[-1] - speed[0]) / (0.01 * (len(speed) - 1))
    # The elastic transients of the first 60 steps are gone; the solver's tolerance over 40 steps
    # remains.
    assert measured == pytest.approx(expected, rel=1e-5)
    pressed = states[-1].impulses[:, 0] > 0.0
    np.testing.assert_allclose(states[-1].contact_velocities[pressed, 1], speed[-1], rtol=1e-6)


@pytest.mark.parametrize(("friction", "speed"), [(0.3, 100.0), (0.3, 400.0), (1.2, 400.0)])
def test_it_stops_after_v_squared_over_two_mu_g(friction, speed):
    """Coulomb's law, discretised: v_new = v - h mu g until it sticks, then it stays for good."""
    robot = block(friction=friction)
    resting = run(robot, robot.initial_state(), 60)[-1]
    along = np.array([speed, 0.0, 0.0])
    hub = dataclasses.replace(resting.hub, velocity=resting.hub.velocity + np.pad(along, (0, 3)))
    pushed = dataclasses.replace(
        resting, hub=hub, velocities=tuple(v + along for v in resting.velocities)
    )
    states = run(robot, pushed, 60)
    way = np.array([state.hub.centre[0] for state in states]) - resting.hub.centre[0]
    expected = 0.01 * np.maximum(speed - 0.01 * friction * GRAVITY * np.arange(1, 61), 0.0).sum()
    # Braking shears the stiff block by stress over modulus, mu rho g L^2 / G = 1e-3 mm at most, and
    # it springs back as it stops.
    assert way[-1] == pytest.approx(expected, abs=1e-5)
    # Implicit Euler's first step already brakes: half a step's way less than v^2 / (2 mu g).
    assert abs(way[-1] - speed**2 / (2.0 * friction * GRAVITY)) < 0.5 * 0.01 * speed
    assert abs(way[-1] - way[-11]) < 1e-9


def test_a_field_of_constant_slope_is_the_plane_of_that_slope():
    """The same motion seen in axes that lean by 20 degrees: it falls, lands and slides down."""
    slope, friction = 20.0, 0.3
    lean = rotation_about("y", -slope)
    rise = np.tan(np.radians(slope))
    plane = block(friction=friction, floor_slope_deg=slope)
    field = block(HeightField(lambda x, y: rise * x), friction=friction)
    above = np.array([0.0, 0.0, 3.0])
    on_plane = run(plane, placed(plane, offset=above), 40)[-1]
    on_field = run(field, placed(field, lean, lean @ above), 40)[-1]
    assert on_plane.hub.velocity[0] < -50.0
    for x, y in zip(on_plane.positions, on_field.positions, strict=True):
        # Solver tolerances of 1e-7 mm/s over 0.4 s, amplified where points touch in turn; central
        # differences of the height give the slope to 1e-12.
        np.testing.assert_allclose(y, x @ lean.T, atol=1e-5)
    np.testing.assert_allclose(on_field.contact_velocities, on_plane.contact_velocities, atol=1e-4)


def bowl(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A cosine bowl 20 mm deep and 150 mm wide [mm]; curvature up to 0.0175 / mm."""
    wave = 2.0 * np.pi / 150.0
    height: np.ndarray = 10.0 * (2.0 - np.cos(wave * x) - np.cos(wave * y))
    return height


def test_it_comes_to_rest_in_a_bowl():
    robot = block(HeightField(bowl), friction=0.1)
    start = np.array([15.0, -12.0, 12.0])
    states = run(robot, placed(robot, offset=start), 250)
    assert max(state.penetration_mm for state in states) < PENETRATION_LIMIT_MM
    last = states[-1]
    # It has slid to the middle, as near as friction lets it, and lies still there: the forces of a
    # floor that faces every way carry the weight.
    assert np.hypot(*last.hub.centre[:2]) < 0.5 * np.hypot(*start[:2])
    assert max(np.abs(v).max() for v in last.velocities) < 1e-4
    np.testing.assert_allclose(
        total_impulse(robot, last), [0.0, 0.0, 0.01 * MASS * GRAVITY], atol=1e-5
    )


def test_no_point_passes_through_when_it_drops():
    robot = block()
    state = placed(robot, rotation_about("x", 10.0) @ rotation_about("y", 25.0), (0.0, 0.0, 60.0))
    states = run(robot, state, 60)
    assert states[0].penetration_mm == 0.0
    assert states[-1].active_contacts > 0
    leg = robot.legs[0]
    elastic = leg.contact_weights[:, leg.attachment].sum(axis=1) == 0.0
    for before, after in itertools.pairwise(states):
        # What a point's velocity moves it by, normal first.
        start, end = (robot.contact_positions(each)[0] for each in (before, after))
        way = (end - start)[:, [2, 0, 1]] / 0.01
        velocity = after.contact_velocities[: len(way)]
        took_part = np.any(velocity != 0.0, axis=1) & elastic
        np.testing.assert_allclose(velocity[took_part], way[took_part], atol=1e-8)
    # On a plane the gap of an elastic point is linear in the velocities: the solver's tolerance of
    # 1e-7 mm/s times 0.01 s is left.
    assert max(state.penetration_mm for state in states) < 2e-9


def test_points_from_beyond_the_margin_are_caught():
    """Gravity of 98 m/s^2 takes the block 9.8 mm in its first step, through a floor 5 mm below."""
    penetration = {}
    for passes in (1, 4):
        robot = block(gravity_mm_per_s2=98000.0, contact_passes=passes, penetration_limit_mm=10.0)
        state = robot.step(placed(robot, offset=(0.0, 0.0, 5.0)), np.zeros(1))
        penetration[passes] = state.penetration_mm
    assert penetration[1] == pytest.approx(9.8 - 5.0)
    assert penetration[4] < 1e-6


WAVE = 2.0 * np.pi / 200.0
CURVATURE = 20.0 * WAVE**2
"""Of a trough 40 mm deep and 200 mm wide, at its bottom [1/mm]."""


def slide_through_trough(time_step_s: float, passes: int, steps: int) -> float:
    """Deepest penetration [mm] of a block whose ends touch a trough's sides at first, pushed across
    at 400 mm/s."""
    trough = HeightField(
        lambda x, y: -20.0 * np.cos(WAVE * x),
        lambda x, y: (20.0 * WAVE * np.sin(WAVE * x), np.zeros_like(y)),
    )
    robot = block(
        trough,
        friction=0.0,
        time_step_s=time_step_s,
        contact_passes=passes,
        penetration_limit_mm=10.0,
    )
    touching = -20.0 * np.cos(WAVE * 28.0)
    state = placed(robot, offset=(0.0, 0.0, touching), velocity=(400.0, 0.0, 0.0))
    return max(each.penetration_mm for each in run(robot, state, steps))


def test_penetration_of_a_bent_floor_is_of_second_order_and_bounded():
    whole, half = (slide_through_trough(h, 1, 1) for h in (0.01, 0.005))
    # Solved once, a point leaves the plane it was held to by half the curvature times its way
    # squared (here less: the floor bends less at the sides), so half the step makes a fourth of it;
    # a sixth more or less for the terms of third order.
    assert PENETRATION_LIMIT_MM < whole < 0.5 * CURVATURE * (400.0 * 0.01) ** 2
    assert whole / half == pytest.approx(4.0, rel=1 / 6)
    # Solved again with the floor where the points came to lie, whatever the speed.
    assert slide_through_trough(0.01, 1, 30) > PENETRATION_LIMIT_MM
    assert slide_through_trough(0.01, 4, 30) < PENETRATION_LIMIT_MM
