"""Parts of different numbers of modes on one hub."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.stepper_settings import StepperSettings

EIGHT, SIXTEEN = (synthetic_reduced_part(count, (6, 4, 4)) for count in (8, 16))
POSES = [
    Pose(rotation_about("z", yaw), rotation_about("z", yaw) @ np.array([100.0, 0.0, 0.0]))
    for yaw in (0.0, 180.0)
]
# Nothing to touch: contacts are solved to a tolerance, free motion to rounding.
PHYSICS = Physics(regulator_count=2, floor_height_mm=-1e5)
STEPPER = StepperSettings(element_precision="double")
# So heavy that no leg notices the other.
ANCHOR = Hub(1e9, np.zeros(3), 1e12 * np.eye(3), np.zeros(3))
COMMANDS = np.tile([12.0, 20.0], (40, 1))


def bent(parts, hub=ANCHOR):
    mounts = tuple(
        Mount(part, pose, (number,))
        for number, (part, pose) in enumerate(zip(parts, POSES, strict=True))
    )
    robot = ReducedRobot(Robot(hub, mounts), PHYSICS, STEPPER)
    state, trajectory = robot.rollout(
        robot.initial_state(), COMMANDS, record_every=40, record_nodes=False
    )
    assert trajectory.status == "completed"
    return state


def test_legs_of_8_and_16_modes_move_as_each_does_beside_its_like():
    mixed = bent([EIGHT, SIXTEEN])
    eights, sixteens = bent([EIGHT, EIGHT]), bent([SIXTEEN, SIXTEEN])
    assert np.abs(mixed.modes[1]).max() > 1e-3
    # The anchor moves by the legs' 0.1 kg over its 1e9: 1e-10; sums of other lengths round apart.
    for number, alone, count in ((0, eights, 8), (1, sixteens, 16)):
        size = np.abs(alone.modes[number]).max()
        assert np.abs(mixed.modes[number, :count] - alone.modes[number, :count]).max() < 1e-7 * size
    assert np.all(mixed.modes[0, 8:] == 0.0)


def test_the_order_of_unlike_legs_does_not_matter():
    light = Hub(0.075, np.zeros(3), 30.0 * np.eye(3), np.zeros(3))
    mounts = [Mount(EIGHT, POSES[0], (0,)), Mount(SIXTEEN, POSES[1], (1,))]
    states = []
    for order in ((0, 1), (1, 0)):
        robot = ReducedRobot(Robot(light, tuple(mounts[n] for n in order)), PHYSICS, STEPPER)
        state, _ = robot.rollout(robot.initial_state(), COMMANDS, 40, record_nodes=False)
        states.append((state.position, state.modes[list(order)]))
    assert np.abs(states[0][1]).max() > 1e-3
    # Elimination in another order: rounding, over 40 steps.
    assert states[0][0] == pytest.approx(states[1][0], abs=1e-8)
    assert states[0][1] == pytest.approx(states[1][1], abs=1e-8)


@pytest.mark.parametrize("before", [SIXTEEN, EIGHT])
def test_robots_of_before_do_not_change_those_of_after(before):
    """A batch that held other legs, of more modes or of as many, walks those of now to the bits of
    one that never did, and keeps no part of before."""
    light = Hub(0.075, np.zeros(3), 30.0 * np.eye(3), np.zeros(3))

    def robot(part):
        return Robot(light, tuple(Mount(part, pose, (0,)) for pose in POSES))

    def walked(simulator):
        simulator.advance(np.tile([12.0, 20.0], (1, 1)), 40)
        return simulator

    alone = walked(BatchedSimulator([robot(EIGHT)], PHYSICS, STEPPER, 1))
    other = replace(before)
    kept = weakref.ref(other)
    after = BatchedSimulator([robot(other), robot(EIGHT)], PHYSICS, STEPPER, 1)
    del other
    after.set_robots([robot(EIGHT)])
    gc.collect()
    assert kept() is None
    walked(after)
    for name in ("position", "rotation", "modes", "mode_rates"):
        assert np.array_equal(after.read(name), alone.read(name))
    after.set_state(0, alone.state(0))
