"""Three small robots, and how they walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from helpers.synthetic_part import synthetic_reduced_part
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.stepper_settings import StepperSettings

PART = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
PHYSICS = Physics(regulator_count=2)
STEPPER = StepperSettings(element_precision="double")
FRESH = replace(STEPPER, tangent_tolerance_mm_per_s=0.0)
"""A fresh stiffness in every step."""
GAIT = np.random.default_rng(3).uniform(0.0, 12.0, (8, 2))
"""Commands of 20 steps each [kPa], (command, regulator)."""


def crawlers() -> list[Robot]:
    """Three different robots, with points that touch the floor."""
    robots = []
    for angles in ([20.0, 140.0, 260.0], [-20.0, -140.0, -260.0], [0.0, 90.0, 180.0, 270.0]):
        mounts = []
        for number, angle in enumerate(angles):
            turn = rotation_about("z", angle)
            pose = Pose(turn @ rotation_about("y", 15.0), turn @ np.array([100.0, 0.0, 9.0]))
            mounts.append(Mount(PART, pose, (number % 2,)))
        robots.append(Robot(Hub(0.075, np.zeros(3), 60.0 * np.eye(3), np.zeros(3)), tuple(mounts)))
    return robots


def march(simulator: BatchedSimulator) -> dict[str, np.ndarray]:
    """Walk all robots by the gait, and return where that took them."""
    for command in GAIT:
        simulator.advance(np.tile(command, (len(simulator.robots), 1)), 20)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    return {name: simulator.read(name) for name in ("position", "rotation", "modes", "impulses")}
