"""What a step of all robots teaches, and what it says of their mirror images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.environment.training_environment import ToldStep, TrainingEnvironment
from pneumorph.learn.environments import check_shape
from pneumorph.learn.mirror import MirrorImage


@dataclass(frozen=True, eq=False)
class Transitions:
    """A transition of each robot.

    Attributes:
        state: What the policy saw beside the design, (robot, state).
        design: Index of the design, (robot,).
        action: What it did, (robot, regulator).
        reward: What that brought [cm], (robot,).
        next_state: What it saw then, (robot, state).
        terminal: Whether the episode ended for good, (robot,) bool.
    """

    state: np.ndarray
    design: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    next_state: np.ndarray
    terminal: np.ndarray

    def image(self, mirror: MirrorImage, reward: np.ndarray) -> Transitions:
        """Those of the robots' mirror images.

        Args:
            mirror: Of the design space.
            reward: What the images got [cm], (robot,).
        """
        return Transitions(
            state=mirror.actions(self.design, self.state),
            design=mirror.designs(self.design),
            action=mirror.actions(self.design, self.action),
            reward=reward,
            next_state=mirror.actions(self.design, self.next_state),
            terminal=self.terminal,
        )

    def failing(self, failed: np.ndarray, reward_cm: float) -> Transitions:
        """The same, but of robots whose simulation failed the last, with another reward.

        Args:
            failed: Which did, (robot,) bool.
            reward_cm: What they get [cm], unless their task gives less for a failure.
        """
        return replace(
            self,
            reward=np.where(failed, np.minimum(reward_cm, self.reward), self.reward),
            terminal=self.terminal | failed,
        )


def last_observation(
    environment: TrainingEnvironment, next_observation: np.ndarray, info: Mapping[str, Any]
) -> np.ndarray:
    """What robots saw at the end of a step, shape (robot, observation): where an episode ended,
    what the step gives is the next one's first already.

    Args:
        environment: Whose step it was.
        next_observation: What the step gave.
        info: Of the step.

    Raises:
        ValueError: A last observation has another shape.
    """
    seen = next_observation.copy()
    for robot in np.flatnonzero(info.get("_final_obs", np.zeros(len(seen), dtype=bool))):
        last = info["final_obs"][robot]
        check_shape(environment, 'info["final_obs"] of a robot', last, seen.shape[1:])
        seen[robot] = last
    return seen


def check_mirrored(
    environment: TrainingEnvironment, info: Mapping[str, Any], told: ToldStep
) -> None:
    """Refuse a step that does not tell what mirror images get.

    Args:
        environment: Whose step it was.
        info: Of the step.
        told: What was read of it.

    Raises:
        ValueError: The image's reward is missing, or of another reward.
    """
    if not environment.is_symmetric and "mirrored_reward_cm" not in info:
        raise ValueError(
            "mirror_transitions is true, and the environment is not symmetric but does not "
            'tell info["mirrored_reward_cm"], what the mirror image gets: expected it, or '
            "mirror_transitions = false"
        )
    if told.mirror_is_stale:
        raise ValueError(
            "mirror_transitions is true, and the environment changes the reward but "
            'not info["mirrored_reward_cm"], what the mirror image gets: expected both '
            "changed, or mirror_transitions = false"
        )
