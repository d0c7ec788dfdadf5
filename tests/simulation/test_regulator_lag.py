"""What lagging regulators pass on is a matter of their own commands alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import LaggingSimulator, simulator_in_worlds
from pneumorph.simulation.regulator_lag import LAG_STEPS, lagging_commands

STEP_S, LAG_S = 0.01, 0.06


def held(levels: np.ndarray, steps: int) -> np.ndarray:
    return np.repeat(levels, steps, axis=0)


def commands(steps: int, seed: int = 0) -> np.ndarray:
    """Of 120 steps, each level held for so many."""
    levels = np.random.default_rng(seed).uniform(0.0, 90.0, (-(-120 // steps), 3))
    return held(levels, steps)[:120]


def simulator(lags_s: list[float]) -> LaggingSimulator:
    robot = paper_robot("published").assembly(Design.parse("1.0.0.0.2.0.0.0"))
    worlds = [World(1.2, 1.0, 1.0, lag, 0.0) for lag in lags_s]
    physics = Physics(pressure_rate_kPa_per_s=1e9)
    return simulator_in_worlds([robot] * len(lags_s), worlds, physics, thread_count=1)


def passed_on(
    of_robots: list[np.ndarray], lags_s: list[float], looks: range | None = None
) -> np.ndarray:
    """Pressures behind the regulators after each span of steps, (look, robot, regulator): spans end
    where anybody's command changes, and where somebody looks."""
    batch = simulator(lags_s)
    asked = np.stack(of_robots, axis=1)
    changes = np.flatnonzero((asked[1:] != asked[:-1]).any(axis=(1, 2))) + 1
    looks = range(0) if looks is None else looks
    bounds = np.unique([0, *changes, *looks, len(asked)])
    seen = {}
    for begin, end in pairwise(bounds):
        batch.advance(asked[begin], end - begin)
        seen[end] = batch.simulator.read("regulated")
    return np.array([seen[end] for end in [*changes, len(asked)]])


@pytest.mark.parametrize("steps", [1, 3, 7, 10, 33])
def test_it_is_the_same_however_often_somebody_looks_and_for_a_whole_gait(steps: int) -> None:
    """Of commands that change off the grid of five steps as well, to the bit."""
    asked = commands(steps)
    alone = passed_on([asked], [LAG_S])
    np.testing.assert_array_equal(passed_on([asked], [LAG_S], range(1, 120, 4)), alone)
    changes = np.flatnonzero((asked[1:] != asked[:-1]).any(axis=1))
    gait = lagging_commands(asked, LAG_S, STEP_S)[[*changes, len(asked) - 1]]
    np.testing.assert_allclose(alone[:, 0], gait, rtol=1e-12)  # kept as doubles, and rates added


def test_it_is_the_same_beside_others_whose_commands_change_elsewhere() -> None:
    asked, other = commands(10), commands(7, seed=1)
    both = simulator([LAG_S, 0.02])
    alone = simulator([LAG_S])
    for begin in range(120):
        both.advance(np.stack([asked[begin], other[begin]]), 1)
        alone.advance(asked[begin][None], 1)
        np.testing.assert_array_equal(
            both.simulator.read("regulated")[0], alone.simulator.read("regulated")[0]
        )


def test_a_robot_that_does_not_move_keeps_its_lag() -> None:
    asked = commands(10)
    straight, waiting = simulator([LAG_S]), simulator([LAG_S, LAG_S])
    for begin in range(0, 40, 2):
        straight.advance(asked[begin][None], 2)
        waiting.advance(np.stack([asked[begin], asked[begin]]), 2)
        waiting.advance(np.stack([asked[-1 - begin]] * 2), 4, active=np.array([False, True]))
    for each in ("regulated", "position"):
        np.testing.assert_array_equal(
            straight.simulator.read(each)[0], waiting.simulator.read(each)[0], err_msg=each
        )


@pytest.mark.parametrize("steps", [1, 3, LAG_STEPS])
def test_commands_that_do_not_last_come_as_late_as_the_lag(steps: int) -> None:
    """Of a ramp a first-order filter is late by its time constant, once its beginning is over: the
    mean of what is missing is the slope times the lag, and half a level's length, for which a step
    of the ramp is ahead of it."""
    levels = np.arange(400.0)[:, None] / 4.0
    asked = held(levels, steps)
    missing = (asked - lagging_commands(asked, LAG_S, STEP_S))[len(asked) // 2 :]
    slope = 0.25 / (steps * STEP_S)
    assert missing.mean() == pytest.approx(slope * LAG_S, rel=1e-6)


def test_without_a_lag_commands_are_passed_on_as_they_are() -> None:
    asked = commands(3)
    assert lagging_commands(asked, 0.0, STEP_S) is asked
    both = passed_on([asked, asked], [0.0, LAG_S])
    changes = np.flatnonzero((asked[1:] != asked[:-1]).any(axis=1))
    np.testing.assert_array_equal(both[:, 0], asked[[*changes, len(asked) - 1]])
