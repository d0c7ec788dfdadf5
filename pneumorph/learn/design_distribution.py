"""The belief over designs: a Gibbs distribution whose entropy follows a schedule."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, CountOrNone, NotNegative, Positive

BISECTION_LIMIT = 200
"""More halvings than a float64 interval can take."""


@dataclass(frozen=True)
class EntropySchedule(Checked):
    """Entropy of the design distribution over training; the defaults are the paper's.

    Uniform until the decay starts, then linear in the timestep down to the final entropy.
    """

    decay_start_timestep: CountOrNone = 200_000
    """Timestep until which designs are drawn uniformly (paper, appendix A)."""
    decay_end_timestep: int = 950_000
    """Timestep from which the entropy is the final one (paper, appendix A)."""
    final_entropy: NotNegative = 0.0
    """Entropy at the end [nat]; 0 leaves a single design (paper, appendix A)."""
    initial_score_cm: float = 0.0
    """Score of a design that has not walked yet [cm] (authors' experiment)."""
    maximum_inverse_temperature: Positive = 20.0
    """Highest beta that is tried [1/cm] (authors' experiment)."""
    entropy_tolerance: Positive = 0.01
    """How near the entropy must come to its target [nat] (authors' experiment)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.decay_start_timestep >= self.decay_end_timestep:
            raise ValueError(
                f"entropy decays from timestep {self.decay_start_timestep} to "
                f"{self.decay_end_timestep}, expected 0 <= start < end"
            )

    def target(self, timestep: int, design_count: int) -> float:
        """Entropy to be had at a timestep [nat]: from log(design_count) linearly to the end's."""
        span = self.decay_end_timestep - self.decay_start_timestep
        progress = min(max((timestep - self.decay_start_timestep) / span, 0.0), 1.0)
        highest = math.log(design_count)
        return highest + progress * (min(self.final_entropy, highest) - highest)


def gibbs(scores: np.ndarray, inverse_temperature: float) -> np.ndarray:
    """Gibbs distribution ``p ~ exp(beta R)`` (paper, equation 2).

    Args:
        scores: Score R of each design, shape (design,).
        inverse_temperature: beta, in 1 / unit of the scores.

    Returns:
        Probabilities, shape (design,).
    """
    # The highest score is subtracted so that no exponential overflows.
    weights = np.exp(inverse_temperature * (scores - scores.max()))
    return weights / weights.sum()


def entropy(probabilities: np.ndarray) -> float:
    """Entropy ``-sum p log p`` [nat]; designs of probability zero add nothing."""
    positive = probabilities[probabilities > 0.0]
    return float(-np.sum(positive * np.log(positive)))


def match_entropy(
    scores: np.ndarray, target: float, maximum: float = 20.0, tolerance: float = 0.01
) -> float:
    """Inverse temperature at which the Gibbs distribution has a given entropy, by bisection.

    The entropy falls as beta rises (its slope is minus beta times the variance of the scores).
    Where the target lies outside what beta in [0, maximum] can reach, the nearer end is taken:
    equal scores stay uniform whatever beta is.

    Args:
        scores: Score of each design, shape (design,).
        target: Entropy wanted [nat].
        maximum: Highest beta.
        tolerance: Accepted distance from the target [nat].
    """
    if entropy(gibbs(scores, 0.0)) <= target + tolerance:
        return 0.0
    if entropy(gibbs(scores, maximum)) >= target - tolerance:
        return maximum
    low, high = 0.0, maximum
    for _ in range(BISECTION_LIMIT):
        middle = 0.5 * (low + high)
        difference = entropy(gibbs(scores, middle)) - target
        if abs(difference) <= tolerance:
            break
        low, high = (middle, high) if difference > 0.0 else (low, middle)
    return middle


class DesignDistribution:
    """Which designs to try next, given the newest return of each.

    Attributes:
        scores: Newest return of each design, or what is expected of it [cm], shape (design,).
        inverse_temperature: beta [1/cm].
        probabilities: shape (design,).
    """

    def __init__(self, design_count: int, schedule: EntropySchedule) -> None:
        """Start uniform over ``design_count`` designs, all with the schedule's initial score."""
        if design_count < 1:
            raise ValueError(f"design_count is {design_count}, expected at least 1")
        self.schedule = schedule
        self.scores = np.full(design_count, schedule.initial_score_cm)
        self.inverse_temperature = 0.0
        self.probabilities = gibbs(self.scores, 0.0)

    @property
    def entropy(self) -> float:
        """Entropy of the distribution [nat]."""
        return entropy(self.probabilities)

    def target_entropy(self, timestep: int) -> float:
        """Entropy the schedule wants at a timestep [nat]."""
        return self.schedule.target(timestep, len(self.scores))

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw designs independently; their indices, shape (count,)."""
        cumulative = np.cumsum(self.probabilities)
        draws = rng.random(count) * cumulative[-1]
        # A draw may round up to the whole sum, which belongs to no design.
        return np.minimum(np.searchsorted(cumulative, draws, side="right"), len(cumulative) - 1)

    def record(self, designs: np.ndarray, returns: np.ndarray) -> None:
        """Replace the scores of designs, shape (n,), by their newest returns [cm], shape (n,).

        Where a design occurs more than once the last of its returns stays.

        Raises:
            ValueError: A return is not finite.
        """
        if not np.isfinite(returns).all():
            place = int(np.flatnonzero(~np.isfinite(returns))[0])
            raise ValueError(f"returns[{place}] is {returns[place]}, expected finite returns in cm")
        for design, value in zip(designs, returns, strict=True):
            self.scores[design] = value

    def raise_scores(self, expected: np.ndarray) -> None:
        """Raise scores to what is expected of the designs now [cm], shape (design,).

        A design that never walked, or did so when the policy knew less, is not held back by that.
        """
        self.scores = np.maximum(self.scores, expected)

    def follow_schedule(self, timestep: int) -> None:
        """Set beta so that the entropy matches the schedule (algorithm 1, lines 8 and 9)."""
        self.set_inverse_temperature(
            match_entropy(
                self.scores,
                self.target_entropy(timestep),
                self.schedule.maximum_inverse_temperature,
                self.schedule.entropy_tolerance,
            )
        )

    def set_inverse_temperature(self, value: float) -> None:
        """Set beta [1/cm] and the probabilities with it."""
        self.inverse_temperature = float(value)
        self.probabilities = gibbs(self.scores, self.inverse_temperature)
