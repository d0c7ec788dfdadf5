"""A point that sticks stays where it is, however its body turns about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.robot.robot import Hub, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.stepper_settings import Linearised, StepperSettings

LENGTH_MM = 60.0


def drift(linearised: Linearised, time_step_s: float) -> float:
    """How far the foot of a stick that topples about it, from 15 to 40 degrees in 0.14 s, has gone
    along the floor [mm]."""
    foot = np.array([0.0, 0.0, -LENGTH_MM])
    stick = Hub(0.1, np.zeros(3), 0.1 * 400.0 * np.eye(3), np.zeros(3), foot[None])
    physics = Physics(
        time_step_s=time_step_s, mass_damping_per_s=0.0, friction=5.0, floor_height_mm=0.0,
        regulator_count=1,
    )  # fmt: skip
    stepper = StepperSettings(linearised=linearised)
    simulator = BatchedSimulator([Robot(stick, ())], physics, stepper, 1)
    tilted = rotation_about("y", 15.0)
    simulator.set_state(0, replace(simulator.state(0), position=-tilted @ foot, rotation=tilted))
    simulator.advance(np.zeros((1, 1)), round(0.14 / time_step_s))
    end = simulator.state(0)
    assert end.rotation[2, 2] == pytest.approx(np.cos(np.radians(39.5)), abs=0.02)
    return float(np.linalg.norm((end.position + end.rotation @ foot)[:2]))


def test_the_foot_of_a_stick_that_topples_stays_to_second_order() -> None:
    """It sticks, so its way is none. At the start's velocities alone each step leaves h^2 / 2 times
    its acceleration, of first order over all steps; with what the turning adds (48) h^3."""
    usual, ahead = (
        [drift(linearised, step) for step in (0.005, 0.0025)] for linearised in ("start", "ahead")
    )
    assert usual[0] / usual[1] == pytest.approx(2.0, rel=0.1)
    assert ahead[0] / ahead[1] == pytest.approx(4.0, rel=0.1)
    assert ahead[0] < 0.2 * usual[0]
