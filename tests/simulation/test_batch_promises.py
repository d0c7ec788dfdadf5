"""A robot walks alike in any batch, and minds neither its neighbours' failures nor their rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import GAIT, PHYSICS, STEPPER, crawlers, march

from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout


def test_a_robot_is_the_same_bits_in_any_batch_and_with_any_threads():
    stepper = replace(STEPPER, element_precision="single")
    robots = crawlers()
    together = march(BatchedSimulator(robots * 4, PHYSICS, stepper, thread_count=3))
    for index, robot in enumerate(robots):
        alone = march(BatchedSimulator([robot], PHYSICS, stepper, thread_count=1))
        for name, value in alone.items():
            for copy in range(index, 12, 3):
                same = together[name][copy][: value.shape[1]]
                assert np.array_equal(value[0], same), (name, copy)


def test_rollout_of_one_robot_equals_the_batch():
    robot = crawlers()[2]
    model = ReducedRobot(robot, PHYSICS, STEPPER)
    _, trajectory = rollout(model, np.repeat(GAIT, 20, axis=0), settling_steps=0, record_every=10)
    batch = march(BatchedSimulator([robot], PHYSICS, STEPPER, 1))
    assert np.array_equal(trajectory.hub_position_mm[-1], batch["position"][0])
    assert trajectory.node_positions_mm.shape[:2] == (17, 4)
    assert trajectory.status == "completed"


def test_a_diverging_robot_stops_alone_and_stays_finite():
    robots = crawlers()
    healthy = march(BatchedSimulator(robots, PHYSICS, STEPPER, 2))
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 2)
    simulator.write(1, "velocity", np.array([0.0, 0.0, 1e9]))
    for command in GAIT:
        simulator.advance(np.tile(command, (3, 1)), 20)
    assert simulator.status.tolist() == [0, RobotStatus.DIVERGED, 0]
    assert np.array_equal(simulator.read("position")[[0, 2]], healthy["position"][[0, 2]])
    assert np.all(np.isfinite(simulator.read("modes")))
    simulator.reset(np.array([False, True, False]))
    assert simulator.status[1] == RobotStatus.RUNNING


def test_a_robot_that_failed_goes_on_from_a_state_as_any_other():
    """To the bit, as one that never failed."""
    robots = crawlers()
    sound, failed = (BatchedSimulator(robots, PHYSICS, STEPPER, 1) for _ in range(2))
    sound.advance(np.tile(GAIT[0], (3, 1)), 20)
    failed.write(1, "velocity", np.array([0.0, 0.0, 1e9]))
    failed.advance(np.tile(GAIT[0], (3, 1)), 20)
    assert failed.status[1] == RobotStatus.DIVERGED
    failed.set_state(1, sound.state(1))
    assert failed.status[1] == RobotStatus.RUNNING
    for simulator in (sound, failed):
        simulator.advance(np.tile(GAIT[1], (3, 1)), 20)
    for name in ("position", "rotation", "modes", "impulses"):
        assert np.array_equal(failed.read(name)[1], sound.read(name)[1])


def test_a_refused_state_changes_nothing():
    robots = crawlers()
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 1)
    state = simulator.state(0)
    simulator.advance(np.tile(GAIT[0], (3, 1)), 20)
    simulator.write(1, "velocity", np.array([0.0, 0.0, 1e9]))
    simulator.advance(np.tile(GAIT[0], (3, 1)), 20)
    before = simulator.state(1)
    for wrong in (
        replace(state, position=state.position + 1.0, modes=state.modes[:1]),
        replace(simulator.state(0), position=np.ones(3), memory=b"none of ours"),
    ):
        with pytest.raises(ValueError, match=r"it is of another robot|the state is of another"):
            simulator.set_state(1, wrong)
        assert simulator.status[1] == RobotStatus.DIVERGED
        np.testing.assert_equal(vars(simulator.state(1)), vars(before))


def test_inactive_robots_stand_still():
    simulator = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1)
    simulator.advance(np.full((3, 2), 5.0), 10, active=np.array([True, False, True]))
    assert np.array_equal(simulator.read("position")[1], np.zeros(3))
    assert np.all(simulator.read("step_count") == [10, 0, 10])


def test_times_are_taken_where_they_are_asked_for_alone():
    simulator = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1)
    commands = np.zeros((len(crawlers()), PHYSICS.regulator_count))
    simulator.advance(commands, 2)
    assert sum(simulator.stage_seconds.values()) == 0.0
    simulator.advance(commands, 2, profile=True)
    assert sum(simulator.stage_seconds.values()) > 0.0
