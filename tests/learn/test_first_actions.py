"""What robots do before learning starts: the paper's draws, or waves that repeat."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from helpers.toy_coopt import TASK, make_simulator, toy_settings

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.environments import crawling
from pneumorph.learn.first_actions import (
    FIRST_ACTIONS,
    LONGEST_PERIOD,
    SHORTEST_PERIOD,
    FirstActions,
    wave_actions,
)
from pneumorph.learn.training import Training


def test_uniform_actions_are_drawn_one_after_another() -> None:
    """As trainings of before drew them: the same seed gives the same robots."""
    found = list(islice(FIRST_ACTIONS["uniform"](np.random.default_rng(3), 5, 2), 4))
    rng = np.random.default_rng(3)
    expected = [rng.uniform(-1.0, 1.0, (5, 2)).astype(np.float32) for _ in range(4)]
    np.testing.assert_array_equal(found, expected)


def _oscillation(actions: np.ndarray) -> np.ndarray:
    """2 cos(2 pi / period) of each robot, from a wave's identity a[k+1] + a[k-1] =
    2 cos(2 pi / period) a[k], by least squares over all its regulators; shape (robot,)."""
    around, middle = actions[2:] + actions[:-2], actions[1:-1]
    return (around * middle).sum(axis=(0, 2)) / (middle**2).sum(axis=(0, 2))


def test_waves_are_waves_of_one_period_a_robot() -> None:
    actions = np.array(list(islice(wave_actions(np.random.default_rng(0), 400, 3), 20)), float)
    twice_cosine = _oscillation(actions)
    # Rounded to single precision: half a unit in the last place of each of four numbers below 1,
    # times the wave's two.
    rest = actions[2:] + actions[:-2] - twice_cosine[:, None] * actions[1:-1]
    assert np.abs(rest).max() < 8 * np.finfo(np.float32).eps
    period = 2.0 * np.pi / np.arccos(np.clip(0.5 * twice_cosine, -1.0, 1.0))
    assert np.all((period > SHORTEST_PERIOD - 1e-3) & (period < LONGEST_PERIOD + 1e-3))
    # Uniform: quarters of 400 have 100 +- 8.7 each; five standard deviations.
    quarters, _ = np.histogram(period, 4, (SHORTEST_PERIOD, LONGEST_PERIOD))
    assert np.all(np.abs(quarters - 100) < 44)


def test_regulators_of_a_wave_have_phases_of_their_own() -> None:
    """Of a sine of uniform phase the mean is 0 and the mean square 1/2, and two are uncorrelated:
    over 4000 robots to 1 / sqrt(8000) = 0.011; five of these."""
    first = next(wave_actions(np.random.default_rng(1), 4000, 2)).astype(float)
    assert np.abs(first.mean(axis=0)).max() < 0.056
    assert np.abs((first**2).mean(axis=0) - 0.5).max() < 0.056
    assert abs((first[:, 0] * first[:, 1]).mean()) < 0.056


@pytest.mark.parametrize("kind", ["uniform", "waves"])
def test_training_begins_with_them(kind: FirstActions) -> None:
    """Until learning starts, and no longer."""
    settings = replace(toy_settings(4), first_actions=kind, mirror_transitions=False)
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    drawn: list[list[np.ndarray]] = []
    step = training.environment.step

    def noted(actions: np.ndarray) -> object:
        drawn[-1].append(actions)
        return step(actions)

    training._step = noted  # type: ignore[assignment]
    for _ in range(3):
        drawn.append([])
        training.run_round()
    rounds = np.array(drawn, float)
    assert rounds.shape == (3, TASK.action_count, settings.environment_count, 2)
    repeats = [
        np.abs(
            actions[2:] + actions[:-2] - _oscillation(actions)[:, None] * actions[1:-1]
        ).max() < 1e-5
        for actions in rounds
    ]  # fmt: skip
    assert repeats == ([True, True, False] if kind == "waves" else [False, False, False])
    assert not np.array_equal(rounds[0], rounds[1])
