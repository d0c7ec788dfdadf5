"""What holds for walking robots: symmetry, the contact law, energy and precision."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, GAIT, PART, PHYSICS, STEPPER, crawlers, march
from helpers.one_leg import HUB
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fem.corotational import law_with_rotation
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.pressure import rate_limit
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout


def test_mirror_image_robots_walk_mirror_image_paths():
    """Robots 0 and 1 mirror each other in y; so do their paths, but for the friction solver.

    Gauss-Seidel visits the points of the mirror image in another order, and stops when a sweep
    changes no velocity by more than 1e-9 mm/s; its slowest error is some 1e4 sweeps long, so 160
    steps of 0.01 s may differ by up to about 1e-3 mm. They travel millimetres.
    """
    stepper = replace(STEPPER, contact_tolerance_mm_per_s=1e-9, contact_sweeps=3000)
    state = march(BatchedSimulator(crawlers()[:2], PHYSICS, stepper, thread_count=1))
    left, right = state["position"]
    assert np.abs(left - right * [1.0, -1.0, 1.0]).max() < 1e-3
    assert np.abs(left).max() > 0.1  # it moved at all


def test_every_step_obeys_the_contact_law():
    """Points that carry load end the step on the floor, within the cone; none ends below it."""
    simulator = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1)
    for command in GAIT:
        for _ in range(20):
            simulator.advance(np.tile(command, (3, 1)), 1)
            impulses = simulator.read("impulses")
            normal, tangent = impulses[..., 0], np.linalg.norm(impulses[..., 1:], axis=-1)
            assert np.all(normal >= 0.0)
            assert np.all(tangent <= PHYSICS.friction * normal * (1.0 + 1e-12))
    assert simulator.read("unconverged_total").sum() == 0
    assert simulator.read("worst_residual").max() <= STEPPER.contact_tolerance_mm_per_s
    assert simulator.read("contact_total").min() > 160  # they were on the floor
    # The step's floor law is linear in the velocities: a turn W over h = 0.01 s leaves it by half
    # of (W h)^2 times a lever of 150 mm, 0.03 mm at 2 rad/s.
    assert simulator.read("worst_penetration").max() < 0.03


def test_contact_forces_carry_a_resting_robot_as_pressed_points_stand_still():
    # At rest the momentum is constant, so F = W; what is left moves less than 1e-3 of g h a step.
    part = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
    poses = [Pose(rotation_about("z", angle), np.zeros(3)) for angle in (0.0, 120.0, 240.0)]
    robot = Robot(HUB, tuple(Mount(part, pose, (0,)) for pose in poses))
    physics = replace(PHYSICS, floor_height_mm=-30.0)
    reduced = ReducedRobot(robot, physics, replace(STEPPER, contact_sweeps=1000))
    _, trajectory = rollout(reduced, np.zeros((400, 2)), record_every=400)
    weight = (3 * part.mass + HUB.mass) * 9800.0
    force = trajectory.contact_force_mN[-1]
    np.testing.assert_allclose(force.sum(axis=(0, 1)), [0.0, 0.0, weight], atol=1e-3 * weight)
    speed = np.abs(trajectory.contact_velocity_mm_per_s[-1])
    assert np.any(force[..., 2] > 0.0)
    assert speed.max() < 1e-3 * 9800.0 * physics.time_step_s


def test_a_robot_that_does_not_come_to_rest_does_not_walk(monkeypatch):
    """A walk would begin where the fall was given up, in the air, with its failure forgotten."""
    robot = paper_robot("published").reduced("1.0.0.0.2.0.0.0")
    walked = robot.rollout
    asked = []

    def failing(state, commands, *rest, **options):
        asked.append(len(commands))
        state, trajectory = walked(state, commands, *rest, **options)
        return state, replace(trajectory, status="diverged")

    monkeypatch.setattr(robot, "rollout", failing)
    _, found = rollout(robot, np.zeros((20, 3)), settling_steps=3, record_nodes=False)
    assert found.status == "diverged"
    assert asked == [3, 3]  # the second time as it is asked to be seen


def test_frames_are_told_by_their_time_and_command():
    robot = Robot(HUB, (Mount(PART, Pose(np.eye(3), np.zeros(3)), (0,)),))
    reduced = ReducedRobot(robot, PHYSICS, STEPPER)
    commands = np.stack([np.arange(7.0), np.zeros(7)], axis=1)
    _, seen = reduced.rollout(reduced.initial_state(), commands, record_every=3)
    np.testing.assert_allclose(seen.time_s, PHYSICS.time_step_s * np.array([0, 3, 6, 7]))
    # The command that led to each frame; the first has that which follows.
    np.testing.assert_array_equal(seen.commanded_kPa[:, 0], [0.0, 2.0, 5.0, 6.0])


def test_a_settling_robot_loses_energy():
    """Without pressure, elastic, gravitational and kinetic energy together never grow.

    Velocities are differences of positions over a step: of first order in the turn of a step, some
    0.01 rad, so energies of motion are good to a percent of the largest of them.
    """
    robot = crawlers()[2]
    physics = replace(PHYSICS, damping="objective", floor_height_mm=-25.0)  # it falls first
    simulator = BatchedSimulator([robot], physics, STEPPER, 1)
    node_mass = PART.mass / len(PART.rest_nodes)
    gravity, h = physics.gravity_mm_per_s2, physics.time_step_s
    stored, kinetic, before = [], [], None
    for _ in range(120):
        simulator.advance(np.zeros((1, 2)), 1)
        hub, turn = simulator.read("position")[0], simulator.read("rotation")[0]
        alpha = simulator.read("modes")[0, :, : PART.mode_count]
        world = np.array(
            [
                mount.pose.apply(PART.positions(own)) @ turn.T + hub
                for mount, own in zip(robot.mounts, alpha, strict=True)
            ]
        )
        energy = gravity * (HUB.mass * hub[2] + node_mass * world[..., 2].sum())
        for own in alpha:
            for elements in (PART.tetrahedra, PART.membrane):
                gradient = elements.gradients(own)
                law = law_with_rotation(elements.law, "polar")
                energy += elements.measure @ law.energy(np.moveaxis(gradient, 0, 2))
        now = (hub, world)
        if before is not None:
            speeds = [np.sum(((new - old) / h) ** 2) for new, old in zip(now, before, strict=True)]
            stored.append(energy)
            kinetic.append(0.5 * (HUB.mass * speeds[0] + node_mass * speeds[1]))
        before = now
    total = np.array(stored) + np.array(kinetic)
    assert np.all(np.diff(total) < 0.01 * max(kinetic))
    assert max(kinetic) > 0.3 * (total[0] - total[-1])  # it moved
    assert kinetic[-1] < 1e-4 * max(kinetic)


def test_pressure_moves_no_faster_than_its_rate():
    simulator = BatchedSimulator(crawlers()[:1], PHYSICS, STEPPER, 1)
    expected = np.zeros(2)
    for command in ([40.0, 1.0], [0.0, 30.0]):
        simulator.advance(np.array([command]), 7)
        for _ in range(7):
            expected = rate_limit(expected, np.array(command), 150.0, 0.01)
        assert simulator.read("regulated")[0] == pytest.approx(expected)


def test_single_precision_elements_stay_within_their_rounding():
    single_precision = replace(FRESH, element_precision="single")
    single = march(BatchedSimulator(crawlers(), PHYSICS, single_precision, 1))
    double = march(BatchedSimulator(crawlers(), PHYSICS, FRESH, 1))
    # Float strains of 1e-7 over strains of 1e-2 leave 1e-5 of motions of a few mm, amplified by
    # stick and slip: ten times that.
    assert np.abs(single["position"] - double["position"]).max() < 1e-3
