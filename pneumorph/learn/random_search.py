"""Designs and gaits drawn uniformly: what any search must beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.searcher import Candidates
from pneumorph.robot.design_space import DesignSpace


@dataclass(frozen=True)
class RandomSearchSettings(Checked):
    """Random search over designs and gaits."""

    population: Count = 96
    """Candidates drawn and simulated at a time."""


class RandomSearch:
    """Draws each design with equal probability and each number of a gait uniformly."""

    def __init__(
        self, space: DesignSpace, task: CrawlingTask, settings: RandomSearchSettings, seed: int
    ) -> None:
        """Start with a seed."""
        self._space = space
        self._shape = (settings.population, task.action_count, task.regulator_count)
        self._rng = np.random.default_rng(seed)

    def ask(self) -> Candidates:
        """Draw candidates."""
        design = self._space.drawn(self._shape[0], self._rng)
        return Candidates(design, self._rng.uniform(-1.0, 1.0, self._shape))

    def tell(self, distance_cm: np.ndarray) -> None:
        """Learn nothing."""

    def begin_in_other_worlds(self) -> None:
        """Nothing was learned."""
