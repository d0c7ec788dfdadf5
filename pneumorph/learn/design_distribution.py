"""The belief over designs: a Gibbs distribution whose entropy follows a schedule.

Here each design has a score of its own; of spaces that are too large for that see
`pneumorph.learn.factored_distribution`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, CountOrNone, NotNegative, Positive
from pneumorph.learn.metrics import score_histogram

BISECTION_LIMIT = 200
"""More halvings than a float64 interval can take."""


@dataclass(frozen=True)
class EntropySchedule(Checked):
    """Entropy of the design distribution over training: how fast the choice of designs narrows.

    Designs are drawn uniformly until the decay starts. From then on the entropy falls linearly in
    the timestep to the final one.
    """

    decay_start_timestep: CountOrNone = 200_000
    """Timestep until which designs are drawn uniformly (paper, appendix A). Later: each design is
    tried more often before any is preferred."""
    decay_end_timestep: int = 950_000
    """Timestep at which the entropy reaches its final value (paper, appendix A); at most the
    training's length from a beginning, or the distribution is still wide at the end."""
    final_entropy: NotNegative = 0.0
    """Entropy at the end [nat]; about exp(entropy) designs remain, so 0 leaves one (paper, appendix
    A) and 2 about seven. Leave several if fine-tuning follows."""
    initial_score_cm: float = 0.0
    """Score of a design that has not walked yet [cm] (authors' experiment), or the mean of those
    that have where this is less: rewards of one's own may all be below it. Above what most designs
    achieve, designs that never walked are tried first."""
    maximum_inverse_temperature: Positive = 20.0
    """Highest inverse temperature beta of the Gibbs distribution [1/cm] (authors' experiment).
    Raise it only if scores differ by much less than a centimetre."""
    entropy_tolerance: Positive = 0.01
    """How close the entropy must come to its scheduled value [nat] (authors' experiment)."""

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
    """Inverse temperature at which the Gibbs distribution has a given entropy, see `matching`.

    Args:
        scores: Score of each design, shape (design,).
        target: Entropy wanted [nat].
        maximum: Highest beta.
        tolerance: Accepted distance from the target [nat].
    """
    return matching(lambda beta: entropy(gibbs(scores, beta)), target, maximum, tolerance)


def matching(
    entropy_at: Callable[[float], float], target: float, maximum: float, tolerance: float
) -> float:
    """Inverse temperature at which a distribution ``p ~ exp(beta R)`` has a given entropy, by
    bisection.

    The entropy falls as beta rises (its slope is minus beta times the variance of the scores).
    Where the target lies outside what beta in [0, maximum] can reach, the nearer end is taken:
    equal scores stay uniform whatever beta is.

    Args:
        entropy_at: Entropy at a beta [nat].
        target: Entropy wanted [nat].
        maximum: Highest beta.
        tolerance: Accepted distance from the target [nat].
    """
    if entropy_at(0.0) <= target + tolerance:
        return 0.0
    if entropy_at(maximum) >= target - tolerance:
        return maximum
    low, high = 0.0, maximum
    for _ in range(BISECTION_LIMIT):
        middle = 0.5 * (low + high)
        difference = entropy_at(middle) - target
        if abs(difference) <= tolerance:
            break
        low, high = (middle, high) if difference > 0.0 else (low, middle)
    return middle


def require_finite(values: np.ndarray, name: str) -> None:
    """Refuse values [cm] that are not finite, by their name.

    Raises:
        ValueError: One is not.
    """
    if not np.isfinite(values).all():
        place = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ValueError(f"{name}[{place}] is {values[place]}, expected finite {name} in cm")


class NominalFall:
    """By how much scores of a single world are above those of several: the mean over all designs
    that have told so far, each when it walked in several worlds for the first time.

    Attributes:
        count: How many have.
    """

    def __init__(self) -> None:
        self.count = 0

    def further_cm(self, before: np.ndarray, after: np.ndarray, among: np.ndarray) -> float:
        """Take up designs, and return how much further scores of a single world are to fall [cm],
        which have fallen by the mean so far.

        Args:
            before: Scores of designs [cm], those of a single world as far as they have fallen,
                (design,).
            after: Their scores in several worlds [cm], (design,).
            among: Which of them walk in several for the first time, (design,) bool.
        """
        first = int(among.sum())
        if first == 0:
            return 0.0
        self.count += first
        return first / self.count * float(np.mean(before[among] - after[among]))


def by_turns(count: int, orders: Iterable[Iterable[int]], twin: Callable[[int], int]) -> np.ndarray:
    """The first designs of several orders, one of each by turns, at most (count,).

    Args:
        count: How many.
        orders: Indices of designs, the best first.
        twin: Gives the same index of two designs that count as one.
    """
    found: dict[int, int] = {}
    queues = [iter(each) for each in orders]
    while queues and len(found) < count:
        queue = queues.pop(0)
        for design in queue:
            if twin(design) not in found:
                found[twin(design)] = design
                queues.append(queue)
                break
    return np.array(list(found.values()), dtype=np.int64)


class DesignDistribution:
    """Which designs to try next, given the newest return of each.

    Attributes:
        scores: Newest return of each design, or what is expected of it [cm], shape (design,).
        inverse_temperature: beta [1/cm].
        probabilities: shape (design,).
        failing: Designs whose newest episode failed, (design,) bool.
        walked: Designs that walked, (design,) bool.
        nominal: Those of them whose newest score is of a single world, (design,) bool.
    """

    def __init__(
        self, design_count: int, schedule: EntropySchedule, twin: Callable[[int], int] = int
    ) -> None:
        """Start uniform over ``design_count`` designs, all with the schedule's initial score.

        Args:
            design_count: How many designs.
            schedule: Of the entropy.
            twin: Gives the same index of two designs that count as one, such as
                `DesignSpace.twin`; by default each counts for itself.

        Raises:
            ValueError: There is no design.
        """
        if design_count < 1:
            raise ValueError(f"design_count is {design_count}, expected at least 1")
        self.schedule, self._twin = schedule, twin
        self.scores = np.full(design_count, schedule.initial_score_cm)
        self.failing = np.zeros(design_count, dtype=bool)
        self.walked = np.zeros(design_count, dtype=bool)
        self.nominal = np.zeros(design_count, dtype=bool)
        self._fall = NominalFall()
        self._untried_cm = schedule.initial_score_cm
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
        require_finite(returns, "returns")
        for design, value in zip(designs, returns, strict=True):
            self.scores[design] = value
            self.walked[design] = True

    def know(self, designs: np.ndarray, scores: np.ndarray, images: np.ndarray | None) -> None:
        """Begin with scores that are known of designs.

        Args:
            designs: Indices of the designs, (n,).
            scores: Their scores [cm], (n,).
            images: Indices of the mirror images that the scores count for as well, (n,).

        Raises:
            ValueError: A score is not finite.
        """
        none = np.zeros(len(designs), dtype=bool)
        self.take_round(designs, scores, none, images, in_worlds=True)

    def take_round(
        self,
        designs: np.ndarray,
        scores: np.ndarray,
        failing: np.ndarray,
        images: np.ndarray | None = None,
        in_worlds: bool = False,
    ) -> None:
        """Replace the scores of a round's designs.

        What a design did in a single world is no measure of what it does in several, where a sure
        one counts. So scores of single worlds fall, all of them, by as much as those did in the
        mean whose designs have walked in several since (`NominalFall`): their order stays. Designs
        that fail say nothing of it, nor those that had failed in the single world.

        Args:
            designs: Indices of the designs, (n,).
            scores: Their scores [cm], (n,).
            failing: Whether any of a design's simulations failed, (n,) bool.
            images: Indices of the mirror images that the scores count for as well, (n,).
            in_worlds: Whether each score is of several worlds.

        Raises:
            ValueError: A score is not finite.
        """
        if in_worlds:
            first = self.nominal[designs] & ~failing & ~self.failing[designs]
            self.scores[self.nominal] -= self._fall.further_cm(self.scores[designs], scores, first)
        for each in (designs,) if images is None else (images, designs):
            self.record(each, scores)
            self.failing[each] = failing
            self.nominal[each] = not in_worlds
        self._expect_no_more_of_untried()

    def _expect_no_more_of_untried(self) -> None:
        """Where designs that walked have less than the initial score in the mean, one that has not
        counts as that mean: above all of them it would be preferred for never having walked."""
        if not self.walked.any():
            return
        level_cm = min(self.schedule.initial_score_cm, float(self.scores[self.walked].mean()))
        # What more is expected of some, see `expect`, stays.
        self.scores[~self.walked & (self.scores == self._untried_cm)] = level_cm
        self._untried_cm = level_cm

    def expect(
        self, expected: Callable[[np.ndarray | None], np.ndarray], rng: np.random.Generator
    ) -> None:
        """Raise scores to what is expected of the designs that did not fail.

        Args:
            expected: Gives what is expected [cm] of designs by their indices, None for all.
            rng: Draws nothing here: all designs are asked for.
        """
        scores = expected(None)
        # Of a failure the critic knows little: it learns mostly from the steps before.
        scores[self.failing] = -np.inf
        self.raise_scores(scores)

    def candidates(
        self,
        count: int,
        value: Callable[[np.ndarray], np.ndarray] | None,
        rng: np.random.Generator,
        known: Iterable[int] = (),
    ) -> np.ndarray:
        """Indices of designs that may be the best, at most (count,); one of those that count as
        one.

        By turns the best by their newest score, by what is expected of them, and of those that
        were known: a score may be of a policy that knew little, or of unlucky worlds, and what is
        expected of a design is not what it does.

        Args:
            count: How many.
            value: What the critic expects of designs by their indices; None does not ask.
            rng: Draws nothing here: all designs are compared.
            known: Designs that were good in an earlier beginning, the best first.
        """
        orders = [-self.scores]
        if value is not None:
            # Of a failure the critic knows little: it learns mostly from the steps before.
            expected = np.where(self.failing, -np.inf, value(np.arange(len(self.scores))))
            orders.append(-expected)
        best = [np.argsort(each, kind="stable").tolist() for each in orders]
        return by_turns(count, [*best, known], self._twin)

    def said(self) -> dict[str, float | list[float]]:
        """What metrics say of the scores."""
        return {
            "expected_score_cm": float(self.probabilities @ self.scores),
            "highest_score_cm": float(self.scores.max()),
            "score_histogram": score_histogram(self.scores, self.probabilities),
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """All of the state, for a checkpoint."""
        return {
            "scores": self.scores,
            "failing": self.failing,
            "walked": self.walked,
            "nominal": self.nominal,
            "fallen_count": np.array(self._fall.count),
            "untried_cm": np.array(self._untried_cm),
            "inverse_temperature": np.array(self.inverse_temperature),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Take over what `arrays` gave.

        Raises:
            KeyError: One of them is missing.
            ValueError: They are of another number of designs.
        """
        scores = np.array(arrays["scores"], dtype=float)
        # Checkpoints of an earlier version do not tell.
        failing = np.array(arrays.get("failing", np.zeros(scores.shape)), dtype=bool)
        untried_cm = float(arrays.get("untried_cm", self.schedule.initial_score_cm))
        walked = np.array(arrays.get("walked", scores != untried_cm), dtype=bool)
        nominal = np.array(arrays.get("nominal", np.zeros(scores.shape)), dtype=bool)
        told = {"scores": scores, "failing": failing, "walked": walked, "nominal": nominal}
        for name, values in told.items():
            if values.shape != self.scores.shape:
                raise ValueError(
                    f"{name} has shape {values.shape}, expected {self.scores.shape}; the "
                    "distribution was that of other designs"
                )
        self.scores, self.failing = scores, failing
        self.walked, self.nominal, self._untried_cm = walked, nominal, untried_cm
        self._fall.count = int(arrays.get("fallen_count", 0))
        self.set_inverse_temperature(float(arrays["inverse_temperature"]))

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
