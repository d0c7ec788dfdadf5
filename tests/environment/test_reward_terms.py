"""Terms of a reward of one's own: what they pay a robot and its mirror image, and what is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from helpers.beside_images import steps_beside_images
from helpers.lopsided import Lopsided
from helpers.toy_coopt import SPACE, TASK, TIME_STEP_S, make_simulator, scored, toy_settings

import pneumorph as pm
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.equal_designs import check_equal_designs
from pneumorph.environment.goal import Goal, GoalName
from pneumorph.environment.place import Place
from pneumorph.environment.reward import RewardWeights
from pneumorph.environment.reward_term import ActionMotion
from pneumorph.environment.training_environment import EnvironmentFactory, TaskWrapper
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.environments import crawling, state_size
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training

LEFT = pm.RewardTerm("left", "degrees", 0.1, lambda motion: motion.moved.turn_deg, True)
EITHER = pm.RewardTerm("turning", "degrees", -0.1, lambda motion: abs(motion.moved.turn_deg))


class ToTheLeft(TaskWrapper):
    """Forward, and to the left."""

    terms = (LEFT,)


class Straight(TaskWrapper):
    """Forward, and to no side."""

    terms = (EITHER,)


class Sideways(TaskWrapper):
    """Forward, and what it goes to the left."""

    terms = (
        pm.RewardTerm("left", "mm", 0.1, lambda motion: motion.moved.left_mm, depends_on_side=True),
    )


def motion(failed: Sequence[bool] = (False, False)) -> ActionMotion:
    """One robot stays, the other goes 10 mm forward, 20 to the left and turns 30 degrees left, over
    half a circle; where one that failed is means nothing."""
    at = np.array([0.0, 170.0])
    before = Place(np.array([1.0, 2.0]), np.array([3.0, 4.0]), at)
    gone = np.where(failed, np.nan, [0.0, 1.0])
    after = Place(before.forward_mm + 10 * gone, before.left_mm + 20 * gone, at - 330 * gone)
    return ActionMotion(before, after, np.array(failed), before, None)


def test_a_term_is_worth_its_amount_and_of_an_image_the_images() -> None:
    for term, own, image in ((LEFT, 3.0, -3.0), (EITHER, -3.0, -3.0)):
        ours, theirs = term.worth_cm(motion())
        np.testing.assert_allclose(ours, [0.0, own])
        np.testing.assert_allclose(theirs, [0.0, image])


def test_a_robot_whose_simulation_failed_gets_nothing() -> None:
    for term in (LEFT, EITHER):
        ours, theirs = term.worth_cm(motion([False, True]))
        assert ours.tolist() == theirs.tolist() == [0.0, 0.0]


def test_the_image_gets_what_it_would_earn() -> None:
    """Reduced robots beside their images, each in its own episode."""

    def wrapped(environment: CrawlingEnvironment) -> Sideways:
        made = Sideways(environment)
        assert not made.is_symmetric
        return made

    task = pm.CrawlingTask(action_step_count=50)
    for reward, info, own in steps_beside_images(task, seed=1, wrap=wrapped):
        np.testing.assert_allclose(info["mirrored_reward_cm"], own, atol=2e-3)
        assert np.abs(info["left_cm"]).max() > 0.05  # far more than they may differ by
        np.testing.assert_allclose(reward, info["forward_travel_cm"] + info["left_cm"])


def made_of(wrapper: type[TaskWrapper], settings: CooptSettings) -> EnvironmentFactory:
    """Makes robots that turn to the side whose legs are inflated."""
    usual = crawling(
        viscous_crawler_robot, lambda robots: Lopsided(robots, time_step_s=TIME_STEP_S), settings
    )
    return lambda designs: wrapper(usual(designs))


@pytest.mark.parametrize("wrapper", [ToTheLeft, Straight])
def test_scores_count_for_the_image_too_unless_a_term_depends_on_the_side(
    wrapper: type[TaskWrapper],
) -> None:
    sided = wrapper is ToTheLeft
    settings = replace(toy_settings(round_count=4), kept_pair_count=40, sided_reward=sided)
    assert settings.mirrored_scores is not sided
    training = Training(made_of(wrapper, settings), settings)
    chosen = int(np.flatnonzero(SPACE.mirror_index != np.arange(len(SPACE)))[0])
    image = int(SPACE.mirror_index[chosen])
    training.walk_and_learn(np.full(16, chosen), 0)
    stored = training.learned.buffer.arrays()
    own, mirrored = (stored["reward"][stored["design"] == each] for each in (chosen, image))
    assert len(own) == len(mirrored) == 16 * TASK.action_count
    assert (np.abs(own - mirrored).max() > 0.1) == sided
    training._update_distribution(scored([chosen], [3.0], [False]))
    scores = training.learned.distribution.scores
    assert scores[chosen] == 3.0
    assert scores[image] == (0.0 if sided else 3.0)


def test_settings_that_take_a_side_for_none_are_refused() -> None:
    settings = toy_settings(round_count=4)
    environment = made_of(ToTheLeft, settings)(SPACE.some(settings.environment_count))
    with pytest.raises(ValueError, match="is_symmetric of ToTheLeft is False, expected True"):
        state_size(environment, settings)
    assert state_size(environment, replace(settings, sided_reward=True)) == TASK.state_size
    assert state_size(environment, replace(settings, mirror_transitions=False)) == TASK.state_size


class Unsaid(TaskWrapper):
    """Rewards a side and does not tell what an image gets."""

    is_symmetric = False  # type: ignore[assignment]


def test_an_image_that_nobody_tells_of_is_not_learned() -> None:
    settings = replace(toy_settings(round_count=4), sided_reward=True)
    training = Training(made_of(Unsaid, settings), settings)
    with pytest.raises(ValueError, match=r'does not tell info\["mirrored_reward_cm"\]'):
        training.walk_and_learn(np.zeros(16, dtype=int), 0)


class Untold(TaskWrapper):
    """Changes the reward, in its own way for an image, and tells nothing."""

    is_symmetric = False  # type: ignore[assignment]

    def step(self, actions: np.ndarray) -> Any:
        observation, reward, *rest = super().step(actions)
        return observation, reward * 3.0, *rest


@pytest.mark.parametrize("goal", ["forward", "turn_left"])
def test_terms_do_not_hide_what_a_wrapper_within_forgot(goal: GoalName) -> None:
    task = replace(TASK, reward=RewardWeights(goal=goal))
    settings = replace(toy_settings(round_count=4), task=task, sided_reward=True)
    usual = made_of(Untold, settings)
    training = Training(lambda designs: Straight(usual(designs)), settings)
    with pytest.raises(ValueError, match="what the mirror image gets"):
        training.walk_and_learn(np.zeros(16, dtype=int), 0)


def test_terms_of_wrappers_add_up() -> None:
    settings = toy_settings(round_count=4)
    usual, designs = made_of(Straight, settings), SPACE.some(settings.environment_count)
    alone, both = usual(designs), ToTheLeft(usual(designs))
    assert [term.name for term in both.all_terms] == ["turning", "left"]
    action = np.linspace(-1, 1, 32, dtype=np.float32).reshape(16, 2)
    for each in (alone, both):
        each.reset()
    (_, one, *_, info), (_, two, *_, told) = alone.step(action), both.step(action)
    np.testing.assert_allclose(two, one + told["left_cm"])
    np.testing.assert_allclose(told["mirrored_reward_cm"], one - told["left_cm"])
    assert np.abs(told["left_cm"]).max() > 0.1
    assert "left_cm" not in info


def test_what_the_simulator_does_not_know_is_no_amount() -> None:
    """Of robots that know of no side and no tilt."""
    settings = toy_settings(round_count=4)
    usual, designs = crawling(viscous_crawler_robot, make_simulator, settings), SPACE.some(16)
    leaning = replace(EITHER, amount=lambda motion: motion.tilt_deg)
    for term, message in (
        (EITHER, "'turning' is nan degrees of robot 0"),
        (leaning, "asks for tilt_deg, which ViscousCrawler does not know"),
    ):
        wrapped = type("Wrapped", (TaskWrapper,), {"terms": (term,)})(usual(designs))
        wrapped.reset()
        with pytest.raises(ValueError, match=message):
            wrapped.step(np.zeros((16, 2), np.float32))


def test_terms_need_names_of_their_own() -> None:
    settings = toy_settings(round_count=4)
    usual, designs = made_of(Straight, settings), SPACE.some(settings.environment_count)
    wrapped = type("Wrapped", (TaskWrapper,), {"terms": (EITHER,)})(usual(designs))
    wrapped.reset()
    with pytest.raises(ValueError, match="a step's info has 'turning_cm' already"):
        wrapped.step(np.zeros((16, 2), np.float32))
    for name in ("forward_travel", "rewarded"):
        with pytest.raises(ValueError, match=f"a step's info has '{name}_cm' already"):
            replace(EITHER, name=name)


def test_no_term_has_a_name_of_a_step_whatever_the_task_counts() -> None:
    """Of every goal, with every penalty, to the end of an episode."""
    weights = {"backsliding": 1.0, "hub_load": 1.0, "pressure_change": 1.0, "tilt": 1.0}
    entries: set[str] = set()
    for goal in get_args(GoalName):
        task = pm.CrawlingTask(
            action_count=1, action_step_count=1, settling_step_count=1,
            reward=RewardWeights(goal=goal, **weights),
        )  # fmt: skip
        made = pm.make_env(num_envs=1, task=task)
        made.reset()
        entries |= set(made.step(np.zeros((1, 3)))[-1])
    names = {each.split("_cm")[0].removesuffix("_kPa") for each in entries if each[0] != "_"}
    names = {"final" if each.startswith("final_") else each for each in names}
    assert {"status", "distance", "command", "final", "tilt", "turn", "mirrored_with"} <= names
    for name in names:
        with pytest.raises(ValueError, match=f"a term is called '{name}', .* another name than "):
            replace(EITHER, name=name)


def test_terms_without_a_comma_are_refused_where_the_class_is_made() -> None:
    with pytest.raises(TypeError, match=r"terms of Wrapped is RewardTerm.* with a comma"):
        type("Wrapped", (TaskWrapper,), {"terms": EITHER})
    made_later = property(lambda self: (EITHER,))
    type("Wrapped", (TaskWrapper,), {"terms": made_later})


@pytest.mark.parametrize("terms", [EITHER, ("turning",), [EITHER]])
def test_terms_are_a_tuple_of_terms(terms: Any) -> None:
    settings = toy_settings(round_count=4)
    usual, designs = made_of(Straight, settings), SPACE.some(settings.environment_count)
    with pytest.raises(TypeError, match="expected a tuple of RewardTerm"):
        type("Wrapped", (TaskWrapper,), {"terms": terms})(usual(designs))


@pytest.mark.parametrize("wrong", [{"amount": 0.1}, {"cm_per_unit": "0.1"}, {"unit": 1.0}])
def test_a_term_is_made_of_text_a_number_and_a_function(wrong: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match="expected name and unit as text, cm_per_unit as a number"):
        replace(LEFT, **wrong)


def test_terms_of_one_name_are_refused() -> None:
    settings = toy_settings(round_count=4)
    usual = made_of(Straight, settings)
    wrapped = type("Twice", (TaskWrapper,), {"terms": (replace(EITHER, name="twice"),) * 2})(
        usual(SPACE.some(16))
    )
    wrapped.reset()
    with pytest.raises(ValueError, match="two terms are called 'twice'"):
        wrapped.step(np.zeros((16, 2), np.float32))


def test_designs_that_a_side_tells_apart_do_not_count_as_one() -> None:
    space = replace(SPACE, symmetries=("mirror",))
    check_equal_designs(space, Goal())
    with pytest.raises(ValueError, match="the goal 'forward' with terms of its own tells them"):
        check_equal_designs(space, Goal(), sided_reward=True)


def test_terms_stand_in_the_last_info_of_an_episode() -> None:
    settings = toy_settings(round_count=4)
    environment = made_of(Straight, settings)(SPACE.some(settings.environment_count))
    environment.reset()
    for _ in range(TASK.action_count):
        _, _, ended, _, info = environment.step(np.full((16, 2), 0.5, np.float32))
    assert ended.all()
    np.testing.assert_array_equal(info["final_info"]["turning_cm"], info["turning_cm"])
    assert info["_turning_cm"].all()
    assert info["final_info"]["_turning_cm"].all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"depends_on_side": False}, "'left' is 30 degrees of a robot and -30 of its mirror image"),
        ({"amount": lambda motion: np.zeros(3)}, r"amounts of shape \(3,\), expected \(2,\)"),
        ({"amount": lambda motion: 0.0}, r"amounts of shape \(\), expected \(2,\)"),
        (
            {"amount": lambda motion: np.array([0.0, np.nan])},
            "'left' is nan degrees of robot 1, whose simulation is sound",
        ),
        (
            {"amount": lambda motion: motion.tilt},
            "the amount of the term 'left' fails: .* has no attribute 'tilt'; a motion has before",
        ),
        ({"cm_per_unit": np.inf}, "cm_per_unit of the term 'left' is inf"),
        ({"name": "to the left"}, "the name of a term is 'to the left', expected one word"),
    ],
)
def test_what_is_no_term_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(LEFT, **changes).worth_cm(motion())


def test_a_task_whose_author_has_mistaken_a_name_is_refused() -> None:
    class Misnamed(TaskWrapper):
        def reward(self, actions: np.ndarray) -> np.ndarray:
            return actions

    class NoActions(TaskWrapper):
        def step(self) -> None:  # type: ignore[override]
            """Ask for nothing."""

    class Helped(TaskWrapper):
        """A method of its own beside a step is nobody else's business."""

        def bonus(self) -> float:
            return 1.0

        def step(self, actions: np.ndarray) -> tuple[Any, ...]:  # type: ignore[override]
            observation, reward, *rest = super().step(actions)
            return observation, reward + self.bonus(), *rest

    usual = crawling(viscous_crawler_robot, make_simulator, toy_settings(1))(SPACE.some(16))
    with pytest.raises(TypeError, match="Misnamed defines reward, which no training asks for"):
        Misnamed(usual)
    with pytest.raises(TypeError, match=r"step of NoActions .*, expected step\(self, actions\)"):
        NoActions(usual)
    assert Helped(usual).bonus() == 1.0
    assert TaskWrapper(usual).all_terms == ()
