"""The regulators of a reduced robot: which chambers each of them feeds."""

from __future__ import annotations

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import Regulators
from pneumorph.robot.robot import Robot


def chambers_of(robot: Robot, regulator_count: int) -> np.ndarray:
    """Volume of all chambers of each regulator without pressure [mm^3], (regulator,).

    Args:
        robot: The robot.
        regulator_count: How many regulators there are.

    Raises:
        ValueError: A mount names a regulator that does not exist.
    """
    chambers = np.zeros(regulator_count)
    for mount in robot.mounts:
        for regulator in mount.regulators:
            if not 0 <= regulator < regulator_count:
                raise ValueError(
                    f"unknown regulator {regulator + 1}, expected 1 to {regulator_count}"
                )
        np.add.at(chambers, list(mount.regulators), mount.part.cavity_volume)
    return chambers


def regulators_of(robot: Robot, physics: Physics) -> Regulators:
    """A robot's regulators with the chambers of its mounted parts; raises as `chambers_of`.

    Args:
        robot: The robot.
        physics: Its supply of pressure.
    """
    return physics.regulators(chambers_of(robot, physics.regulator_count))
