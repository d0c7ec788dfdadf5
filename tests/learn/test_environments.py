"""Environments of one's own: what a training asks of them, and what it makes of what they tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from helpers.toy_coopt import SPACE, TASK, make_simulator, toy_settings

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.training_environment import TaskWrapper, TrainingEnvironment
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design


class FollowTheClock(VectorEnv):
    """Nothing crawls: hold the first regulator at the share of the episode that has passed, as many
    times as the design has legs. The state is that share alone."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 -- as Gymnasium has it
    task = TASK
    is_symmetric = True

    def __init__(self, designs: Sequence[Design], state_size: int = 1) -> None:
        self.num_envs = len(designs)
        size = state_size + SPACE.feature_count
        self.single_observation_space = Box(0.0, 1.0, (size,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (TASK.regulator_count,), np.float32)
        self._designs, self._passed = list(designs), 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        self._designs, self._passed = (options or {}).get("designs", self._designs), 0
        return self._observation(), {}

    def step(self, actions: np.ndarray) -> Any:
        share = self._passed / TASK.action_count
        legs = np.array([np.count_nonzero(design.assignment) for design in self._designs])
        reward = -legs * np.abs(actions[:, 0] - share)
        self._passed += 1
        over = np.full(self.num_envs, self._passed == TASK.action_count)
        last = self._observation()
        self._passed %= TASK.action_count
        info = {"final_obs": list(last), "_final_obs": over} if over.any() else {}
        return self._observation(), reward, over, np.zeros_like(over), info

    def _observation(self) -> np.ndarray:
        share = np.full((self.num_envs, 1), self._passed / TASK.action_count, np.float32)
        designs = np.stack([design.one_hot(SPACE.regulator_count) for design in self._designs])
        return np.concatenate([share, designs], axis=1)


def settings_of(rounds: int, **changes: Any) -> CooptSettings:
    toy = replace(toy_settings(rounds), mirror_transitions=False, evaluated_design_count=16)
    return replace(toy, **changes)


def test_a_task_that_is_no_crawling_is_learned(tmp_path: Path) -> None:
    """Random actions miss by half or more on average; the state tells what to do, and designs of
    two legs lose less than those of three."""
    settings = settings_of(24)
    result = learn_in_folder(FollowTheClock, settings, tmp_path)
    best = result.pairs[0]
    legs = np.count_nonzero(Design.parse(best.design).assignment)
    assert legs == 2
    # Of a uniform action a, |a - share| is (1 + share^2) / 2 on average, so 0.5 at least.
    assert best.score_cm == best.distance_cm  # nothing else is told
    assert best.score_cm > -0.5 * 0.5 * legs * TASK.action_count
    # Pressures of the gait are those of the actions that were rewarded so.
    gait, _ = read_gait(tmp_path / best.gait, TASK.minimum_pressure_kPa, TASK.maximum_pressure_kPa)
    share = np.arange(TASK.action_count) / TASK.action_count
    missed = np.abs(TASK.action(gait.held_kPa)[:, 0] - share).sum()
    # Gait files have 1e-6 kPa of 90, and JAX's actions are in single precision.
    assert -legs * missed == pytest.approx(best.score_cm, abs=1e-3)
    policy, _, _ = load_policy(tmp_path / "policy.npz")
    assert policy.network.layers[0].weight.shape[1] == 1 + SPACE.feature_count


class Halved(TaskWrapper):
    """Half the reward for everyone."""

    def step(self, actions: np.ndarray) -> Any:
        observation, reward, *rest = self.env.step(actions)
        return observation, 0.5 * reward, *rest


def test_a_wrapped_environment_has_its_own_reward_and_the_robots_distance() -> None:
    settings = settings_of(1, mirror_transitions=True)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)

    def halved(designs: Sequence[Design]) -> TrainingEnvironment:
        return Halved(usual(designs))

    rounds = []
    for make in (usual, halved):
        training = Training(make, settings)
        training.run_round()
        rounds.append((training.learned.buffer.arrays()["reward"], training.best.pairs))
    (plain, pairs), (half, ranked) = rounds
    assert np.abs(plain).max() > 0.1
    np.testing.assert_allclose(half, 0.5 * plain, rtol=1e-6)  # float32; mirror images as well
    for before, after in zip(pairs, ranked, strict=True):
        assert after.score_cm == pytest.approx(0.5 * before.score_cm)
        assert after.distance_cm == pytest.approx(before.distance_cm)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda env: setattr(env, "num_envs", 3),
            r"has 3 robots, expected 16, .* \(environment_count is 16\)",
        ),
        (lambda env: setattr(env, "task", replace(TASK, action_count=9)), "the task of Follow"),
        (
            lambda env: setattr(env, "single_action_space", Box(-1, 1, (3,))),
            r"actions of shape \(3,\), expected \(2,\)",
        ),
        (
            lambda env: setattr(env, "single_observation_space", Box(-1, 1, (5,))),
            r"observations of shape \(5,\), expected a state and then the 12 numbers",
        ),
    ],
)
def test_an_environment_that_does_not_fit_is_refused(change: Any, message: str) -> None:
    def make(designs: Sequence[Design]) -> FollowTheClock:
        environment = FollowTheClock(designs)
        change(environment)
        return environment

    with pytest.raises(ValueError, match=message):
        Training(make, settings_of(1))


class Clocked(TaskWrapper):
    """The share of the episode that has passed in front of what the package's robots observe, in
    the places that were named alone."""

    def __init__(self, environment: TrainingEnvironment, *places: str) -> None:
        super().__init__(environment)
        self._places, self._passed = places, 0
        size = environment.single_observation_space.shape[0] + 1  # type: ignore[index]
        self.single_observation_space = Box(-1.0, 1.0, (size,), np.float32)

    def reset(self, **settings: Any) -> Any:
        observation, info = self.env.reset(**settings)
        self._passed = 0
        return self._with("reset", observation), info

    def step(self, actions: np.ndarray) -> Any:
        observation, reward, terminated, truncated, info = self.env.step(actions)
        self._passed += 1
        for robot in np.flatnonzero(info.get("_final_obs", [])):
            last = info["final_obs"][robot]
            info["final_obs"][robot] = self._with("final_obs", last[None])[0]
        if "reward" not in self._places:
            reward = float(np.sum(reward))
        return self._with("step", observation), reward, terminated, truncated, info

    def _with(self, place: str, observation: np.ndarray) -> np.ndarray:
        share = np.full((len(observation), 1), self._passed / TASK.action_count, np.float32)
        return np.hstack([share, observation]) if place in self._places else observation


@pytest.mark.parametrize(
    ("forgotten", "message"),
    [
        ("reset", r"observation of reset of Clocked has shape \(16, (\d+)\), expected \(16, "),
        ("step", r"observation of Clocked has shape"),
        ("final_obs", r'info\["final_obs"\] of a robot of Clocked has shape'),
        ("reward", r"reward of Clocked has shape \(\), expected \(16,\): a row for each robot"),
        (None, None),
    ],
)
def test_observations_of_ones_own_are_the_same_everywhere(
    forgotten: str | None, message: str | None
) -> None:
    settings = settings_of(1)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)
    places = [each for each in ("reset", "step", "final_obs", "reward") if each != forgotten]
    training = Training(lambda designs: Clocked(usual(designs), *places), settings)
    if message is None:
        training.run_round()
        arrays = training.learned.buffer.arrays()
        np.testing.assert_array_equal(
            np.unique(arrays["next_state"][:, 0]),
            np.arange(1, TASK.action_count + 1, dtype=np.float32) / TASK.action_count,
        )
        return
    with pytest.raises(ValueError, match=message):
        training.run_round()


def test_mirror_images_are_made_of_what_is_known_alone() -> None:
    mirrored = settings_of(1, mirror_transitions=True)
    with pytest.raises(ValueError, match="states of FollowTheClock have 1 numbers, expected false"):
        Training(FollowTheClock, mirrored)

    class OneSided(Halved):
        is_symmetric = False  # type: ignore[assignment]

    usual = crawling(viscous_crawler_robot, make_simulator, mirrored)
    with pytest.raises(ValueError, match="is_symmetric of OneSided is False, expected True"):
        Training(lambda designs: OneSided(usual(designs)), mirrored)
    assert isinstance(usual(SPACE.some(2)), CrawlingEnvironment)


class EndsEarly(TaskWrapper):
    """A centimetre for each action. Episodes end after the fourth, and all that follows fails."""

    def __init__(self, environment: TrainingEnvironment, for_good: bool) -> None:
        super().__init__(environment)
        self._for_good, self._passed = for_good, 0

    def reset(self, **settings: Any) -> Any:
        self._passed = 0
        return self.env.reset(**settings)

    def step(self, actions: np.ndarray) -> Any:
        observation, _, terminated, truncated, info = self.env.step(actions)
        self._passed += 1
        (terminated if self._for_good else truncated)[:] |= self._passed == 4
        reward = np.ones(len(actions))
        status = np.full(len(actions), self._passed > 4, dtype=np.uint8)
        info = {**info, "forward_travel_cm": reward, "status": status}
        return observation, reward, terminated, truncated, info


@pytest.mark.parametrize("for_good", [True, False])
def test_nothing_counts_after_an_episode_that_ended_early(for_good: bool) -> None:
    """Neither as robots learn nor where they are ranked."""
    settings = settings_of(1)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)
    training = Training(lambda designs: EndsEarly(usual(designs), for_good), settings)
    returns, failed, _ = training.walk_and_learn(np.arange(16), 0)
    np.testing.assert_array_equal(returns, 4.0)
    assert not failed.any()
    pairs = training.evaluate()
    assert len(pairs) == 16
    assert {(pair.score_cm, pair.distance_cm, pair.achieved) for pair in pairs} == {(4.0, 4.0, 4.0)}


class Blind(TaskWrapper):
    """The third robot's second number is none in one place."""

    def __init__(self, environment: TrainingEnvironment, place: str) -> None:
        super().__init__(environment)
        self._place = place

    def reset(self, **settings: Any) -> Any:
        observation, info = self.env.reset(**settings)
        return self._seen("reset", observation), info

    def step(self, actions: np.ndarray) -> Any:
        observation, *rest, info = self.env.step(actions)
        if "final_obs" in info:
            info["final_obs"][2] = self._seen("final_obs", np.stack(info["final_obs"]))[2]
        return self._seen("step", observation), *rest, info

    def _seen(self, place: str, observation: np.ndarray) -> np.ndarray:
        seen = observation.copy()
        if place == self._place:
            seen[2, 1] = np.nan
        return seen


@pytest.mark.parametrize(
    ("place", "what"),
    [
        ("reset", "observation of reset"),
        ("step", "observation"),
        ("final_obs", r'info\["final_obs"\]'),
    ],
)
def test_observations_that_are_not_finite_are_refused(place: str, what: str) -> None:
    settings = settings_of(1)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)
    training = Training(lambda designs: Blind(usual(designs), place), settings)
    said = f"^{what} of Blind is nan for robot 2 in column 1, expected finite numbers"
    with pytest.raises(ValueError, match=said):
        training.run_round()


@pytest.mark.parametrize(
    ("place", "what"),
    [("reset", "observation of reset"), ("step", "observation after action 1")],
)
def test_an_evaluation_refuses_them_as_well(place: str, what: str) -> None:
    settings = settings_of(1)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)
    training = Training(lambda designs: Blind(usual(designs), place), settings)
    with pytest.raises(ValueError, match=f"^{what} of Blind is nan for robot 2 in column 1"):
        training.evaluate()


class Rich(TaskWrapper):
    """Rewards whose squares single precision does not hold."""

    def step(self, actions: np.ndarray) -> Any:
        observation, reward, *rest = self.env.step(actions)
        return observation, np.full(len(reward), 1e30), *rest


def test_learning_that_diverges_says_so() -> None:
    settings = settings_of(4)
    usual = crawling(viscous_crawler_robot, make_simulator, settings)
    training = Training(lambda designs: Rich(usual(designs)), settings)
    training.run_round()
    said = (
        r"^learning diverged at timestep 512: critic_loss is inf, .*critic_learning_rate is 0\.002"
    )
    with pytest.raises(ValueError, match=said):
        training.run_round()


def test_a_policy_that_diverged_is_not_followed() -> None:
    training = Training(FollowTheClock, settings_of(4, updates=0))
    for _ in range(2):
        training.run_round()
    state = training.learned.state
    training.learned.state = state.restored(
        {
            name: np.full_like(values, np.nan) if values.dtype.kind == "f" else values
            for name, values in state.arrays().items()
        }
    )
    with pytest.raises(ValueError, match="diverged at timestep 512: the policy's action is nan"):
        training.run_round()
