"""Goals other than forward: what they pay, and what a robot's mirror image gets for the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.beside_images import steps_beside_images
from helpers.lopsided import Lopsided
from helpers.toy_coopt import SPACE, TASK, TIME_STEP_S, scored, toy_settings
from helpers.turner import Turner

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import Goal
from pneumorph.environment.reward import RewardWeights
from pneumorph.environment.training_environment import TaskWrapper
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.learn.environments import crawling
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design


@pytest.mark.parametrize(
    ("weights", "name", "wanted", "mirrored"),
    [
        # Of 10 steps: 2 cm forward, 3 cm to the left, 30 degrees to the left.
        (RewardWeights(goal="heading", heading_deg=90.0), "heading_travel_cm", 3.0, -3.0),
        (RewardWeights(goal="heading", heading_deg=180.0), "heading_travel_cm", -2.0, -2.0),
        (
            RewardWeights(goal="heading", heading_deg=60.0),
            "heading_travel_cm",
            1.0 + 1.5 * np.sqrt(3.0),
            1.0 - 1.5 * np.sqrt(3.0),
        ),
        (RewardWeights(goal="turn_left"), "turn_cm", 3.0, -3.0),
        (RewardWeights(goal="turn_right", turn_cm_per_degree=0.2), "turn_cm", -6.0, 6.0),
    ],
)
def test_each_goal_pays_what_it_says(
    weights: RewardWeights, name: str, wanted: float, mirrored: float
) -> None:
    """Over the border at 180 degrees too; the distance is how far forward it went all the same."""
    task = replace(TASK, action_step_count=10, settling_step_count=0, reward=weights)
    environment = CrawlingEnvironment(
        [Design.parse("1.0.2.0")], viscous_crawler_robot, Turner, task
    )
    environment.reset()
    for number in range(1, 16):
        _, reward, _, _, info = environment.step(np.zeros((1, 2)))
        np.testing.assert_allclose(reward, wanted, atol=1e-9)
        np.testing.assert_allclose(info[name], wanted, atol=1e-9)
        np.testing.assert_allclose(info["mirrored_reward_cm"], mirrored, atol=1e-9)
        np.testing.assert_allclose(info["forward_travel_cm"], 2.0)
        np.testing.assert_allclose(info["achieved"], wanted / weights.counted.cm_per_unit)
        np.testing.assert_allclose(info["distance_cm"], 2.0 * number)
    assert weights.is_symmetric == (wanted == mirrored)


def test_a_mirror_image_gets_what_is_said_of_it() -> None:
    """Reduced robots of the measured leg beside their images, each in its own episode. Friction is
    solved to 0.01 mm/s, so that 1 s parts them by some hundredths of a millimetre; what they get
    differs by a hundred times that."""
    weights = RewardWeights(goal="heading", heading_deg=60.0)
    task = CrawlingTask(action_step_count=50, reward=weights)
    for reward, info, own in steps_beside_images(task, seed=0):
        np.testing.assert_allclose(info["mirrored_reward_cm"], own, atol=2e-3)
        assert np.abs(reward - own).max() > 0.2


def test_what_turns_to_a_side_is_not_what_its_image_does() -> None:
    """Transitions of images have the other sign; scores count for the design alone, and both may be
    among the best."""
    task = replace(TASK, reward=RewardWeights(goal="turn_left"))
    settings = replace(toy_settings(round_count=4), task=task, kept_pair_count=40)
    assert settings.mirror_transitions
    assert not settings.mirrored_scores
    training = Training(
        crawling(
            viscous_crawler_robot,
            lambda robots: Lopsided(robots, time_step_s=TIME_STEP_S),
            settings,
        ),
        settings,
    )
    chosen = int(np.flatnonzero(SPACE.mirror_index != np.arange(len(SPACE)))[0])
    image = int(SPACE.mirror_index[chosen])
    training.walk_and_learn(np.full(16, chosen), 0)
    stored = training.learned.buffer.arrays()
    own, mirrored = stored["design"] == chosen, stored["design"] == image
    assert own.sum() == mirrored.sum() == 16 * TASK.action_count
    assert np.abs(stored["reward"][own]).max() > 0.1
    np.testing.assert_allclose(stored["reward"][mirrored], -stored["reward"][own], atol=1e-6)
    training._update_distribution(scored([chosen], [3.0], [False]))
    assert training.learned.distribution.scores[[chosen, image]].tolist() == [3.0, 0.0]
    training.walk_and_learn(np.full(16, image), 0)
    assert {chosen, image} <= {pair.design for pair in training.best.pairs}


class Costly(TaskWrapper):
    """Each action costs something, of the image too where it says so; or it costs nothing there."""

    said = False
    image_cost_cm = 0.5

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if self.said:
            info["mirrored_reward_cm"] = info["mirrored_reward_cm"] - self.image_cost_cm
        return observation, reward - 0.5, terminated, truncated, info


@pytest.mark.parametrize(
    ("said", "cost_cm", "mirror"),
    [(True, 0.5, True), (True, 0.0, True), (False, 0.5, True), (False, 0.5, False)],
)
def test_a_wrapper_that_forgets_the_mirror_image_is_refused(
    said: bool, cost_cm: float, mirror: bool
) -> None:
    task = replace(TASK, reward=RewardWeights(goal="turn_left"))
    settings = replace(toy_settings(round_count=4), task=task, mirror_transitions=mirror)
    usual = crawling(
        viscous_crawler_robot, lambda robots: Lopsided(robots, time_step_s=TIME_STEP_S), settings
    )

    def make(designs: Sequence[Design]) -> Costly:
        wrapped = Costly(usual(designs))
        wrapped.said, wrapped.image_cost_cm = said, cost_cm
        return wrapped

    training, design = Training(make, settings), np.zeros(16, dtype=int)
    if mirror and not said:
        with pytest.raises(ValueError, match=r'not info\["mirrored_reward_cm"\], what the mirror'):
            training.walk_and_learn(design, 0)
    else:
        training.walk_and_learn(design, 0)


def test_a_goal_to_a_side_asks_for_a_simulator_that_knows_it() -> None:
    task = CrawlingTask(regulator_count=2, reward=RewardWeights(goal="turn_left"))
    environment = CrawlingEnvironment(
        [Design.parse("1.2.0.0")], viscous_crawler_robot, ViscousCrawler, task
    )
    environment.reset()
    with pytest.raises(ValueError, match=r"goal is 'turn_left', expected 'forward' .* Viscous"):
        environment.step(np.zeros((1, 2)))


def test_goals_are_said_as_what_they_are() -> None:
    assert RewardWeights().said == ""
    assert RewardWeights(backsliding=0.5).said == "distance less 0.5 x backsliding"
    assert RewardWeights(goal="turn_right").said == "0.1 cm for each degree turned right"
    heading = RewardWeights(goal="heading", heading_deg=90.0, hub_load=2.0)
    assert heading.said == "travel to the left less 2 x share of weight on the hub"
    aslant = RewardWeights(goal="heading", heading_deg=-45.0)
    assert aslant.said == "travel 45 degrees right of forward"
    labels = {
        -90.0: "travel to the right",
        180.0: "travel backward",
        -180.0: "travel backward",
        0.0: "travel forward",
        30.0: "travel 30° left of forward",
        -120.5: "travel 120.5° right of forward",
    }
    for heading_deg, label in labels.items():
        assert RewardWeights(goal="heading", heading_deg=heading_deg).counted.label == label


class Somersaulter(Turner):
    """Turns by 3 degrees a step, from step 20 to 29 on its back, where it faces nowhere."""

    @property
    def heading_deg(self) -> np.ndarray:
        return np.where(20 <= self.steps < 30, np.nan, super().heading_deg)


def test_turning_over_is_no_turn_and_what_is_turned_after_it_counts_from_before() -> None:
    weights = RewardWeights(goal="turn_left", backsliding=0.5)
    task = replace(TASK, action_step_count=5, settling_step_count=0, reward=weights)
    environment = CrawlingEnvironment(
        [Design.parse("1.0.2.0")], viscous_crawler_robot, Somersaulter, task
    )
    turned = []
    for _ in range(2):  # an episode does not begin with the heading of the one before
        environment.reset()
        turned.append([environment.step(np.zeros((1, 2)))[4]["achieved"][0] for _ in range(8)])
    # On its back from the 20th to the 29th step; on its feet at the 30th, by 45 degrees further.
    expected = [15.0, 15.0, 15.0, 0.0, 0.0, 45.0, 15.0, 15.0]
    np.testing.assert_allclose(turned, [expected, expected])


class Riser(Turner):
    """Turns by 3 degrees a step, and lies on its back until step 12, when it faces right."""

    @property
    def heading_deg(self) -> np.ndarray:
        heading_deg = (-90.0 + 3.0 * (self.steps - 12) + 180.0) % 360.0 - 180.0
        return np.full(1, np.nan if self.steps < 12 else heading_deg)


@pytest.mark.parametrize("backsliding", [0.0, 0.5])
def test_standing_up_is_no_turn(backsliding: float) -> None:
    """Of a robot that starts tipped over the turn counts since it first faces anywhere, in every
    episode; its way counts all along, and none of it is sliding back."""
    turning = RewardWeights(goal="turn_left", backsliding=backsliding)
    heading = RewardWeights(goal="heading", heading_deg=90.0, backsliding=backsliding)
    task = replace(TASK, action_step_count=10, settling_step_count=0)
    for weights, achieved in ((turning, [0.0, 0.0, 30.0, 30.0]), (heading, [3.0] * 4)):
        environment = CrawlingEnvironment(
            [Design.parse("1.0.2.0")],
            viscous_crawler_robot,
            Riser,
            replace(task, reward=weights),
        )
        for _ in range(2):
            environment.reset()
            turns, faced = [], []
            for wanted in achieved:
                _, reward, _, _, info = environment.step(np.zeros((1, 2)))
                np.testing.assert_allclose(info["achieved"], wanted, atol=1e-9)
                worth = wanted * weights.counted.cm_per_unit
                np.testing.assert_allclose(reward, worth, atol=1e-9)
                turns.append(environment.motion.moved.turn_deg[0])
                faced.append(environment.motion.before.heading_deg[0])
            np.testing.assert_allclose(turns, [0.0, 0.0, 30.0, 30.0])
            np.testing.assert_allclose(faced, [0.0, -66.0, -66.0, -36.0])


def test_what_a_walk_achieved_is_measured_along_its_goal() -> None:
    """Of 3 cm forward, 4 cm to the left and 50 degrees turned."""
    walked = (3.0, 4.0, 50.0)
    assert Goal("forward").of(*walked) == 3.0
    assert Goal("turn_left").of(*walked) == 50.0
    assert Goal("turn_right").of(*walked) == -50.0
    assert Goal("heading", 90.0).of(*walked) == pytest.approx(4.0)
    assert Goal("heading", 30.0).of(*walked) == pytest.approx(1.5 * np.sqrt(3.0) + 2.0)
