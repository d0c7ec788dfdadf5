"""What the walks of a round say of its designs: their scores."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from pneumorph.learn.failed_walks import with_failed, with_lost
from pneumorph.learn.mirror import MirrorImage
from pneumorph.learn.objective import Objective


@dataclass(frozen=True)
class ScoredRound:
    """Scores of a round's designs, each once where designs walk in several worlds: one that was
    drawn several times has the mean of its scores."""

    designs: np.ndarray
    """Their indices, (design,)."""
    scores_cm: np.ndarray
    """(design,)"""
    failing: np.ndarray
    """Whether any of a design's simulations failed, (design,)."""
    in_worlds: bool
    """Whether each is of several worlds."""
    metrics: dict[str, float]
    """Mean score and standard error, where designs walk in several worlds."""


class RoundScores:
    """Scores of designs from their walks, by an objective, from round to round.

    Args:
        objective: What of the distances in several worlds counts.
        twins: Images of designs that count for them; None for none.
    """

    def __init__(self, objective: Objective, twins: MirrorImage | None) -> None:
        self._objective = objective
        self._twins = twins
        self.level = RoundLevel(objective.centring_rounds)

    def of(
        self,
        designs: np.ndarray,
        returns_cm: np.ndarray,
        failed: np.ndarray,
        apart: Collection[int] = (),
    ) -> ScoredRound:
        """Scores of one round.

        Args:
            designs: Indices of those drawn, (design,).
            returns_cm: Return of each robot [cm], the worlds of each design together,
                (design * world,).
            failed: Whether its simulation failed, (design * world,).
            apart: Designs that say nothing of how hard the round was: they did what was shown.
        """
        # Travel before a failure is no reason to come back to a design.
        fallen = failed.reshape(len(designs), -1)
        by_world = with_failed(returns_cm.reshape(fallen.shape), fallen)
        scores, failing, lost = self._objective.of(by_world), np.any(fallen, 1), np.all(fallen, 1)
        in_worlds = by_world.shape[1] > 1
        if in_worlds:
            # One that was drawn again, or whose image was, walked in the same worlds again: of all
            # its walks together the worlds would seem more, and so more alike, than they are.
            designs, which = np.unique(self._once(designs), return_inverse=True)
            drawn = np.bincount(which)
            scores = np.bincount(which, scores) / drawn
            failing = np.bincount(which, failing) > 0.0
            lost = np.bincount(which, lost) == drawn
        # How hard a round is for all, those say that came to the end of their walks; rounds in the
        # nominal world say nothing of it.
        if in_worlds or not self._objective.is_robust:
            said = np.isin(self._once(designs), self._once(np.array([*apart], dtype=np.int64)))
            scores = self.level.centred(scores, ~failing & ~said)
        # A hard round's shift is no merit of a design that failed in each of its worlds.
        scores = with_lost(scores, lost)
        return ScoredRound(designs, scores, failing, in_worlds, self._metrics(by_world))

    def _once(self, designs: np.ndarray) -> np.ndarray:
        """Of each design and its image, where that counts for it, one."""
        return designs if self._twins is None else self._twins.once(designs)

    def _metrics(self, by_world: np.ndarray) -> dict[str, float]:
        if by_world.shape[1] == 1:
            return {}
        errors = self._objective.standard_error(by_world)
        return {
            "round_score_cm": float(self._objective.of(by_world).mean()),
            "score_standard_error_cm": float(np.sqrt(np.mean(errors**2))),
        }


class RoundLevel:
    """The level that rounds' scores are centred about: the smoothed mean of those that count.

    Attributes:
        level_cm: Mean over about as many rounds as asked for [cm]; None before the first.
    """

    def __init__(self, round_count: int) -> None:
        """Start without a level.

        Args:
            round_count: Rounds to smooth over; 0 leaves scores as they are.
        """
        self._round_count = round_count
        self._seen = 0
        self.level_cm: float | None = None

    def centred(self, scores_cm: np.ndarray, counts: np.ndarray | None = None) -> np.ndarray:
        """Scores of a round shifted to the level, which takes up those that count.

        Args:
            scores_cm: The scores [cm], (design,).
            counts: Which designs say how hard the round was, (design,) bool; None for all. Where
                none does, scores are left as they are.
        """
        said = scores_cm if counts is None else scores_cm[counts]
        if self._round_count == 0 or said.size == 0:
            return scores_cm
        mean = float(said.mean())
        self._seen += 1
        # A plain mean until there are as many rounds as wanted.
        share = 1.0 / min(self._seen, self._round_count)
        old = mean if self.level_cm is None else self.level_cm
        self.level_cm = old + share * (mean - old)
        shifted: np.ndarray = scores_cm - mean + self.level_cm
        return shifted

    def state(self) -> dict[str, float | int | None]:
        """What `restore` takes, for a checkpoint."""
        return {"seen": self._seen, "level_cm": self.level_cm}

    def restore(self, state: dict[str, float | int | None]) -> None:
        """Take over what `state` gave."""
        self._seen = int(state["seen"] or 0)
        level = state["level_cm"]
        self.level_cm = None if level is None else float(level)
