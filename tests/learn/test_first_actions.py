"""What robots do before learning starts."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.toy_coopt import TASK, make_simulator, toy_settings

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.environments import crawling
from pneumorph.learn.first_actions import CYCLE_LENGTHS, random_cycles
from pneumorph.learn.training import Training


def test_each_robot_repeats_a_cycle_of_its_own() -> None:
    actions = random_cycles(200, 20, 3, np.random.default_rng(0))
    assert actions.shape == (20, 200, 3)
    assert set(np.unique(actions)) == {-1.0, 1.0}
    for robot in range(200):
        gait = actions[:, robot]
        assert any(np.array_equal(gait[n:], gait[:-n]) for n in CYCLE_LENGTHS)
    # All of a kind would tell little: 2^(3 n) cycles of n actions, the shortest 512.
    assert len({actions[:, robot].tobytes() for robot in range(200)}) > 150


@pytest.mark.parametrize("first_actions", ["uniform", "cycles"])
def test_robots_repeat_cycles_until_learning_starts(first_actions: str) -> None:
    """Two rounds; then the policy acts, whose actions are never the extremes themselves."""
    settings = replace(toy_settings(4), first_actions=first_actions)
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    for number in range(3):
        training.run_round()
        stored = training.buffer.arrays()["action"][-settings.environment_count :]
        extreme = np.abs(stored) == 1.0
        if first_actions == "cycles" and number < 2:
            assert extreme.all()
        else:
            assert extreme.mean() < 0.1


def test_a_resumed_training_repeats_the_same_cycles() -> None:
    settings = replace(toy_settings(4), first_actions="cycles")
    straight, stopped, resumed = (
        Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
        for _ in range(3)
    )
    straight.run_round()
    straight.run_round()
    stopped.run_round()
    resumed.restore(stopped.arrays(), stopped.metadata())
    resumed.run_round()
    count = 2 * settings.environment_count * TASK.action_count
    ours, theirs = (each.buffer.arrays()["action"][:count] for each in (resumed, straight))
    assert np.array_equal(ours, theirs)
