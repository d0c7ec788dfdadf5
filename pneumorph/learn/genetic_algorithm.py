"""A genetic algorithm over designs and gaits together (Goldberg 1989).

A genome is the option that a design has at each location and the numbers of its gait. Parents are
chosen by tournament. A child takes each location from either parent and the first part of its gait
from one, the rest from the other; then single locations are redrawn and single numbers of the gait
moved. Of parents and children the furthest of each design survive, the best designs first: with
more than one of a design the first that comes forward soon takes over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, Positive, Share
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.searcher import Candidates
from pneumorph.robot.design_space import DesignSpace

_MOST_TRIES = 100
"""Times that a child that breaks a rule of the space is made again before a parent stands in."""

_Genome: TypeAlias = tuple[np.ndarray, np.ndarray]
"""Numbers of the locations' options (location,) and actions (action, regulator)."""


@dataclass(frozen=True)
class GeneticSettings(Checked):
    """Genetic algorithm over designs and gaits."""

    population: Annotated[int, Bounds(least=2)] = 96
    """Candidates per generation; as many robots are simulated side by side."""
    tournament_size: Count = 3
    """Candidates drawn to compete for each parent; more prefer the best more strongly."""
    crossover_probability: Share = 0.7
    """Probability that a child has two parents."""
    location_mutation_probability: Share = 0.125
    """Probability that a location of a child's design is redrawn; the default is one of eight."""
    action_mutation_probability: Share = 0.1
    """Probability that a number of a child's gait is changed."""
    action_mutation_size: Positive = 0.5
    """Standard deviation of that change; actions go from -1 to 1."""


class GeneticAlgorithm:
    """The parents and the generation that was asked for last."""

    def __init__(
        self, space: DesignSpace, task: CrawlingTask, settings: GeneticSettings, seed: int
    ) -> None:
        """Draw the first generation uniformly."""
        self._space, self._settings = space, settings
        self._rng = np.random.default_rng(seed)
        self._gait_shape = (task.action_count, task.regulator_count)
        self._genomes = [self._newcomer() for _ in range(settings.population)]
        # Those that have walked, the furthest first, with their distances [cm].
        self._parents: list[tuple[_Genome, float]] = []

    def ask(self) -> Candidates:
        """The generation to walk, each design by its canonical name."""
        if self._parents:
            self._genomes = [self._child() for _ in range(self._settings.population)]
        named = [canonical_candidate(self._space, *genome) for genome in self._genomes]
        return Candidates(
            np.array([design for design, _ in named]), np.array([action for _, action in named])
        )

    def tell(self, distance_cm: np.ndarray) -> None:
        """Let the furthest of each design survive."""
        best: dict[int, tuple[_Genome, float]] = {}
        for genome, distance in [
            *self._parents,
            *zip(self._genomes, map(float, distance_cm), strict=True),
        ]:
            design, _ = canonical_candidate(self._space, *genome)
            if design not in best or distance > best[design][1]:
                best[design] = (genome, distance)
        ranked = sorted(best.values(), key=lambda each: -each[1])
        self._parents = ranked[: self._settings.population]

    def begin_in_other_worlds(self) -> None:
        """Let the survivors walk again, and newcomers in the places that are free."""
        survivors = [genome for genome, _ in self._parents]
        free = self._settings.population - len(survivors)
        self._genomes = [*survivors, *(self._newcomer() for _ in range(free))]
        self._parents = []

    def _newcomer(self) -> _Genome:
        (options,) = self._space.options_of(self._space.drawn(1, self._rng))
        return options, self._rng.uniform(-1.0, 1.0, self._gait_shape)

    def _parent(self) -> _Genome:
        # They are sorted, so the first of those drawn wins.
        drawn = self._rng.integers(len(self._parents), size=self._settings.tournament_size)
        return self._parents[int(drawn.min())][0]

    def _child(self) -> _Genome:
        for _ in range(_MOST_TRIES):
            options, action = self._parent()
            if self._rng.random() < self._settings.crossover_probability:
                other_options, other_action = self._parent()
                from_other = self._rng.random(len(options)) < 0.5
                options = np.where(from_other, other_options, options)
                cut = self._rng.integers(len(action) + 1)
                action = np.concatenate([action[:cut], other_action[cut:]])
            options = self._mutated_options(options)
            if self._space.holds(self._space.of_options(options)):
                return options, self._mutated_action(action)
        options, action = self._parent()
        return options, self._mutated_action(action)

    def _mutated_options(self, options: np.ndarray) -> np.ndarray:
        counts = self._space.paths.option_counts
        # One bound for all where there is one: what is drawn is then as it always was.
        bound = counts[0] if len(set(counts)) == 1 else np.array(counts)
        redrawn = self._rng.integers(bound, size=len(options))
        chosen = self._rng.random(len(options)) < self._settings.location_mutation_probability
        return np.where(chosen, redrawn, options)

    def _mutated_action(self, action: np.ndarray) -> np.ndarray:
        move = self._rng.normal(0.0, self._settings.action_mutation_size, action.shape)
        chosen = self._rng.random(action.shape) < self._settings.action_mutation_probability
        return np.clip(np.where(chosen, action + move, action), -1.0, 1.0)


def canonical_candidate(
    space: DesignSpace, options: np.ndarray, action: np.ndarray
) -> tuple[int, np.ndarray]:
    """Index of the design that stands for one of the space, and its gait (action, regulator).

    Where it has its regulators by other names, the gait's columns are renamed with them.

    Args:
        space: The designs.
        options: Numbers of the locations' options, (location,).
        action: The gait by the names of the options, (action, regulator).
    """
    form, order = space.form(space.of_options(options))
    return space.index(form), action[:, np.array(order) - 1]
