"""A genetic algorithm over designs and gaits together (Goldberg 1989).

A genome is a design's assignment and the numbers of its gait. Parents are chosen by tournament. A
child takes each location from either parent and the first part of its gait from one, the rest from
the other; then single locations are redrawn and single numbers of the gait moved. Of parents and
children the furthest of each design survive, the best designs first: with more than one of a design
the first that comes forward soon takes over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, Positive, Share
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.searcher import Candidates
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

_MOST_TRIES = 100
"""Times that a child of too few or too many legs is made again before a parent stands in."""

_Genome: TypeAlias = tuple[np.ndarray, np.ndarray]
"""Assignment (location,) and actions (action, regulator)."""


@dataclass(frozen=True)
class GeneticSettings(Checked):
    """Genetic algorithm over designs and gaits."""

    population: Annotated[int, Bounds(least=2)] = 96
    """Candidates of a generation, as many as robots are simulated side by side."""
    tournament_size: Count = 3
    """Candidates that compete to become a parent."""
    crossover_probability: Share = 0.7
    """Share of children that have two parents."""
    location_mutation_probability: Share = 0.125
    """Share of locations that are redrawn: one of eight."""
    action_mutation_probability: Share = 0.1
    """Share of a gait's numbers that are moved."""
    action_mutation_size: Positive = 0.5
    """Standard deviation of that move; actions go from -1 to 1."""


class GeneticAlgorithm:
    """The parents and the generation that was asked for last."""

    def __init__(
        self, space: DesignSpace, task: CrawlingTask, settings: GeneticSettings, seed: int
    ) -> None:
        """Draw the first generation uniformly.

        Raises:
            ValueError: The space has rules that crossover and mutation do not know.
        """
        if not space.is_plain:
            raise ValueError(
                "the genetic algorithm knows numbers of legs and regulators alone, expected a "
                "design space without options, exclusions or symmetries; search at random, or gaits"
            )
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

    def _newcomer(self) -> _Genome:
        design = self._space[int(self._rng.integers(len(self._space)))]
        return np.array(design.assignment), self._rng.uniform(-1.0, 1.0, self._gait_shape)

    def _parent(self) -> _Genome:
        # They are sorted, so the first of those drawn wins.
        drawn = self._rng.integers(len(self._parents), size=self._settings.tournament_size)
        return self._parents[int(drawn.min())][0]

    def _child(self) -> _Genome:
        for _ in range(_MOST_TRIES):
            assignment, action = self._parent()
            if self._rng.random() < self._settings.crossover_probability:
                other_assignment, other_action = self._parent()
                from_other = self._rng.random(len(assignment)) < 0.5
                assignment = np.where(from_other, other_assignment, assignment)
                cut = self._rng.integers(len(action) + 1)
                action = np.concatenate([action[:cut], other_action[cut:]])
            assignment = self._mutated_assignment(assignment)
            legs = np.count_nonzero(assignment)
            if self._space.minimum_legs <= legs <= self._space.maximum_legs:
                return assignment, self._mutated_action(action)
        assignment, action = self._parent()
        return assignment, self._mutated_action(action)

    def _mutated_assignment(self, assignment: np.ndarray) -> np.ndarray:
        redrawn = self._rng.integers(self._space.regulator_count + 1, size=len(assignment))
        chosen = self._rng.random(len(assignment)) < self._settings.location_mutation_probability
        return np.where(chosen, redrawn, assignment)

    def _mutated_action(self, action: np.ndarray) -> np.ndarray:
        move = self._rng.normal(0.0, self._settings.action_mutation_size, action.shape)
        chosen = self._rng.random(action.shape) < self._settings.action_mutation_probability
        return np.clip(np.where(chosen, action + move, action), -1.0, 1.0)


def canonical_candidate(
    space: DesignSpace, assignment: np.ndarray, action: np.ndarray
) -> tuple[int, np.ndarray]:
    """Index of a design in the space, and its gait (action, regulator) under its canonical names.

    Regulators are renumbered in order of first appearance, and the gait's columns with them.
    """
    design = Design(tuple(int(regulator) for regulator in assignment))
    if not space.canonical:
        return space.index(design), action
    used = [name - 1 for name in design.regulator_order()]
    unused = [name for name in range(action.shape[1]) if name not in used]
    return space.index(design), action[:, [*used, *unused]]
