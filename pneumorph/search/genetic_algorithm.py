"""A genetic algorithm over designs and gaits together (Goldberg 1989).

A genome is a design's assignment and the numbers of its gait. Parents are chosen by tournament. A
child takes each location from either parent and the first part of its gait from one, the rest from
the other; then single locations are redrawn and single numbers of the gait moved. The best of
parents and children survive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.search.searcher import Candidates

_MOST_TRIES = 100
"""Times that a child of too few or too many legs is made again before a parent stands in."""


@dataclass(frozen=True)
class GeneticSettings:
    """Genetic algorithm over designs and gaits."""

    population: int = 96
    """Candidates of a generation, as many as robots are simulated side by side."""
    tournament_size: int = 3
    """Survivors that compete to become a parent."""
    crossover_probability: float = 0.7
    """Share of children that have two parents."""
    location_mutation_probability: float = 0.125
    """Share of locations that are redrawn: one of eight."""
    action_mutation_probability: float = 0.1
    """Share of a gait's numbers that are moved."""
    action_mutation_size: float = 0.5
    """Standard deviation of that move, of actions in [-1, 1]."""

    def __post_init__(self) -> None:
        if self.population < 2 or self.tournament_size < 1:
            raise ValueError(
                f"population and tournament_size are {self.population} and "
                f"{self.tournament_size}, expected at least 2 and 1"
            )
        for name in (
            "crossover_probability",
            "location_mutation_probability",
            "action_mutation_probability",
        ):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected from 0 to 1")
        if not self.action_mutation_size > 0.0:
            raise ValueError(f"action_mutation_size is {self.action_mutation_size}, expected > 0")


class GeneticAlgorithm:
    """The survivors and the generation that was asked for last."""

    def __init__(
        self, space: DesignSpace, task: CrawlingTask, settings: GeneticSettings, seed: int
    ) -> None:
        """Draw the first generation uniformly."""
        self._space, self._settings = space, settings
        self._rng = np.random.default_rng(seed)
        count = settings.population
        drawn = self._rng.integers(len(space), size=count)
        self._assignment = np.array([space[int(index)].assignment for index in drawn])
        shape = (count, task.action_count, task.regulator_count)
        self._action = self._rng.uniform(-1.0, 1.0, shape)
        # Nobody has walked yet: the first generation is all there is.
        self._survivors: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def ask(self) -> Candidates:
        """The generation to walk, each design by its canonical name."""
        if self._survivors is not None:
            children = [self._child() for _ in range(self._settings.population)]
            self._assignment = np.array([assignment for assignment, _ in children])
            self._action = np.array([action for _, action in children])
        named = [
            canonical_candidate(self._space, assignment, action)
            for assignment, action in zip(self._assignment, self._action, strict=True)
        ]
        return Candidates(
            np.array([design for design, _ in named]), np.array([action for _, action in named])
        )

    def tell(self, distance_cm: np.ndarray) -> None:
        """Let the best of parents and children survive."""
        walked = (self._assignment, self._action, np.asarray(distance_cm, dtype=float))
        if self._survivors is not None:
            walked = tuple(  # type: ignore[assignment]
                np.concatenate([old, new]) for old, new in zip(self._survivors, walked, strict=True)
            )
        best = np.argsort(-walked[2], kind="stable")[: self._settings.population]
        self._survivors = (walked[0][best], walked[1][best], walked[2][best])

    def _parent(self) -> tuple[np.ndarray, np.ndarray]:
        assert self._survivors is not None
        assignment, action, _ = self._survivors
        # Survivors are sorted, so the first of those drawn wins.
        winner = self._rng.integers(len(assignment), size=self._settings.tournament_size).min()
        return assignment[winner], action[winner]

    def _child(self) -> tuple[np.ndarray, np.ndarray]:
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
