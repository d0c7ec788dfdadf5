"""What walks count for whose simulation failed: never more than those that came to their end."""

from __future__ import annotations

import numpy as np


def with_failed(values: np.ndarray, failed: np.ndarray) -> np.ndarray:
    """What designs achieve in worlds, where a failed walk counts for no more than zero, for no more
    than it had until then, and for no more than the least that its design achieved in a world where
    it did not fail: penalties would make a short walk the best.

    Args:
        values: Returns or distances, (design, world).
        failed: Whether the simulation failed, (design, world) bool.

    Returns:
        The same where nothing failed, (design, world).
    """
    least = np.where(failed, np.inf, values).min(axis=1, keepdims=True)
    return np.where(failed, np.minimum(np.minimum(values, 0.0), least), values)


def counted_walks(achieved: np.ndarray) -> np.ndarray:
    """What robots achieve in worlds, with failed walks counted as by `with_failed`.

    Args:
        achieved: In each world [any unit], (world,) or (world, robot); NaN where the simulation
            failed.

    Returns:
        The same where nothing failed, of that shape.
    """
    by_robot = np.atleast_2d(achieved.T)
    counted = with_failed(np.nan_to_num(by_robot), np.isnan(by_robot))
    return counted.T.reshape(achieved.shape)


def with_lost(scores: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """Scores of a round, where a design that failed in all its worlds has no more than zero, and no
    more than the lowest of those that did not.

    Args:
        scores: The scores, (design,).
        lost: Whether it failed in all of them, (design,) bool.

    Returns:
        The same where none is lost, (design,).
    """
    most = min(0.0, scores[~lost].min(initial=0.0))
    return np.where(lost, np.minimum(scores, most), scores)


def failing_reward_cm(rewards: np.ndarray, discount: float, action_count: int) -> float:
    """Reward of an action in which the simulation failed, for a learner to which nothing follows.

    Where actions cost more than they gain, as if the robot went on for ever at twice the mean cost.
    With a reward of 0 a failure would end all penalties that were to come, and the policy would
    learn to make its simulation fail. Where they gain, 0 is less than going on, and no more is
    taken off: the best gaits may lie near those that fail.

    Args:
        rewards: Of actions that did not fail [cm], (n,).
        discount: Of the learner, for each action.
        action_count: Actions of an episode, which is as long as it goes on without a discount.

    Returns:
        The reward [cm], zero at most; zero where no action is known that did not fail.
    """
    if len(rewards) == 0:
        return 0.0
    pace_cm = 2.0 * min(0.0, float(np.mean(rewards, dtype=float)))
    return pace_cm / (1.0 - discount) if discount < 1.0 else pace_cm * action_count
