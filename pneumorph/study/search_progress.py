"""How far a search is within its generations and in its last evaluation, and how long it takes.

A generation is walked whole, and the best walk again in all worlds of an evaluation: of a small
budget most of the time goes there. Counted are actions of all robots side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.learn.objective import Objective
from pneumorph.learn.searcher import Candidates, Searcher

Shown = Callable[[int, int, str], None]


class SearchProgress:
    """Between a search and what shows how far it is.

    Args:
        shown: Told (steps done, steps in all, message).
        timesteps: Actions of all robots together that the search may make.
        action_count: Actions of a walk.
        objective: How many worlds candidates and finalists walk in.
        finalist_count: Most pairs that walk in an evaluation at the end.
        robot_count: Robots side by side.
    """

    def __init__(
        self,
        shown: Shown,
        timesteps: int,
        action_count: int,
        objective: Objective,
        finalist_count: int,
        robot_count: int,
    ) -> None:
        self._shown, self._timesteps, self._action_count = shown, timesteps, action_count
        self._worlds, self._finalists = objective.worlds_per_design, finalist_count
        self._side_by_side = max(1, robot_count // self._worlds)
        rounds = -(-objective.evaluation_worlds // self._worlds) if objective.is_robust else 0
        self._evaluated = rounds * action_count
        """Steps that as many finalists as walk side by side take."""
        self._done, self._generation, self._message = 0, 0, "searching"

    def of(self, searcher: Searcher) -> Searcher:
        """The same searcher, whose generations are counted."""
        return _Counted(searcher, self._asked)

    def stepped(self) -> None:
        """Robots have made an action."""
        self._done = min(self._done + 1, self.total)
        self._shown(self._done, self.total, self._message)

    def __call__(self, done: int, total: int, message: str) -> None:
        """What the search itself says: (timesteps, those in all) while it searches."""
        self._message = message
        if message.startswith("searching") and self._generation:
            each = self._generation * self._action_count * self._worlds
            self._done = min(done // each * self._steps_each, self.total)
        if done == total and self._evaluated == 0:
            self._done = self.total
        self._shown(self._done, self.total, message)

    @property
    def total(self) -> int:
        """Steps in all, as far as the size of a generation is known."""
        each = self._generation * self._action_count * self._worlds
        generations = -(-self._timesteps // each) if each else 1
        evaluated = self._evaluated * -(-self._finalists // self._side_by_side)
        return max(1, generations * self._steps_each + evaluated)

    @property
    def _steps_each(self) -> int:
        return -(-self._generation // self._side_by_side) * self._action_count

    def _asked(self, candidates: Candidates) -> None:
        self._generation = len(candidates)


class _Counted:
    def __init__(self, searcher: Searcher, asked: Callable[[Candidates], None]) -> None:
        self._searcher, self._asked = searcher, asked

    def ask(self) -> Candidates:
        candidates = self._searcher.ask()
        self._asked(candidates)
        return candidates

    def tell(self, distance_cm: Any) -> None:
        self._searcher.tell(distance_cm)


class ToldEnvironment(CrawlingEnvironment):
    """Robots that say when they have made an action."""

    told: Callable[[], None] | None = None
    """What they tell; None for nobody."""

    def step(self, actions: Any) -> Any:
        """As of `CrawlingEnvironment`."""
        found = super().step(actions)
        if self.told is not None:
            self.told()
        return found
