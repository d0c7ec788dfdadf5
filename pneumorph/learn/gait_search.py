"""The best gait of each of several designs, by covariance matrix adaptation (CMA-ES).

Each design has a search of its own (Hansen 2016, arXiv:1604.00772; the ``cmaes`` library), over all
numbers of a gait: 20 actions of three regulators. The searches share nothing but the batch in which
their robots walk. The gait of a point ``u`` is ``sin(pi u / 2)``: near the identity inside the
bounds, folded smoothly at them, so that the extreme pressures are as easy to find as any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from cmaes import CMA

from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.searcher import Candidates


@dataclass(frozen=True)
class GaitSearchSettings(Checked):
    """CMA-ES over the gait of each design."""

    population: Annotated[int, Bounds(least=2)] = 16
    """Gaits per design and generation. The default is CMA-ES's usual 4 + 3 ln n for n = 60
    unknowns."""
    initial_deviation: Positive = 0.5
    """Standard deviation of the first generation, around half the highest pressure; actions go from
    -1 to 1."""


class GaitSearch:
    """One CMA-ES for each design, asked and told together."""

    def __init__(
        self,
        designs: Sequence[int],
        task: CrawlingTask,
        settings: GaitSearchSettings,
        seed: int,
    ) -> None:
        """Start every search at half the highest pressure.

        Args:
            designs: Indices of the designs; a design's search depends on its index and the seed,
                not on which others there are.
            task: What a gait is.
            settings: Options of CMA-ES.
            seed: Seed of all searches.

        Raises:
            ValueError: No design, or one twice.
        """
        if not len(designs) or len(set(designs)) < len(designs):
            raise ValueError(
                f"designs are {list(designs)}, expected one or more different indices of a space"
            )
        self._designs = np.array(designs)
        self._shape = (task.action_count, task.regulator_count)
        size = task.action_count * task.regulator_count
        self._population = settings.population
        self._searches = [
            CMA(
                mean=np.zeros(size),
                sigma=settings.initial_deviation,
                population_size=settings.population,
                seed=int(np.random.SeedSequence([seed, int(design)]).generate_state(1)[0]),
            )
            for design in designs
        ]
        self._asked: list[list[np.ndarray]] = []

    def ask(self) -> Candidates:
        """A generation of every design, design after design."""
        self._asked = [[search.ask() for _ in range(self._population)] for search in self._searches]
        points = np.array(self._asked).reshape(-1, *self._shape)
        return Candidates(np.repeat(self._designs, self._population), np.sin(0.5 * np.pi * points))

    def tell(self, distance_cm: np.ndarray) -> None:
        """Let every search learn from its own generation."""
        distances = np.reshape(distance_cm, (len(self._searches), self._population))
        for search, asked, walked in zip(self._searches, self._asked, distances, strict=True):
            # The library minimises.
            search.tell([(x, -float(value)) for x, value in zip(asked, walked, strict=True)])

    def begin_in_other_worlds(self) -> None:
        """Go on: each generation is compared with itself alone."""
