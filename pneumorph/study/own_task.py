"""A task of one's own: what turns the usual environment of robots into one of another task."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence

from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.training_environment import (
    EnvironmentFactory,
    TaskWrapper,
    TrainingEnvironment,
)
from pneumorph.learn.environments import crawling
from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design
from pneumorph.study.training_worlds import TrainingWorlds, simulator_factory

OwnTask = Callable[[TrainingEnvironment], TrainingEnvironment]
"""Turns the usual environment of robots into one of another task."""


def keeps_usual_reward(own_task: OwnTask | None) -> bool:
    """Whether the reward is that of the settings, to which terms may be added."""
    if own_task is None:
        return True
    if not isinstance(own_task, type) or not issubclass(own_task, TaskWrapper):
        return False
    return own_task.step is TaskWrapper.step


def task_name(own_task: OwnTask) -> str:
    """What a task of one's own is called."""
    return str(getattr(own_task, "__qualname__", type(own_task).__qualname__))


def environments_of(
    settings: CooptSettings,
    spec: RobotSpec,
    worlds: TrainingWorlds | None,
    own_task: OwnTask | None,
) -> EnvironmentFactory:
    """Return what makes the environment of designs to learn in.

    Args:
        settings: The crawling task, and how it is learned.
        spec: The robot.
        worlds: What worlds are drawn from; None for one world.
        own_task: Turns that environment into another task's; None for crawling.

    Raises:
        TypeError: The task of one's own cannot be called with an environment alone.
        ValueError: It cannot be called at all. What is returned raises this too, where the task
            makes something else than an environment.
    """
    if own_task is not None and not callable(own_task):
        raise ValueError(
            f"own_task is {own_task!r}, expected a function or a class that is given an "
            "environment and returns one, such as a subclass of TaskWrapper"
        )
    usual = crawling(spec.assembly, simulator_factory(spec, worlds, settings.seed), settings)
    if own_task is None:
        return usual
    try:
        inspect.signature(own_task).bind(None)
    except TypeError as error:
        raise TypeError(
            f"own_task {task_name(own_task)}: {error}, expected a function or a class that is "
            "given an environment and returns one, such as a subclass of TaskWrapper"
        ) from error

    def make(designs: Sequence[Design]) -> TrainingEnvironment:
        made = own_task(usual(designs))
        if not hasattr(made, "single_observation_space"):
            raise ValueError(
                f"own_task {task_name(own_task)} returns {made!r:.80}, expected a "
                "TrainingEnvironment, such as a TaskWrapper"
            )
        return made

    return make
