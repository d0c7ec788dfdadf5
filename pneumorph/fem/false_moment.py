"""The moment that internal forces exert on a whole robot, which should be none.

Rayleigh damping by a stiffness without geometric part resists turning a stressed leg as a whole,
and edge-based element rotations leave the elastic forces a resultant moment. Both act as if a hand
held the robot; under objective damping and polar rotations both vanish.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.body_equations import damped_stiffness_data
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState


@dataclass(frozen=True, eq=False)
class FalseMoment:
    """Resultant moments about a point, world axes [N mm]."""

    damping: np.ndarray
    """Of the stiffness damping, (3,)."""
    elasticity: np.ndarray
    """Of the elastic forces, (3,)."""


def false_moment(robot: FullRobot, state: FullRobotState) -> FalseMoment:
    """Moments of a robot's internal forces about its tracked point.

    Args:
        robot: The robot; a rigid hub has no internal forces.
        state: Where it is.
    """
    physics, centre = robot.physics, robot.tracked_point_mm(state)
    damping, elasticity = np.zeros((2, 3))
    for part, x, v in robot.bodies(state):
        arm = x - centre
        damped = part.assembly.matrix(damped_stiffness_data(part, x, physics))
        resistance = -physics.stiffness_damping_s * (damped @ v.ravel())
        # mN mm to N mm
        damping += 1e-3 * np.cross(arm, resistance.reshape(-1, 3)).sum(axis=0)
        force = part.internal_force(x, physics.rotation)
        elasticity += 1e-3 * np.cross(arm, force).sum(axis=0)
    return FalseMoment(damping, elasticity)
