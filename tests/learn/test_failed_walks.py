"""A failed walk raises no score, whatever the rewards: penalties make a short walk cheap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.toy_coopt import SPACE, TASK, TIME_STEP_S, CrawlersInWorlds, toy_settings

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.reward import RewardWeights
from pneumorph.environment.reward_term import RewardTerm
from pneumorph.environment.training_environment import TaskWrapper
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.learn.environments import crawling
from pneumorph.learn.evaluation import InWorlds, walk_batch, walk_in_worlds
from pneumorph.learn.failed_walks import failing_reward_cm, with_failed, with_lost
from pneumorph.learn.objective import Objective
from pneumorph.learn.random_search import RandomSearch, RandomSearchSettings
from pneumorph.learn.round_scores import RoundScores
from pneumorph.learn.search_run import run_search
from pneumorph.learn.training import Training
from pneumorph.learn.transitions import Transitions
from pneumorph.robot.design import Design

BAD = 7
PENALISED = replace(TASK, reward=RewardWeights(pressure_change=0.5))
FOUR = Objective(worlds_per_design=4, evaluation_worlds=8)


class Fragile(CrawlersInWorlds):
    """A design diverges at once, in all worlds but the first."""

    def set_robots(self, robots: Sequence[Design]) -> None:
        super().set_robots(robots)
        worlds = np.arange(len(robots)) % 4
        self._bad = np.array([robot == SPACE[BAD] for robot in robots]) & (worlds > 0)

    def advance(self, command_kPa: Any, step_count: int, active: Any = None) -> None:
        super().advance(command_kPa, step_count, active)
        if step_count > 1:  # after settling
            self._status[self._bad] = 1


def fragile(count: int = 80) -> CrawlingEnvironment:
    designs = [SPACE[place % len(SPACE)] for place in range(count)]
    return CrawlingEnvironment(designs, viscous_crawler_robot, Fragile, PENALISED)


def test_a_failed_walk_counts_no_more_than_its_designs_others() -> None:
    values = np.array([[-5.0, 0.0, -6.0], [3.0, 8.0, 2.0], [4.0, -7.0, 3.0], [-2.0, 1.0, 0.0]])
    failed = np.array([[0, 1, 0], [0, 1, 0], [0, 1, 0], [1, 1, 1]], dtype=bool)
    expected = [[-5.0, -6.0, -6.0], [3.0, 0.0, 2.0], [4.0, -7.0, 3.0], [-2.0, 0.0, 0.0]]
    np.testing.assert_array_equal(with_failed(values, failed), expected)
    np.testing.assert_array_equal(with_failed(values, np.zeros_like(failed)), values)


def test_a_design_lost_everywhere_scores_no_more_than_any_other() -> None:
    lost = np.array([False, True, False])
    np.testing.assert_array_equal(with_lost(np.array([-5.0, 0.0, -3.0]), lost), [-5.0, -5.0, -3.0])
    np.testing.assert_array_equal(with_lost(np.array([5.0, 2.0, 3.0]), lost), [5.0, 0.0, 3.0])
    np.testing.assert_array_equal(with_lost(np.array([5.0, -9.0, 3.0]), lost), [5.0, -9.0, 3.0])
    every = np.ones(3, dtype=bool)
    np.testing.assert_array_equal(with_lost(np.array([5.0, -9.0, 0.0]), every), [0.0, -9.0, 0.0])


@pytest.mark.parametrize("worlds", [1, 4])
def test_a_rounds_failed_design_is_not_the_best_where_rewards_are_penalties(worlds: int) -> None:
    scores = RoundScores(Objective(worlds_per_design=worlds), None)
    returns = np.array([[-5.0] * worlds, [-3.0] * worlds, [0.0] * worlds])
    failed = np.array([[0] * worlds, [0] * worlds, [1] * worlds], dtype=bool)
    found = scores.of(np.arange(3), returns.ravel(), failed.ravel())
    np.testing.assert_array_equal(found.scores_cm, [-5.0, -3.0, -5.0])
    positive = scores.of(np.arange(3), -returns.ravel(), failed.ravel())
    np.testing.assert_array_equal(positive.scores_cm, [5.0, 3.0, 0.0])


def test_an_evaluation_counts_worlds_where_a_robot_failed_like_its_worst() -> None:
    """The design came to the end of its walk in the first world of each round alone."""
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (TASK.action_count, TASK.regulator_count))
    steps = iter([*actions, *actions])

    def act(observation: np.ndarray) -> np.ndarray:
        return np.tile(next(steps), (len(observation), 1))

    walked = walk_in_worlds(fragile(8), SPACE, np.array([BAD, 3]), act, FOUR, [1, 2])
    sound = ~walked.failed[0]
    assert sound.tolist() == [True, False, False, False] * 2
    assert not walked.failed[1].any()
    assert (walked.return_cm[0, sound] < 0.0).all()
    np.testing.assert_array_equal(walked.return_cm[0, ~sound], walked.return_cm[0, sound].min())


@pytest.mark.parametrize("seeds", [[1, 2], [2, 1]])
def test_worlds_that_do_not_count_say_nothing_of_one_that_failed(seeds: list[int]) -> None:
    """Whole rounds walk; of the last one only some worlds may count."""
    action = np.random.default_rng(0).uniform(-1.0, 1.0, (TASK.action_count, TASK.regulator_count))

    def walked(seeds: list[int]) -> InWorlds:
        steps = cycle(action)
        act = lambda observation: np.tile(next(steps), (len(observation), 1))  # noqa: E731
        return walk_in_worlds(fragile(8), SPACE, np.array([BAD, 3]), act, FOUR, seeds, None, 4)

    some, alone = walked(seeds), walked(seeds[:1])
    for name, values in vars(some).items():
        np.testing.assert_array_equal(values, getattr(alone, name))


def test_a_search_does_not_find_a_robot_that_fails(tmp_path: Path) -> None:
    """All gaits cost more than they gain; the design that failed was the best of all for that."""
    found = run_search(
        RandomSearch(SPACE, PENALISED, RandomSearchSettings(population=60), seed=0),
        fragile(),
        SPACE,
        2 * 60 * 4 * TASK.action_count,
        tmp_path,
        objective=FOUR,
    )
    ranked = found.ranked(SPACE)
    assert ranked[0].score_cm < 0.0
    # A quarter of what the others lose where only one world of four counted.
    (bad,) = [pair for pair in ranked if pair.design == BAD]
    assert bad.score_cm < ranked[0].score_cm


class Unknown(TaskWrapper):
    """The fourth robot's reward is no number."""

    def step(self, actions: np.ndarray) -> Any:
        observation, reward, *rest = self.env.step(actions)
        reward = reward.copy()
        reward[3] = np.nan
        return observation, reward, *rest


def test_a_reward_that_is_no_number_is_refused() -> None:
    environment = Unknown(fragile(8))
    act = lambda observation: np.zeros((len(observation), 2))  # noqa: E731
    with pytest.raises(
        ValueError, match=r"^reward of action 1 of Unknown is nan for robot 3, expected finite"
    ):
        walk_batch(environment, SPACE, np.arange(8), act, 0)


def test_the_reward_of_a_failed_robot_may_be_none() -> None:
    """It counts for nothing."""

    class Lost(Unknown):
        def step(self, actions: np.ndarray) -> Any:
            *told, info = super().step(actions)
            info["status"] = info["status"].copy()
            info["status"][3] = 1
            return *told, info

    act = lambda observation: np.zeros((len(observation), 2))  # noqa: E731
    pairs = walk_batch(Lost(fragile(8)), SPACE, np.array([0, 1, 2, 3]), act, 0)
    assert [pair.design for pair in pairs] == [0, 1, 2]


def test_a_failure_costs_twice_the_mean_cost_for_ever() -> None:
    rewards = np.array([-3.0, -2.0, 2.0])
    assert failing_reward_cm(rewards, 0.95, 16) == pytest.approx(-2.0 * 20.0)
    assert failing_reward_cm(rewards, 0.0, 16) == -2.0
    assert failing_reward_cm(rewards, 1.0, 16) == -2.0 * 16
    assert failing_reward_cm(rewards + 1.0, 0.95, 16) == 0.0  # actions gain
    assert failing_reward_cm(rewards[:0], 0.95, 16) == 0.0


class Breaks(ViscousCrawler):
    """Fails where regulator 1 is commanded above 85 kPa."""

    def __init__(self, robots: Sequence[Design]) -> None:
        super().__init__(robots, TIME_STEP_S)

    def advance(self, command_kPa: Any, step_count: int, active: Any = None) -> None:
        super().advance(command_kPa, step_count, active)
        self._status[np.asarray(command_kPa)[:, 0] > 85.0] = 1


class Penalised(TaskWrapper):
    """Each action costs a centimetre, more than any gains."""

    terms = (RewardTerm("each", "actions", -1.0, lambda motion: np.ones(len(motion.failed))),)


def breaking(penalised: bool) -> Training:
    """Actions are drawn in the first two rounds, of which each fails with a chance of 1 in 18."""
    settings = replace(toy_settings(7), learning_start_timestep=2 * 16 * TASK.action_count)
    usual = crawling(viscous_crawler_robot, Breaks, settings)
    return Training((lambda robots: Penalised(usual(robots))) if penalised else usual, settings)


@pytest.mark.parametrize("penalised", [False, True])
def test_what_is_stored_of_a_failure_is_told_by_what_did_not_fail(penalised: bool) -> None:
    """Of the robots and of their images, from what was stored before and in the same step."""
    training = breaking(penalised)
    failed_count = training.run_round()["failed_count"]
    kept = training.learned.buffer.arrays()
    rewards, terminal = (
        kept[name].reshape(TASK.action_count, 2 * 16) for name in ("reward", "terminal")
    )
    assert terminal[:-1].sum() > 10 < 2 * failed_count
    np.testing.assert_array_equal(terminal[:, :16], terminal[:, 16:])
    for number in range(TASK.action_count - 1):  # the last one ends all episodes
        seen = rewards[: number + 1][terminal[: number + 1] == 0.0]
        told = 2.0 * min(0.0, seen.mean(dtype=float)) / (1.0 - 0.95)
        found = rewards[number][terminal[number] == 1.0]
        np.testing.assert_allclose(found, told, rtol=1e-5, atol=1e-5)
        assert not penalised or (found < -20.0).all()


def test_a_policy_learns_not_to_fail_where_all_actions_cost() -> None:
    """Where a failure was worth 0, and all that follows less, all robots failed in the last three
    rounds."""
    training = breaking(penalised=True)
    failures = [training.run_round()["failed_count"] for _ in range(7)]
    assert min(failures[:2]) >= 4  # of 16
    assert max(failures[-3:]) <= 2


def test_less_that_a_task_gives_for_a_failure_stays() -> None:
    seen = Transitions(*np.zeros((6, 4, 1), dtype=np.float32))
    seen = replace(seen, reward=np.array([3.0, -50.0, 0.0, 1.0]), terminal=np.zeros(4, dtype=bool))
    failed = np.array([False, True, True, False])
    for reward_cm, wanted in ((0.0, [3.0, -50.0, 0.0, 1.0]), (-60.0, [3.0, -60.0, -60.0, 1.0])):
        found = seen.failing(failed, reward_cm)
        np.testing.assert_array_equal(found.reward, wanted)
        np.testing.assert_array_equal(found.terminal, failed)
