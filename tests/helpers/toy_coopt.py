"""A small co-optimisation problem: viscous crawlers on four locations and two regulators."""

from collections.abc import Sequence
from functools import cache, partial
from itertools import product

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.viscous_crawler import ViscousCrawler
from pneumorph.learn.design_distribution import EntropySchedule
from pneumorph.learn.round_scores import ScoredRound
from pneumorph.learn.sac import SacSettings
from pneumorph.learn.settings import CooptSettings, FinetuningSettings
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

TIME_STEP_S = 0.05
SPACE = DesignSpace(location_count=4, regulator_count=2, minimum_legs=2, maximum_legs=3)
TASK = CrawlingTask(
    regulator_count=2,
    action_step_count=12,
    action_count=16,
    settling_step_count=1,
    remembered_action_count=2,
)
make_simulator = partial(ViscousCrawler, time_step_s=TIME_STEP_S)


def toy_settings(round_count: int, seed: int = 0, environment_count: int = 16) -> CooptSettings:
    """Settings of a run of some rounds, uniform for the first quarter of them."""
    timesteps = environment_count * TASK.action_count * round_count
    return CooptSettings(
        seed=seed,
        environment_count=environment_count,
        total_timesteps=timesteps,
        space=SPACE,
        task=TASK,
        sac=SacSettings(hidden_sizes=(64, 64), batch_size=128, initial_temperature=0.02),
        schedule=EntropySchedule(timesteps // 4, int(0.9 * timesteps)),
        finetuning=FinetuningSettings(timesteps=0),
        buffer_size=5000,
        learning_start_timestep=2 * environment_count * TASK.action_count,
        updates=4,
        mirror_transitions=True,
        checkpoint_interval_timesteps=1,
        evaluated_design_count=len(SPACE),
    )


@cache
def best_distances_cm(action_count: int = TASK.action_count) -> np.ndarray:
    """Furthest travel of each design over all gaits of the pressures 0, 45 and 90 kPa.

    An exhaustive search, by dynamic programming over the 9 combinations of two pressures: the
    travel of an action depends only on the pressures before and after it.
    """
    levels = np.array(list(product([0.0, 45.0, 90.0], repeat=2)))
    count = len(levels)
    best = []
    for design in SPACE:
        simulator = make_simulator([design] * count**2)
        simulator.advance(np.repeat(levels, count, axis=0), TASK.action_step_count)
        before = simulator.forward_position_mm
        simulator.advance(np.tile(levels, (count, 1)), TASK.action_step_count)
        travel_cm = (simulator.forward_position_mm - before).reshape(count, count) / 10.0
        value = np.zeros(count)
        for _ in range(action_count):
            value = (travel_cm + value).max(axis=1)
        best.append(value[0])  # from the deflated robot
    return np.array(best)


class CrawlersInWorlds(ViscousCrawler):
    """Crawlers on floors whose grip is drawn: robot i stands in world i modulo four."""

    def __init__(self, robots: Sequence[Design]) -> None:
        self.walked: list[tuple[Design, ...]] = []
        super().__init__(robots, TIME_STEP_S)
        self.redraw(0)

    def redraw(self, number: int) -> None:
        grips = np.random.default_rng([9, number]).uniform(1.0, 8.0, 4)
        self._grip = np.resize(grips, len(self._forward_mm))[:, None]  # type: ignore[assignment]

    def set_robots(self, robots: Sequence[Design]) -> None:
        self.walked.append(tuple(robots))
        super().set_robots(robots)


def scored(designs: list[int], scores_cm: list[float], failing: list[bool]) -> ScoredRound:
    """A round of these designs, each in one world."""
    return ScoredRound(np.array(designs), np.array(scores_cm), np.array(failing), False, {})
