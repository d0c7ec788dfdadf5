"""The path of a robot's marker under measured pressures, for parameters that are to be fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.parameter_fit import Parameters
from pneumorph.physics.calibration import Calibration
from pneumorph.robot.design import Design
from pneumorph.robot.scaled_part import scaled_robot
from pneumorph.simulation.reduced_robot import ReducedRobot


def path_simulator(
    plain: RobotSpec, design: Design, calibration: Calibration
) -> Callable[[Parameters, np.ndarray], np.ndarray]:
    """Return a function that simulates a design under sensed pressures with given parameters.

    It takes the parameters (``modulus_factor``, ``friction``, ``stiffness_damping_s``) and the real
    pressures of every time step [kPa], (step, regulator), and returns the marker's x and y [mm],
    (step + 1, 2): NaN from where the simulation failed.

    Args:
        plain: The robot as nobody has calibrated it.
        design: Its design.
        calibration: What is known of it already.
    """
    nominal = plain.assembly(design)
    # The sensed pressure is what there was.
    known = calibration.applied_to(plain.physics).following_at_once()

    # Paths must change with the parameters as smoothly as they can.
    smooth = replace(plain.stepper, tangent_tolerance_mm_per_s=0.0)

    def simulate(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
        physics = replace(
            known,
            friction=values["friction"],
            stiffness_damping_s=values["stiffness_damping_s"],
        )
        robot = ReducedRobot(scaled_robot(nominal, values["modulus_factor"]), physics, smooth)
        rest = np.zeros((15, physics.regulator_count))
        places = np.full((len(driven_kPa) + 1, 2), np.nan)
        state, settled = robot.rollout(robot.initial_state(), rest, len(rest), False)
        if settled.status != "completed":
            return places
        _, trajectory = robot.rollout(state, driven_kPa, 1, False)
        places[: len(trajectory.time_s)] = trajectory.tracked_point_mm[:, :2]
        return places

    return simulate
