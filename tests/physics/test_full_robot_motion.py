"""Closed forms of a robot's motion: free fall, weight on the floor, mirror images."""

import numpy as np
import pytest
from helpers.small_robot import small_robot

from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.rigid_hub import RigidHub, rotation_of
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.physics.physics import Physics


@pytest.mark.parametrize("soft", [False, True])
def test_free_fall(soft):
    """Every point falls alike, along a gravity that leans: (1 + alpha h) v_new = v + h g."""
    physics = Physics(floor_height_mm=-1e6, floor_slope_deg=20.0, regulator_count=2)
    robot = small_robot(physics, soft)
    state = robot.initial_state()
    speed, fallen = np.zeros(3), np.zeros(3)
    slope = np.radians(20.0)
    gravity = 9800.0 * np.array([-np.sin(slope), 0.0, -np.cos(slope)])
    for _ in range(10):
        state = robot.step(state, np.zeros(2))
        speed = (speed + 0.01 * gravity) / (1.0 + 0.1 * 0.01)
        fallen += 0.01 * speed
    for v, x, leg in zip(state.velocities, state.positions, robot.legs, strict=True):
        # Velocities of 1000 mm/s; elastic forces at rest are rounding.
        np.testing.assert_allclose(v, np.broadcast_to(speed, v.shape), atol=1e-7)
        np.testing.assert_allclose(x, leg.initial_positions() + fallen, atol=1e-8)


def test_floor_carries_the_weight():
    robot = small_robot()
    state, _ = robot.rollout(robot.initial_state(), np.zeros((150, 2)), record_nodes=False)
    weight = (0.03 + 2 * 0.02) * 9800.0
    # The robot has come to rest to about 0.1 % of g.
    assert state.impulses[:, 0].sum() == pytest.approx(0.01 * weight, rel=2e-3)


def test_mirror_image_robots_walk_mirror_image_paths(leg_mesh):
    """Legs at places k and 7 - k; the leg's mesh is its own mirror image."""
    leg, mounting = leg_model(leg_mesh), RadialMounting()
    hub_nodes = np.array([[x, y, z] for x in (-30, 30) for y in (-30, 30) for z in (27, 45)])
    paths = []
    for places in ((0, 2), (7, 5)):
        mesh = type(leg_mesh)(hub_nodes, [[0, 1, 2, 4]])
        hub = RigidHub(mesh, 0.075)
        mounts = [(leg, mounting.pose(place), number) for number, place in enumerate(places)]
        physics = Physics(regulator_count=2)
        robot = FullRobot(hub, mounts, physics, np.array([0.0, 0.0, 45.0]))
        state, path = robot.rollout(
            robot.initial_state(), np.tile([60.0, 0.0], (10, 1)), 5, record_nodes=False
        )
        assert state.active_contacts > 0
        paths.append(path.tracked_point_mm)
    # Same sums in another order, amplified by contacts that open and close.
    np.testing.assert_allclose(paths[0] * [1.0, -1.0, 1.0], paths[1], atol=1e-5)


def test_rotation_of_a_vector_is_the_exponential():
    vector = np.array([0.3, -0.2, 0.9])
    whole = rotation_of(vector)
    half = rotation_of(0.5 * vector)
    np.testing.assert_allclose(half @ half, whole, atol=1e-14)
    np.testing.assert_allclose(whole @ vector, vector, atol=1e-14)
    np.testing.assert_allclose(rotation_of(1e-9 * vector), np.eye(3), atol=1e-8)


def test_rigid_hub_point_map_is_the_derivative_of_its_positions():
    robot = small_robot()
    hub = robot.hub
    state = hub.advance(hub.initial_state(), np.array([1.0, 2.0, 3.0, 0.5, -0.4, 0.9]), 0.5)
    points = np.random.default_rng(0).normal(size=(4, 3)) * 10.0
    velocity = np.array([0.3, -0.1, 0.2, 1.0, 0.5, -0.7])
    step = 1e-6
    change = [
        hub.point_positions(hub.advance(state, sign * velocity, step), points) for sign in (1, -1)
    ]
    expected = (hub.point_map(state, points) @ velocity).reshape(-1, 3)
    np.testing.assert_allclose((change[0] - change[1]) / (2 * step), expected, atol=1e-7)
