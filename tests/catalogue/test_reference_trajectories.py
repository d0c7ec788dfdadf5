"""The full-order leg and robots beside an independent simulator (SOFA 25.06), numbers only.

Its meshes are others than ours, so every tolerance is the spread that meshing alone causes here:
measured over the shipped mesh and meshes of the same element size by netgen and gmsh with
reproduce/reference/compare.py and bend.py, and rounded up.
"""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.full_robot import FullRobot, FullRobotState
from pneumorph.fem.static import StaticSettings, static_equilibrium

REFERENCE_BEND_DEG = {20.0: 8.2107, 80.0: 31.8922}
"""Turn of the free end face by simulated pressure [kPa]; the other end face is held."""
REFERENCE_POINT_MM = np.array([0.63, -1.87, 44.92])
"""Where the reference's path is measured, in the robot's frame at rest."""
SETTLED_BASELINE = (16.4603, 0.0028, 0.0070)
"""Height [mm], pitch and roll [degrees] of the baseline's four legs after 15 steps at rest."""
TWO_LEG = {
    0.0: (10.4289, -2.3973, 5.8229),
    0.2: (11.0818, -4.2603, 5.7798),
    0.3: (12.5099, -6.4761, 6.0614),
}
"""The same by time [s], two legs and the disk's rim on the floor, regulator 1 called to 90 kPa."""


def pose(robot: FullRobot, state: FullRobotState) -> np.ndarray:
    """Height of the reference's point [mm], pitch and roll [degrees], (3,)."""
    rotation, position = robot.hub.frame(state.hub)
    height = (position + rotation @ REFERENCE_POINT_MM)[2]
    pitch = -np.degrees(np.arcsin(rotation[2, 0]))
    roll = np.degrees(np.arctan2(rotation[2, 1], rotation[2, 2]))
    return np.array([height, pitch, roll])


def test_bend_of_a_held_leg():
    leg = module_of_leg("published").full
    held = leg.mesh.node_set("inner_end_face")
    x, reached = leg.rest_nodes, 0.0
    settings = StaticSettings(load_step_kPa=30.0, tolerance=1e-6)
    for pressure, reference in REFERENCE_BEND_DEG.items():
        found = static_equilibrium(
            leg, pressure, held, start=x, start_pressure_kPa=reached, settings=settings
        )
        assert found.converged
        x, reached = found.positions, pressure
        # The shipped mesh is 2.7 to 2.9 % low; like meshes by netgen and gmsh lie at -3.3 to 0.3.
        assert end_face_bend_deg(leg.mesh, x) == pytest.approx(reference, rel=0.035)


def test_settled_pose_of_the_baseline():
    robot = paper_robot("published").full("1.0.0.2.2.0.0.1")
    height, pitch, roll = pose(robot, robot.settled_state()) - SETTLED_BASELINE
    assert abs(height) < 0.3  # shipped mesh -0.11, gmsh -0.04; half the viscosity costs 0.4 mm
    assert np.hypot(pitch, roll) < 0.1  # its meshes are not mirror symmetric: 0.01 degrees


def test_two_legs_lift_the_robot_as_the_reference_does():
    """Pressure, regulators' rate, viscosity, friction and the disk's rim all take part.

    Legs of other meshes and a disk of 16 corners instead of 20 change height, pitch and roll by up
    to 0.1 mm, 0.2 and 0.1 degrees here; half the viscosity changes them by 0.4 mm and 0.5 degrees.
    """
    robot = paper_robot("published").full("1.0.2.0.0.0.0.0")
    state = robot.settled_state()
    command = np.array([90.0, 0.0, 0.0])
    for step in range(31):
        time_s = round(0.01 * step, 2)
        if time_s in TWO_LEG:
            height, pitch, roll = pose(robot, state) - TWO_LEG[time_s]
            assert abs(height) < 0.3, time_s
            assert abs(pitch) < 0.4, time_s
            assert abs(roll) < 0.3, time_s
        state = robot.step(state, command)
