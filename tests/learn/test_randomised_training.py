"""Training in drawn worlds: a resumed run sees the worlds that it would have seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from helpers.toy_coopt import make_simulator, toy_settings

from pneumorph.learn.environments import crawling
from pneumorph.learn.evaluation import EVALUATION_SEED
from pneumorph.learn.training import Training
from pneumorph.robot.design import Design


class _Redrawn:
    """A viscous crawler on a floor whose grip is drawn: what the environment asks to redraw."""

    def __init__(self, robots: Sequence[Design]) -> None:
        self.robots = list(robots)
        self.numbers: list[int] = []
        self.redraw(0)

    def redraw(self, number: int) -> None:
        self.numbers.append(number)
        self.grip = float(np.random.default_rng([9, number]).uniform(1.0, 8.0))
        self.set_robots(self.robots)

    def set_robots(self, robots: Sequence[Design]) -> None:
        self.robots = list(robots)
        self._inner = make_simulator(self.robots, grip=self.grip)

    def __getattr__(self, name: str) -> object:
        return getattr(self._inner, name)


def _training(settings_rounds: int) -> tuple[Training, list[_Redrawn]]:
    made: list[_Redrawn] = []

    def make(robots: Sequence[Design]) -> _Redrawn:
        made.append(_Redrawn(robots))
        return made[-1]

    return Training(
        crawling(lambda design: design, make, toy_settings(settings_rounds)),
        toy_settings(settings_rounds),
    ), made


def test_resumed_training_sees_the_same_worlds() -> None:
    whole, _ = _training(4)
    metrics = [whole.run_round() for _ in range(4)]
    first, made = _training(4)
    for _ in range(2):
        first.run_round()
    resumed, again = _training(4)
    resumed.restore(first.arrays(), first.metadata())
    later = [resumed.run_round() for _ in range(2)]
    assert [m["return_mean_cm"] for m in later] == [m["return_mean_cm"] for m in metrics[2:]]
    # Every round draws anew, by its timestep.
    round_steps = len(first.environment.designs) * first.settings.task.action_count
    assert made[0].numbers == [0, 0, round_steps]
    assert again[0].numbers == [0, 2 * round_steps, 3 * round_steps]


def test_a_run_resumed_at_its_end_evaluates_in_the_same_worlds() -> None:
    whole, _ = _training(2)
    for _ in range(2):
        whole.run_round()
    resumed, _ = _training(2)
    resumed.restore(whole.arrays(), whole.metadata())
    evaluated = [pair.distance_cm for pair in whole.evaluate()]
    assert [pair.distance_cm for pair in resumed.evaluate()] == evaluated


def test_every_evaluation_is_in_the_same_worlds_and_they_are_none_of_the_training() -> None:
    """What one training found at two times, or two of its beginnings, is compared by them."""
    training, made = _training(2)
    for _ in range(2):
        training.run_round()
        training.evaluate()
    drawn = made[0].numbers[1:]
    assert drawn.count(EVALUATION_SEED) == 2
    assert len(set(drawn)) == 3
