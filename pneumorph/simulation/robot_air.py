"""The regulators of a reduced robot: which chambers each of them feeds."""

from __future__ import annotations

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import Regulators
from pneumorph.robot.robot import Robot


def regulators_of(robot: Robot, physics: Physics) -> Regulators:
    """A robot's regulators with the chambers of its mounted parts.

    Args:
        robot: The robot.
        physics: Its supply of pressure.

    Raises:
        ValueError: A mount names a regulator that does not exist.
    """
    chambers = np.zeros(physics.regulator_count)
    for mount in robot.mounts:
        for regulator in mount.regulators:
            if not 0 <= regulator < physics.regulator_count:
                raise ValueError(
                    f"unknown regulator {regulator}, expected 0 to {physics.regulator_count - 1}"
                )
        np.add.at(chambers, list(mount.regulators), mount.part.cavity_volume)
    return physics.regulators(chambers)
