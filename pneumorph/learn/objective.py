"""What of a design's distances in several worlds counts: their mean, or how they fare at worst."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, CountOrNone, NotNegative

ObjectiveKind = Literal["mean", "mean_minus_deviations", "worst_share"]


@dataclass(frozen=True)
class Objective(Checked):
    """What designs, finalists and gaits are ranked by; the policy maximises the mean return, as
    soft actor-critic does.

    With one world the return in it is all there is, as published.
    """

    kind: ObjectiveKind = "mean"
    """`mean` over the worlds, the mean less some standard deviations, or the mean over the share of
    the worlds that are worst (conditional value at risk)."""
    deviations: NotNegative = 1.0
    """How many standard deviations are taken off."""
    share: Annotated[float, Bounds(above=0.0, most=1.0)] = 0.25
    """Which share of the worlds is the worst."""
    worlds_per_design: Count = 1
    """Worlds that each design of a round walks in; all designs of a round share them."""
    evaluation_worlds: Count = 32
    """Worlds that gaits of the policy without noise are ranked in, where designs walk in several;
    always the same."""
    centring_rounds: CountOrNone = 0
    """Worlds of a round that are easy or hard for all designs are no merit of theirs: scores are
    shifted by what the round's mean differs from that over about as many rounds before; 0 for
    not."""

    @property
    def is_robust(self) -> bool:
        """Whether designs walk in several worlds each."""
        return self.worlds_per_design > 1

    @property
    def said(self) -> str:
        """What distances of ranked pairs are, for a person."""
        what = {
            "mean": "mean",
            "mean_minus_deviations": f"mean less {self.deviations:g} standard deviations",
            "worst_share": f"mean over the worst {100.0 * self.share:g} %",
        }
        return f"{what[self.kind]} of {self.evaluation_worlds} worlds"

    def of(self, distance_cm: np.ndarray) -> np.ndarray:
        """The objective [cm], (...).

        Args:
            distance_cm: Distances in worlds [cm], (..., world).
        """
        mean: np.ndarray = distance_cm.mean(axis=-1)
        if self.kind == "mean":
            return mean
        if self.kind == "mean_minus_deviations":
            if distance_cm.shape[-1] == 1:
                return mean
            lowered: np.ndarray = mean - self.deviations * distance_cm.std(axis=-1, ddof=1)
            return lowered
        return mean_of_worst(distance_cm, self.share)

    def standard_error(self, distance_cm: np.ndarray) -> np.ndarray:
        """Standard error of the objective as drawn worlds leave it [cm], (...), by the jackknife
        (Efron and Stein 1981); of the mean it is s / sqrt(n).

        Args:
            distance_cm: Distances in two worlds or more [cm], (..., world).

        Raises:
            ValueError: There is one world alone.
        """
        count = distance_cm.shape[-1]
        if count < 2:
            raise ValueError("got distances in 1 world, expected at least 2: one tells no error")
        left_out = np.stack(
            [self.of(np.delete(distance_cm, world, axis=-1)) for world in range(count)], axis=-1
        )
        error: np.ndarray = np.sqrt((count - 1) * left_out.var(axis=-1))
        return error


def mean_of_worst(values: np.ndarray, share: float) -> np.ndarray:
    """Mean over the share of smallest values, (...): conditional value at risk.

    Where the share is no whole number of values, the last counts in part (Rockafellar and Uryasev
    2002); a share of less than one value is the smallest.

    Args:
        values: (..., value).
        share: Above 0, at most 1.
    """
    ordered = np.sort(values, axis=-1)
    wanted = share * values.shape[-1]
    # What is left of the share for each value, in order.
    weights = np.clip(max(wanted, 1.0) - np.arange(values.shape[-1]), 0.0, 1.0)
    mean: np.ndarray = ordered @ weights / weights.sum()
    return mean


class RoundLevel:
    """The level that rounds' scores are centred about: their smoothed mean.

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

    def centred(self, scores_cm: np.ndarray) -> np.ndarray:
        """Scores of a round [cm], (design,), shifted to the level, which takes them up."""
        if self._round_count == 0:
            return scores_cm
        mean = float(scores_cm.mean())
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
