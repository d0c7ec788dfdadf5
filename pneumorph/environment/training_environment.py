"""What a training asks of an environment, and what a task of one's own is made from."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import Space
from gymnasium.vector import VectorEnv, VectorWrapper

from pneumorph.environment.crawling_simulator import RUNNING
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.reward_term import (
    ActionMotion,
    RewardTerm,
    image_is_stale,
    with_terms,
)
from pneumorph.robot.design import Design


class TrainingEnvironment(Protocol):
    """Robots side by side, each with its own design: a Gymnasium `VectorEnv` with a `task`.

    An observation is a state of any length, zeros at the start of an episode, and then the design
    as `Design.one_hot` has it. An action is a number in [-1, 1] for each regulator. Episodes last
    `CrawlingTask.action_count` actions; a robot that ends earlier begins anew in the same step
    (``AutoresetMode.SAME_STEP``), with its last observation in ``info["final_obs"]``.

    Of ``info`` a training reads, where they are there, each (robot,): ``status``, 0 unless the
    simulation failed; ``forward_travel_cm``, what of the way is told as a pair's distance, by
    default the reward; ``achieved``, what of the task's goal was in its unit, by default the same;
    ``command_kPa`` (robot, regulator), the pressures of gait files, by default
    what `CrawlingTask.pressure_kPa` makes of the actions; ``mirrored_reward_cm``, what the robot's
    mirror image would have got, by default the reward; ``mirrored_with_cm``, the same array, and
    ``rewarded_cm``, the reward that it belongs to, by which a wrapper is told that changes the
    reward and not the image's.
    """

    @property
    def num_envs(self) -> int:
        """Number of robots."""

    @property
    def task(self) -> CrawlingTask:
        """Length of an episode, and what an action is."""

    @property
    def is_symmetric(self) -> bool:
        """Whether a robot and its mirror image, doing the same, are rewarded alike."""

    @property
    def single_observation_space(self) -> Space[Any]:
        """Of one robot."""

    @property
    def single_action_space(self) -> Space[Any]:
        """Of one robot."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode of every robot, with ``options["designs"]``, one `Design` for each; the
        seed is for what is drawn."""

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold an action (robot, regulator); observation, reward [cm], terminated, truncated and
        info, a row for each robot."""


EnvironmentFactory = Callable[[Sequence[Design]], TrainingEnvironment]
"""Makes an environment with a robot of each of these designs."""


class TaskWrapper(VectorWrapper):
    """A `CrawlingEnvironment` with a reward of one's own, which is the usual one and `terms`.

    Where terms do not say it, or robots are to observe something else, override `step`, and call
    this class's for the terms.

    Raises:
        TypeError: A subclass has other terms than a tuple, which is told where it is defined,
            nothing but what no training asks for, or a `step` that takes no actions.
    """

    terms: tuple[RewardTerm, ...] = ()
    """What is added to the reward of the environment."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        own = vars(cls).get("terms", ())
        if not hasattr(own, "__get__"):  # a property makes them later
            _refuse_no_terms(own, cls.__name__)

    def __init__(self, environment: TrainingEnvironment) -> None:
        """Take the robots and their task from an environment."""
        if not isinstance(environment, VectorEnv):
            raise ValueError(
                f"environment is a {type(environment).__name__}, expected a Gymnasium VectorEnv"
            )
        _refuse_no_terms(self.terms, type(self).__name__)
        self._check_own()
        super().__init__(environment)

    def _check_own(self) -> None:
        """Refuse a class whose author has mistaken a name or an argument."""
        name, kinds = type(self).__name__, type(self).__mro__
        own = {each for kind in kinds[: kinds.index(TaskWrapper)] for each in vars(kind)}
        public = {each for each in own if not each.startswith("_")} - {"terms"}
        unknown = sorted(each for each in public if not hasattr(TaskWrapper, each))
        changes_nothing = "__init__" not in own and len(unknown) == len(public)
        if unknown and changes_nothing and not self.terms:
            raise TypeError(
                f"{name} defines {', '.join(unknown)}, which no training asks for, and has neither "
                "terms nor a step(self, actions): its reward would be the usual one"
            )
        try:
            inspect.signature(type(self).step).bind(self, None)
        except TypeError as error:
            raise TypeError(
                f"step of {name} {error}, expected step(self, actions), which returns what "
                "super().step(actions) does"
            ) from error

    @property
    def task(self) -> CrawlingTask:
        """Length of an episode, and what an action is."""
        task: CrawlingTask = self.env.task  # type: ignore[attr-defined]
        return task

    @property
    def is_symmetric(self) -> bool:
        """Whether a robot and its mirror image, doing the same, are rewarded alike; override it
        where a `step` of your own depends on the side."""
        sided = any(term.depends_on_side for term in self.terms)
        return bool(self.env.is_symmetric) and not sided  # type: ignore[attr-defined]

    @property
    def all_terms(self) -> tuple[RewardTerm, ...]:
        """Its terms and those of wrappers within."""
        within = self.env.all_terms if isinstance(self.env, TaskWrapper) else ()
        return (*within, *self.terms)

    @property
    def motion(self) -> ActionMotion:
        """What the robots did in the last step."""
        motion: ActionMotion = self.env.motion  # type: ignore[attr-defined]
        return motion

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold an action (robot, regulator), and add `terms` to its reward."""
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if self.terms:
            symmetric = bool(self.env.is_symmetric)  # type: ignore[attr-defined]
            reward = with_terms(self.terms, self.motion, reward, info, symmetric)
        return observation, reward, terminated, truncated, info

    @property
    def simulator(self) -> Any:
        """What the robots are simulated by, after a step at the step's end: a `CrawlingSimulator`,
        and of the others in ``crawling_simulator`` those whose attributes it has."""
        return self.env.simulator  # type: ignore[attr-defined]


def _refuse_no_terms(terms: Any, name: str) -> None:
    """Refuse terms of a task that are no tuple of them.

    Args:
        terms: What the task has as its terms.
        name: What the task is called.
    """
    if not isinstance(terms, tuple) or not all(isinstance(each, RewardTerm) for each in terms):
        raise TypeError(
            f"terms of {name} is {terms!r:.80}, expected a tuple of RewardTerm, such as (turning,) "
            "with a comma"
        )


@dataclass(frozen=True, eq=False)
class ToldStep:
    """What a training reads of a step, for each robot.

    Attributes:
        failed: Whether its simulation failed, (robot,) bool.
        distance_cm: What counts as its way [cm], (robot,).
        achieved: What of the task's goal it achieved [its unit], (robot,).
        mirrored_reward_cm: What its mirror image would have got [cm], (robot,).
        mirror_is_stale: Whether that is the image's of another reward.
        command_kPa: Real pressures [kPa], (robot, regulator).
    """

    failed: np.ndarray
    distance_cm: np.ndarray
    achieved: np.ndarray
    mirrored_reward_cm: np.ndarray
    mirror_is_stale: bool
    command_kPa: np.ndarray

    @classmethod
    def of(
        cls, info: Mapping[str, Any], actions: np.ndarray, reward: np.ndarray, task: CrawlingTask
    ) -> ToldStep:
        """Read a step's info; see `TrainingEnvironment` for what need not be there.

        Args:
            info: Of the step.
            actions: What was asked for, (robot, regulator).
            reward: What it brought [cm], (robot,).
            task: What an action is.
        """
        command = info.get("command_kPa")
        distance_cm = info.get("forward_travel_cm", reward)
        return cls(
            failed=np.asarray(info.get("status", np.zeros(len(reward)))) != RUNNING,
            distance_cm=distance_cm,
            achieved=info.get("achieved", distance_cm),
            mirrored_reward_cm=info.get("mirrored_reward_cm", reward),
            mirror_is_stale=image_is_stale(info, reward),
            command_kPa=task.pressure_kPa(actions) if command is None else command,
        )
