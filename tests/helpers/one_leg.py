"""A robot of one leg, thrown into the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from helpers.crawlers import PHYSICS, STEPPER
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator

HUB = Hub(0.075, np.array([0.1, -0.2, 0.3]), np.diag([30.0, 20.0, 40.0]), np.zeros(3))
POSE = Pose(rotation_about("z", 35.0) @ rotation_about("y", 15.0), np.array([95.0, 40.0, 8.0]))
COMMAND = np.array([0.0, 20.0])
"""What its regulators are asked for [kPa]."""


def motion_of(
    part: ReducedPart, size: float, speed: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Modal coordinates of a size, their rates, and velocity and turning rate of the hub."""
    generator = np.random.default_rng(0)
    alpha = size * generator.normal(size=part.mode_count) / (1 + np.arange(part.mode_count) // 6)
    rates = speed * generator.normal(size=part.mode_count)
    return alpha, rates, generator.normal(size=6) * [30.0, 30.0, 30.0, 0.5, 0.5, 0.5]


def thrown(
    part: ReducedPart, motion: tuple[np.ndarray, np.ndarray, np.ndarray], **settings: object
) -> BatchedSimulator:
    """A simulator of the robot without a floor, in a motion; its regulators answer at once."""
    numerics = {name: settings.pop(name) for name in [*settings] if hasattr(STEPPER, name)}
    physics = replace(PHYSICS, floor_height_mm=-1e6, pressure_rate_kPa_per_s=1e9, **settings)
    stepper = replace(STEPPER, speed_limit_mm_per_s=1e7, **numerics)
    robot = Robot(HUB, (Mount(part, POSE, (1,)),))
    simulator = BatchedSimulator([robot], physics, stepper, 1)
    alpha, rates, velocity = motion
    padding = (0, simulator.read("modes").shape[-1] - part.mode_count)
    simulator.write(0, "modes", np.pad(alpha, padding))
    simulator.write(0, "mode_rates", np.pad(rates, padding))
    simulator.write(0, "velocity", velocity[:3])
    simulator.write(0, "angular_velocity", velocity[3:])
    return simulator
