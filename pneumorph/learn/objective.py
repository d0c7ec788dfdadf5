"""What of a design's distances in several worlds counts: their mean, or how they fare at worst."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, CountOrNone, NotNegative

ObjectiveKind = Literal["mean", "mean_minus_deviations", "worst_share"]


@dataclass(frozen=True)
class Objective(Checked):
    """What designs, finalists and gaits are ranked by; the policy maximises the mean return, as
    soft actor-critic does.

    Few worlds seldom hold the bad ones: of four, the deviation is 0.92 of what it is of many, and
    the mean below which a quarter lies 0.81 of as far below the mean. Both are corrected by what
    normal distances would have, so that scores from few and from many worlds are of one measure.
    With one world the return in it is all there is, as published.

    Raises:
        ValueError: Two worlds a design, which tell next to nothing of a spread, or a number out of
            range.
    """

    kind: ObjectiveKind = "mean"
    """How the returns in several worlds become one score. `mean`: their mean.
    `mean_minus_deviations`: the mean minus `deviations` standard deviations. `worst_share`: the
    mean over the worst `share` of the worlds (conditional value at risk)."""
    deviations: NotNegative = 1.0
    """Number of standard deviations that `mean_minus_deviations` subtracts."""
    share: Annotated[float, Bounds(above=0.0, most=1.0)] = 0.25
    """Share of the worlds that counts as the worst in `worst_share`, 0 to 1."""
    worlds_per_design: Count = 1
    """Number of worlds in which each design of a round walks; all designs of a round share them."""
    evaluation_worlds: Count = 32
    """Number of worlds, always the same, in which the policy's gaits are ranked at an evaluation,
    if designs walk in several worlds."""
    nominal_until_timestep: CountOrNone = 0
    """Until this timestep of a beginning, if designs walk in several worlds, each robot of a round
    has a design of its own and walks in the nominal world: that is where gaits are found, and of
    more designs. From then on designs walk in their worlds. 0: in worlds from the first round
    on."""
    centring_rounds: CountOrNone = 0
    """Corrects scores for rounds whose worlds are easy or hard for all designs: scores are shifted
    by the difference between the round's mean over designs that did not fail and the mean of about
    this many earlier rounds; 0 for no correction. No effect on a search without learning, whose
    generations get better: that is no sign of easy worlds."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind != "mean" and self.worlds_per_design == 2:
            raise ValueError(
                f"worlds_per_design is 2, expected at least 3 for {self.kind}, or 1: two worlds "
                "tell next to nothing of a spread"
            )

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: of worlds where designs walk in one each, and
        of other kinds."""
        if not self.is_robust:
            names = ("kind", "deviations", "share", "evaluation_worlds", "nominal_until_timestep")
            why = "where designs walk in one world (--objective.worlds-per-design 1)"
            return dict.fromkeys(names, why)
        of_kinds = {"deviations": "mean_minus_deviations", "share": "worst_share"}
        return {
            name: f"without --objective.kind {kind}"
            for name, kind in of_kinds.items()
            if kind != self.kind
        }

    @property
    def is_robust(self) -> bool:
        """Whether designs walk in several worlds each."""
        return self.worlds_per_design > 1

    @property
    def first_worlds(self) -> int:
        """Number of an evaluation's worlds in which a shortlist is made: a quarter, in rounds of as
        many as each design has."""
        side_by_side = self.worlds_per_design
        return -(-self.evaluation_worlds // (4 * side_by_side)) * side_by_side

    def worlds_at(self, timestep: int) -> int:
        """Number of worlds in which each design of the round from a timestep of training on
        walks."""
        return 1 if timestep < self.nominal_until_timestep else self.worlds_per_design

    @property
    def said(self) -> str:
        """What scores of ranked pairs are, for a person."""
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
        count = distance_cm.shape[-1]
        if self.kind == "mean" or count == 1:
            return mean
        if self.kind == "mean_minus_deviations":
            deviation = distance_cm.std(axis=-1, ddof=1) / _deviation_of_normals(count)
            lowered: np.ndarray = mean - self.deviations * deviation
            return lowered
        if self.share == 1.0:
            return mean
        below = mean - mean_of_worst(distance_cm, self.share)
        return mean - below * (_worst_normals(None, self.share) / _worst_normals(count, self.share))

    def standard_error(self, distance_cm: np.ndarray) -> np.ndarray:
        """Standard error of the objective as drawn worlds leave it [cm], (...), by the jackknife
        (Efron and Stein 1981); of the mean it is s / sqrt(n). With few worlds that of others is too
        large: by some 14 % of four.

        Args:
            distance_cm: Distances in two worlds or more of a mean, in three of others [cm],
                (..., world).

        Raises:
            ValueError: There are fewer worlds.
        """
        count, least = distance_cm.shape[-1], 2 if self.kind == "mean" else 3
        if count < least:
            raise ValueError(
                f"got distances in {count} worlds, expected at least {least} for {self.kind}: "
                "fewer tell no error"
            )
        left_out = np.stack(
            [self.of(np.delete(distance_cm, world, axis=-1)) for world in range(count)], axis=-1
        )
        error: np.ndarray = np.sqrt((count - 1) * left_out.var(axis=-1))
        return error


def check_worlds_fit(environment_count: int, objective: Objective) -> None:
    """Refuse robots side by side that leave designs without some of their worlds.

    Raises:
        ValueError: They are no multiple of the worlds of each design.
    """
    if environment_count % objective.worlds_per_design:
        raise ValueError(
            f"environment_count is {environment_count}, expected a multiple of "
            f"worlds_per_design, {objective.worlds_per_design}: every design of a round "
            "walks in each of its worlds"
        )


@cache
def _deviation_of_normals(count: int) -> float:
    """Expected sample deviation of so many standard normals, c4 of statistical quality control:
    sqrt(2 / (n-1)) Gamma(n/2) / Gamma((n-1)/2)."""
    gammas = math.lgamma(0.5 * count) - math.lgamma(0.5 * (count - 1))
    return math.sqrt(2.0 / (count - 1)) * math.exp(gammas)


@cache
def _worst_normals(count: int | None, share: float) -> float:
    """How far `mean_of_worst` of so many standard normals lies below zero in expectation; None for
    the limit of many, phi(z) / q with z their q quantile."""
    from scipy.stats import beta, norm

    if count is None:
        return float(norm.pdf(norm.ppf(share)) / share)
    # The i-th smallest has the distribution function of a beta(i, n-i+1) at Phi(x).
    x = np.linspace(-9.0, 9.0, 2001)
    ranks = np.arange(1, count + 1)[:, None]
    density = beta.pdf(norm.cdf(x), ranks, count + 1 - ranks) * norm.pdf(x)
    expected = density @ x * (x[1] - x[0])
    return -float(mean_of_worst(expected, share))


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
