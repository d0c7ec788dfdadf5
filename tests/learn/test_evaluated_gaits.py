"""Gaits that are known are ranked in the worlds that policies are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from helpers.toy_coopt import SPACE, TASK, CrawlersInWorlds

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluated_gaits import best_of_each_design
from pneumorph.learn.evaluation import walk_batch
from pneumorph.learn.objective import Objective
from pneumorph.robot.design import Design


@pytest.mark.parametrize(
    ("objective", "rounds"),
    [(Objective(), 1), (Objective(worlds_per_design=4, evaluation_worlds=8), 2)],
)
def test_a_known_gait_scores_what_a_policy_scores_that_does_the_same(
    objective: Objective, rounds: int
) -> None:
    """Where physics are drawn and the objective asks for one world, in the first of them alone."""
    drawn: list[int] = []

    class Told(CrawlersInWorlds):
        def __init__(self, robots: Sequence[Design]) -> None:
            super().__init__(robots)
            drawn.clear()

        def redraw(self, number: int) -> None:
            drawn.append(number)
            super().redraw(number)

    environment = CrawlingEnvironment(SPACE.some(4), viscous_crawler_robot, Told, TASK)
    shape = (TASK.action_count, TASK.regulator_count)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, shape)
    known = DesignGaitPair(7, TASK.pressure_kPa(actions), np.nan, np.nan, "before", 0, np.nan)
    found = best_of_each_design([known], environment, SPACE, objective)[7]
    assert len(drawn) == rounds
    step = 0

    def act(observation: np.ndarray) -> np.ndarray:
        nonlocal step
        step += 1
        return np.tile(actions[(step - 1) % TASK.action_count], (len(observation), 1))

    (policys,) = walk_batch(environment, SPACE, np.array([7]), act, 0, objective=objective)
    assert abs(policys.score_cm) > 0.1
    # Pressures become actions again.
    assert found.score_cm == pytest.approx(policys.score_cm, rel=1e-12)
    assert found.distance_cm == pytest.approx(policys.distance_cm, rel=1e-12)
