"""What holds a robot by an invisible hand, by the work that it does when all turns as one."""

import dataclasses

import numpy as np
import pytest
from helpers.small_robot import small_robot

from pneumorph.fem.false_moment import false_moment
from pneumorph.physics.physics import Physics


def turned(damping):
    """False moments of a bent robot that turns at 1 rad/s about each axis, (axis, 3) each."""
    physics = Physics(
        floor_height_mm=-100.0,
        regulator_count=2,
        damping=damping,
        stiffness_damping_s=0.1,
    )
    robot = small_robot(physics)
    state, _ = robot.rollout(robot.initial_state(), np.full((10, 2), 60.0), record_nodes=False)
    centre = robot.tracked_point_mm(state)
    moments, work = [], []
    for axis in np.eye(3):
        spins = tuple(np.cross(axis, x - centre) for x in state.positions)
        spinning = dataclasses.replace(state, velocities=spins)
        moments.append(false_moment(robot, spinning))
        work.append(
            [
                -physics.stiffness_damping_s
                * v.ravel()
                @ part.stiffness(x, physics.rotation)
                @ v.ravel()
                for part, x, v in robot.bodies(spinning)
            ]
        )
    return moments, 1e-3 * np.sum(work, axis=1)


def test_the_damping_moment_does_the_work_of_the_damping():
    """Turning at 1 rad/s about an axis, the power of all nodal forces is the moment about it."""
    moments, power = turned("published")
    found = [moment.damping[axis] for axis, moment in enumerate(moments)]
    assert found == pytest.approx(power, rel=1e-9)
    assert min(np.abs(power)) > 1e-3  # [N mm]: a hand indeed, of a bend of a few degrees


def test_none_is_left_of_a_damping_of_deformation_and_polar_rotations():
    """To rounding of the forces, 1e-16 of stiffnesses of 1e5 mN/mm at arms of 50 mm."""
    usual, _ = turned("published")
    objective, _ = turned("objective")
    for number in range(3):
        assert np.abs(objective[number].damping).max() < 1e-7 * np.abs(usual[0].damping).max()
        assert np.abs(objective[number].elasticity).max() < 1e-7
    assert np.abs(usual[0].elasticity).max() > 1e-3
