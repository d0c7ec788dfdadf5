"""A robot of one leg, and its step by dense numpy linear algebra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from crawlers import SETTINGS

from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation import BatchedSimulator

HUB = Hub(0.075, np.array([0.1, -0.2, 0.3]), np.diag([30.0, 20.0, 40.0]), np.zeros(3))
POSE = Pose(rotation_about("z", 35.0) @ rotation_about("y", 15.0), np.array([95.0, 40.0, 8.0]))
GRAVITY = np.array([0.0, 0.0, -SETTINGS.gravity_mm_per_s2])


def dense_system(part, alpha, velocity, rates, pressure, settings, gravity=GRAVITY):
    """Mass, stiffness and force of a hub with one part, by dense matrices over all nodes.

    Vectors are along the hub's axes.
    """
    rotation = "edge" if settings.damping == "published" else "polar"
    count = part.mode_count
    nodes = POSE.apply(part.positions(alpha))
    jacobian = np.zeros((len(nodes), 3, 6 + count))
    jacobian[:, :, :3] = np.eye(3)
    for axis in range(3):
        jacobian[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    jacobian[:, :, 6:] = np.einsum("ij,nja->nia", POSE.rotation, part.modes)
    flat = jacobian.reshape(-1, 6 + count)
    mass = part.mass / len(nodes) * flat.T @ flat
    mass[:3, :3] += HUB.mass * np.eye(3)
    first = HUB.first_moment
    skew = np.cross(np.eye(3), first).T  # W -> W x first
    mass[:3, 3:6] += skew
    mass[3:6, :3] += skew.T
    mass[3:6, 3:6] += np.trace(HUB.second_moment) * np.eye(3) - HUB.second_moment

    stiffness = np.zeros_like(mass)
    force = np.zeros(6 + count)
    published = settings.damping == "published"
    stiffness[6:, 6:] = part.stiffness(alpha) if published else part.objective_stiffness(alpha)
    force[6:] = part.internal_force(alpha, rotation) + pressure * part.cavity().gradient(alpha)
    if published:
        # Turning the hub about its axes, seen from the part's own frame.
        axes = POSE.rotation.T
        for elements in (part.tetrahedra, part.membrane):
            gradient = elements.gradients(alpha)
            turns = np.stack(
                [np.cross(axes[:, j], gradient, axisb=1, axisc=1) for j in range(3)], 3
            )
            columns = np.concatenate([turns, elements.mode_gradient], axis=3)
            columns = columns.reshape(len(columns), -1, 3 + count)
            block = np.einsum(
                "eia,eij,ejb->ab", columns, elements.published_tangent(gradient), columns
            )
            stiffness[3:6, 3:6] += block[:3, :3]
            stiffness[3:6, 6:] += block[:3, 3:]
            stiffness[6:, 3:6] += block[3:, :3]
            force[3:6] -= np.einsum("eij,eijl->l", elements.stress(gradient), turns)
    force += part.mass / len(nodes) * np.einsum("nia,i->a", jacobian, gravity)
    force[:3] += HUB.mass * gravity
    force[3:6] += np.cross(first, gravity)
    # Coriolis and centrifugal accelerations of every node, and of the hub's own mass.
    turning = velocity[3:]
    swing = np.einsum("nia,a->ni", jacobian[:, :, 6:], rates)
    acceleration = np.cross(turning, np.cross(turning, nodes)) + 2.0 * np.cross(turning, swing)
    force -= part.mass / len(nodes) * np.einsum("nia,ni->a", jacobian, acceleration)
    force[:3] -= np.cross(turning, np.cross(turning, first))
    inertia = np.trace(HUB.second_moment) * np.eye(3) - HUB.second_moment
    force[3:6] -= np.cross(turning, inertia @ turning)
    return mass, stiffness, force


def dense_step(mass, stiffness, force, velocity, rates, settings):
    """New generalised velocities."""
    h = settings.time_step_s
    scale = h * (h + settings.stiffness_damping_s)
    left = (1.0 + settings.mass_damping_per_s * h) * mass + scale * stiffness
    return np.linalg.solve(left, mass @ np.concatenate([velocity, rates]) + h * force)


def state_of(part, size):
    """Modal coordinates, their rates, and velocity and turning rate of the hub."""
    generator = np.random.default_rng(0)
    alpha = size * generator.normal(size=part.mode_count) / (1 + np.arange(part.mode_count) // 6)
    rates = generator.normal(size=part.mode_count)
    return alpha, rates, generator.normal(size=6) * [30.0, 30.0, 30.0, 0.5, 0.5, 0.5]


def falling_robot(part, size, state=None, **settings):
    """A simulator of one robot without a floor, its settings and its state."""
    settings = replace(
        SETTINGS,
        floor_height_mm=-1e6,
        pressure_rate_kPa_per_s=1e9,
        speed_limit_mm_per_s=1e7,
        **settings,
    )
    simulator = BatchedSimulator([Robot(HUB, (Mount(part, POSE, (1,)),))], settings, 1)
    alpha, rates, velocity = state or state_of(part, size)
    padding = (0, simulator.padded_mode_count - part.mode_count)
    simulator.write(0, "modes", np.pad(alpha, padding))
    simulator.write(0, "mode_rates", np.pad(rates, padding))
    simulator.write(0, "velocity", velocity[:3])
    simulator.write(0, "angular_velocity", velocity[3:])
    return simulator, settings, (alpha, rates, velocity)


def velocities(simulator, mode_count, rotation=None):
    """Generalised velocities, along the axes of the hub as `rotation` has them."""
    axes = np.eye(3) if rotation is None else rotation
    return np.concatenate(
        [
            axes.T @ simulator.read("velocity")[0],
            axes.T @ simulator.read("angular_velocity")[0],
            simulator.read("mode_rates")[0, 0, :mode_count],
        ]
    )
