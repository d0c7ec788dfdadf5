"""Environments that a training makes or is given, and whether they are what it needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_simulator import RobotBuilder, SimulatorFactory
from pneumorph.environment.training_environment import EnvironmentFactory, TrainingEnvironment
from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design


def crawling(
    build_robot: RobotBuilder, make_simulator: SimulatorFactory, settings: CooptSettings
) -> EnvironmentFactory:
    """The environments of a training whose robots crawl.

    Args:
        build_robot: Turns a design into a robot of the simulator.
        make_simulator: Makes the simulator of a list of robots.
        settings: Of the training.
    """
    space = settings.space

    def make(designs: Sequence[Design]) -> CrawlingEnvironment:
        return CrawlingEnvironment(
            designs,
            build_robot,
            make_simulator,
            settings.task,
            space.module_count,
            space.cavity_count,
        )

    return make


def state_size(
    environment: TrainingEnvironment, settings: CooptSettings, robot_count: int | None = None
) -> int:
    """Numbers of an observation before the design's.

    Args:
        environment: What a training was given.
        settings: Of the training.
        robot_count: Robots that it was asked for; None for as many as learn.

    Raises:
        ValueError: The environment has other robots, actions or designs than the settings, or
            mirror images of its states are not known.
    """
    observed = environment.single_observation_space.shape
    acted = environment.single_action_space.shape
    task, features = settings.task, settings.space.feature_count
    name = type(environment).__name__
    robot_count = robot_count or settings.environment_count
    if environment.num_envs != robot_count:
        raise ValueError(
            f"{name} has {environment.num_envs} robots, expected {robot_count}, one of each design "
            f"that it is given (environment_count is {settings.environment_count})"
        )
    if environment.task != task:
        raise ValueError(
            f"the task of {name} is {environment.task}, expected that of the settings, {task}"
        )
    if acted != (task.regulator_count,):
        raise ValueError(
            f"{name} has actions of shape {acted}, expected ({task.regulator_count},): one number "
            "for each regulator"
        )
    if observed is None or len(observed) != 1 or observed[0] < features:
        raise ValueError(
            f"{name} has observations of shape {observed}, expected a state and then the "
            f"{features} numbers of a design of the space, see Design.one_hot"
        )
    size = observed[0] - features
    if settings.mirror_transitions and environment.is_symmetric != settings.is_symmetric:
        raise ValueError(
            f"mirror_transitions is true and is_symmetric of {name} is {environment.is_symmetric}, "
            f"expected {settings.is_symmetric} as task.reward and sided_reward have it: "
            "sided_reward = true where a reward of your own depends on the side, or "
            "mirror_transitions = false"
        )
    if settings.mirror_transitions and size != task.state_size:
        raise ValueError(
            f"mirror_transitions is true and the states of {name} have {size} numbers, expected "
            f"false, or the {task.state_size} of the remembered actions, whose mirror images are "
            "known"
        )
    return size


def check_judged(
    judged: TrainingEnvironment, learning: TrainingEnvironment, settings: CooptSettings
) -> None:
    """Refuse an environment of evaluations that is none for what is learned in another.

    Args:
        judged: That of the evaluations.
        learning: That of learning, which fits the settings.
        settings: Of the training.

    Raises:
        ValueError: It does not fit the settings or has other states, or gaits count as they are
            seen in the other.
    """
    ours = state_size(learning, settings), learning.is_symmetric
    theirs = state_size(judged, settings, settings.judged_robot_count), judged.is_symmetric
    if ours != theirs:
        raise ValueError(
            f"the environment of evaluations has states of {theirs[0]} numbers and "
            f"is_symmetric = {theirs[1]}, expected {ours[0]} and {ours[1]} as that of learning"
        )
    if not settings.objective.is_robust:
        raise ValueError(
            "evaluations have an environment of their own, expected an objective over several "
            "worlds, such as worlds_per_design = 4: with one, gaits count for what they do while "
            "they are learned"
        )


def check_shape(
    environment: TrainingEnvironment, what: str, given: Any, expected: tuple[int, ...]
) -> None:
    """Refuse what an environment gives in another shape than its spaces promise.

    Args:
        environment: Whose it is.
        what: What it is, such as ``reward``.
        given: The array, or what stands in its place.
        expected: Shape that it should have.

    Raises:
        ValueError: It has another.
    """
    if (shape := np.shape(given)) != expected:
        raise ValueError(
            f"{what} of {type(environment).__name__} has shape {shape}, expected {expected}: a row "
            "for each robot, observations as in single_observation_space, and those of reset, of "
            'step and in info["final_obs"] alike'
        )


def check_observation(
    environment: TrainingEnvironment, what: str, given: Any, expected: tuple[int, ...]
) -> None:
    """Refuse observations of another shape than promised, or that are not finite: what a network
    learns from one of these is lost to all robots.

    Args:
        environment: Whose they are.
        what: What they are, such as ``observation of reset``.
        given: The array, or what stands in its place.
        expected: Shape that it should have, (robot, number).

    Raises:
        ValueError: It has another, or a number is not finite.
    """
    check_shape(environment, what, given, expected)
    check_finite(environment, what, given)


def check_finite(environment: TrainingEnvironment, what: str, given: np.ndarray) -> None:
    """Refuse observations or rewards that are not finite.

    Args:
        environment: Whose they are.
        what: What they are, such as ``observation of reset``.
        given: The array, (robot,) or (robot, number).

    Raises:
        ValueError: A number is not finite; names the robot.
    """
    wrong = np.argwhere(~np.isfinite(given))
    if len(wrong):
        robot, *column = wrong[0]
        where, failed = "", ""
        if column:
            where = f" in column {column[0]}"
            failed = ", also of a robot whose simulation failed"
        raise ValueError(
            f"{what} of {type(environment).__name__} is {np.asarray(given)[tuple(wrong[0])]} for "
            f"robot {robot}{where}, expected finite numbers{failed}"
        )
