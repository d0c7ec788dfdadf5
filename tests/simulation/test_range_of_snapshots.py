"""Robots note how far their legs went beyond the snapshots, and walk on as before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import GAIT, PART, PHYSICS, STEPPER, crawlers, march

from pneumorph.reduction.snapshot_range import RANGE_TOLERANCE, snapshot_range
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import scaled_robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout


def reached(robots: list[Robot], factor: float = 1.0) -> np.ndarray:
    """Every leg's modes after every step of the gait, (step, leg, mode)."""
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 1)
    seen = []
    for command in factor * GAIT:
        for _ in range(20):
            simulator.advance(np.tile(command, (len(robots), 1)), 1)
            seen.append(simulator.read("modes")[:, :, : PART.mode_count])
    return np.array(seen)


def knowing(robots: list[Robot], rows: np.ndarray) -> list[Robot]:
    """The robots with legs that know their range."""
    part = replace(PART, snapshot_range=rows)
    return [
        replace(each, mounts=tuple(replace(mount, part=part) for mount in each.mounts))
        for each in robots
    ]


@pytest.fixture(scope="module")
def seen() -> np.ndarray:
    return reached(crawlers())


@pytest.fixture(scope="module")
def rows(seen: np.ndarray) -> np.ndarray:
    return snapshot_range(seen.reshape(-1, PART.mode_count))


def test_the_largest_ratio_is_that_of_the_furthest_step_and_changes_no_bit(seen, rows):
    robots = knowing(crawlers(), rows)
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 2)
    walked = march(simulator)
    plain = march(BatchedSimulator(crawlers(), PHYSICS, STEPPER, 2))
    for name, value in plain.items():
        assert np.array_equal(value, walked[name]), name
    part = robots[0].mounts[0].part
    each = part.range_ratio(seen).max(axis=(0, 2))
    # Sums of six products in another order.
    np.testing.assert_allclose(simulator.range_ratio, each, rtol=1e-13)
    assert simulator.range_ratio.max() == pytest.approx(1.0, rel=1e-13)
    for index, robot in enumerate(robots):
        alone = BatchedSimulator([robot], PHYSICS, STEPPER, 1)
        march(alone)
        assert alone.range_ratio[0] == simulator.range_ratio[index]


def test_a_robot_driven_beyond_is_noted_and_walks_on(rows):
    robots = knowing(crawlers(), rows)
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 1)
    for command in 2.0 * GAIT:
        simulator.advance(np.tile(command, (3, 1)), 20)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    assert np.all(simulator.range_ratio > RANGE_TOLERANCE)
    simulator.reset(np.array([True, False, False]))
    assert simulator.range_ratio[0] == 0.0
    assert np.all(simulator.range_ratio[1:] > RANGE_TOLERANCE)


def test_a_range_is_forgotten_and_begins_afresh(rows):
    """Of chosen robots, without a bit of their way."""
    robots = knowing(crawlers(), rows)
    simulator, plain = (BatchedSimulator(robots, PHYSICS, STEPPER, 1) for _ in range(2))
    part = robots[0].mounts[0].part
    for each in (simulator, plain):
        march(each)
    reached = simulator.range_ratio
    simulator.forget_range(np.array([True, False, False]))
    assert simulator.range_ratio[0] == 0.0
    np.testing.assert_array_equal(simulator.range_ratio[1:], reached[1:])
    for each in (simulator, plain):
        each.advance(np.zeros((3, GAIT.shape[1])), 1)
    modes = simulator.read("modes")
    assert np.array_equal(modes, plain.read("modes"))
    ratio = part.range_ratio(modes[0, :, : PART.mode_count]).max()
    assert simulator.range_ratio[0] == pytest.approx(ratio, rel=1e-13)
    assert 0.0 < ratio < reached[0]
    simulator.forget_range()
    assert np.all(simulator.range_ratio == 0.0)


def test_scaled_legs_keep_their_range(rows):
    """All moduli, masses and pressures doubled is the same path, so the same ratio."""
    robots = knowing(crawlers(), rows)[:1]
    heavy = [scaled_robot(robots[0], modulus_factor=2.0, mass_factor=2.0)]
    pressing = replace(
        PHYSICS.pressure_map,
        slope=2.0 * PHYSICS.pressure_map.slope,
        intercept_kPa=2.0 * PHYSICS.pressure_map.intercept_kPa,
    )
    once = BatchedSimulator(robots, PHYSICS, STEPPER, 1)
    twice = BatchedSimulator(heavy, replace(PHYSICS, pressure_map=pressing), STEPPER, 1)
    march(once)
    march(twice)
    # A power of two rounds nothing but square roots; friction stops at its tolerance of 0.01 mm/s.
    assert twice.range_ratio[0] == pytest.approx(once.range_ratio[0], rel=1e-3)
    # With its coordinates taken for those of the lighter leg it would be sqrt(2) times as far.
    assert once.range_ratio[0] > 0.1


def test_a_robot_whose_legs_do_not_know_is_not_flagged(rows):
    robots = [crawlers()[0], knowing(crawlers(), rows)[0]]
    simulator = BatchedSimulator(robots, PHYSICS, STEPPER, 1)
    march(simulator)
    assert np.isnan(simulator.range_ratio[0])
    assert simulator.range_ratio[1] > 0.0


def test_a_rollout_tells_how_far_it_went(rows):
    commands = np.repeat(GAIT, 20, axis=0)
    for factor, left in ((1.0, False), (2.0, True)):
        robot = knowing(crawlers(), rows)[2]
        _, trajectory = rollout(
            ReducedRobot(robot, PHYSICS, STEPPER), factor * commands, settling_steps=0
        )
        assert trajectory.status == "completed"
        assert (trajectory.metadata["range_ratio"] > RANGE_TOLERANCE) is left
    _, trajectory = rollout(
        ReducedRobot(crawlers()[2], PHYSICS, STEPPER), commands, settling_steps=0
    )
    assert trajectory.metadata["range_ratio"] is None
