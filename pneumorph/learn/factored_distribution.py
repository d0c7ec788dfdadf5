"""The belief over designs of a space that is too large to keep a score for each.

Scores are taken to be sums over locations, ``R(d) = level + sum_s w_s[option of d at s]``, so that
the Gibbs distribution ``p ~ exp(beta R)`` (paper, equation 2) is one of paths through the
locations: a product of categoricals over sites under the space's rules. Counts of legs and of
regulators, exclusions and the canonical names of regulators are kept by masks at each location,
so nothing is drawn in vain, and entropy and its maximum, the logarithm of the number of designs,
are exact (`pneumorph.robot.choice_paths`). Memory grows with locations, options and the designs
that walked, not with the space.

The weights are those that fit the newest rounds best, by least squares within each round: a round's
worlds and its policy are the same for all of its designs, so how hard it was is no merit of any. Of
designs drawn from a product distribution, such weights are its natural gradient of the mean score
(Kakade 2002; Peters and Schaal 2008). Where new rounds say nothing of an option its weight stays.
Of designs that symmetries count as one, any may be the path that is drawn: a score counts for each
of them, all together as much as that of a design alone.

Entropy is that of the designs as they are drawn. Where a mirror image counts as well, each is
replaced by its image with probability 1/2, and designs that symmetries count as one are merged;
that changes the entropy by no more than the logarithm of the number of images.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.learn.design_distribution import (
    EntropySchedule,
    NominalFall,
    by_turns,
    matching,
    require_finite,
)
from pneumorph.learn.metrics import score_histogram
from pneumorph.robot.choice_paths import WeighedPaths
from pneumorph.robot.design_space import DesignSpace


@dataclass(frozen=True)
class FactoredSettings(Checked):
    """Weights of the factored distribution: one for each option of each location, fitted to scores
    by least squares."""

    remembered_rounds: Positive = 20.0
    """Memory of the fit, in rounds: a score this old counts 1/e (37 %) as much as a new one. Fewer
    follow an improving policy sooner, more average out noise."""
    ridge: Positive = 1.0
    """Ridge penalty on each round's change of the weights, as a number of walks of each option.
    Raise it if weights jump from round to round."""
    drawn_designs: Count = 1024
    """Designs drawn each time the critic rates designs: after a round, with --expected-scores, and
    to find the candidates of an evaluation. More cost time and miss fewer good designs."""


class FactoredDistribution:
    """Which designs to try next, given weights of the options at each location.

    Attributes:
        weights_cm: What each option adds to a score [cm], locations one after another, (option,).
        inverse_temperature: beta [1/cm].
        seen: Newest score [cm] of the designs that walked, and whether it failed, by index.
        nominal: Those of them whose newest score is of a single world.
    """

    def __init__(
        self,
        space: DesignSpace,
        schedule: EntropySchedule,
        settings: FactoredSettings | None = None,
        mirrored: bool = False,
    ) -> None:
        """Start uniform over the designs of a space.

        Args:
            space: The designs.
            schedule: How the entropy falls.
            settings: How weights follow from scores; None for the usual.
            mirrored: Whether a design and its mirror image are to be equally probable.
        """
        self.schedule, self._space, self._mirrored = schedule, space, mirrored
        self._settings = settings or FactoredSettings()
        counts = space.paths.option_counts
        self._splits = np.cumsum(counts)[:-1]
        self._first = np.concatenate([[0], self._splits])
        self.weights_cm = np.zeros(sum(counts))
        self._normal = np.zeros((sum(counts), sum(counts)))
        self._moment = np.zeros(sum(counts))
        self._level_cm = schedule.initial_score_cm
        self._mean = np.zeros(sum(counts)), self._level_cm
        self._newest_cm = np.zeros(0)
        self.seen: dict[int, tuple[float, bool]] = {}
        self.nominal: set[int] = set()
        self._fall = NominalFall()
        self.set_inverse_temperature(0.0)

    @property
    def entropy(self) -> float:
        """Entropy of the distribution [nat], before images."""
        return self._weighed.entropy

    def target_entropy(self, timestep: int) -> float:
        """Entropy the schedule wants at a timestep [nat]."""
        return self.schedule.target(timestep, self._space.paths.count)

    @property
    def weighed(self) -> WeighedPaths:
        """The distribution over options of the locations."""
        return self._weighed

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Draw designs independently; their indices, shape (count,)."""
        drawn = self._space.indices_of(self._weighed.sample(count, rng))
        if self._mirrored:
            drawn = np.where(rng.random(count) < 0.5, self._space.images(drawn)[0], drawn)
        return drawn

    def know(self, designs: np.ndarray, scores: np.ndarray, images: np.ndarray | None) -> None:
        """Begin with scores that are known of designs: they are candidates. Weights follow from
        designs that are drawn, good and bad ones, and these are all good ones.

        Args:
            designs: Indices of the designs, (n,).
            scores: Their scores [cm], (n,).
            images: Indices of their mirror images, which are known as well; one of both is a
                candidate.

        Raises:
            ValueError: A score is not finite.
        """
        require_finite(scores, "scores")
        for each in (designs,) if images is None else (images, designs):
            for design, score in zip(each, scores, strict=True):
                self.seen[int(design)] = (float(score), False)

    def take_round(
        self,
        designs: np.ndarray,
        scores: np.ndarray,
        failing: np.ndarray,
        images: np.ndarray | None = None,
        in_worlds: bool = False,
    ) -> None:
        """Take up the scores of a round's designs. Scores of single worlds fall where their designs
        walk in several, as with `DesignDistribution.take_round`.

        Args:
            designs: Indices of the designs, (n,).
            scores: Their scores [cm], (n,).
            failing: Whether any of a design's simulations failed, (n,) bool.
            images: Indices of the mirror images that the scores count for as well, (n,).
            in_worlds: Whether each score is of several worlds.

        Raises:
            ValueError: A score is not finite.
        """
        require_finite(scores, "scores")
        if in_worlds:
            self._lower_nominal(designs, scores, failing)
        for each in (designs,) if images is None else (images, designs):
            for design, score, failed in zip(each, scores, failing, strict=True):
                self.seen[int(design)] = (float(score), bool(failed))
            walked = {int(design) for design in each}
            self.nominal = self.nominal - walked if in_worlds else self.nominal | walked
        kept = np.exp(-1.0 / self._settings.remembered_rounds)
        self._normal *= kept
        self._moment *= kept
        both = designs if images is None else np.concatenate([images, designs])
        values = np.tile(scores, len(both) // len(designs))
        self._mean = self._count(both, values)
        self._newest_cm = values
        self._fit()

    def expect(
        self, expected: Callable[[np.ndarray | None], np.ndarray], rng: np.random.Generator
    ) -> None:
        """Let what the critic expects of designs count as much as a round that walked.

        Args:
            expected: Gives what is expected [cm] of designs by their indices.
            rng: Draws the designs, from the distribution as it is.
        """
        drawn = self.sample(self._settings.drawn_designs, rng)
        # Of a failure the critic knows little: it learns mostly from the steps before.
        drawn = drawn[~self._failing(drawn)]
        if len(drawn) == 0:
            return
        values = expected(drawn)
        if np.isfinite(values).all():
            self._count(drawn, values, len(self._newest_cm) / len(drawn))
            self._fit()

    def follow_schedule(self, timestep: int) -> None:
        """Set beta so that the entropy matches the schedule (algorithm 1, lines 8 and 9)."""
        self.set_inverse_temperature(
            matching(
                lambda beta: self._weighed_at(beta).entropy,
                self.target_entropy(timestep),
                self.schedule.maximum_inverse_temperature,
                self.schedule.entropy_tolerance,
            )
        )

    def set_inverse_temperature(self, value: float) -> None:
        """Set beta [1/cm] and the distribution with it."""
        self.inverse_temperature = float(value)
        self._weighed = self._weighed_at(self.inverse_temperature)

    def scores_cm(self, designs: np.ndarray) -> np.ndarray:
        """What the weights say of designs [cm], (n,), by their indices (n,)."""
        rows, design, share = self._rows(designs)
        scores: np.ndarray = self._level_cm + np.bincount(
            design, share * (rows @ self.weights_cm), len(designs)
        )
        return scores

    def probability_of(self, designs: np.ndarray) -> np.ndarray:
        """Probability of drawing designs, (n,), by their indices (n,)."""
        probability = self._alone(designs)
        if self._mirrored:
            probability = 0.5 * (probability + self._alone(self._space.images(designs)[0]))
        return probability

    def _alone(self, designs: np.ndarray) -> np.ndarray:
        """Probability without images of designs and all that are counted as one with them."""
        if not self._space.symmetries:
            return np.exp(self._weighed.log_probability(self._space.options_of(designs)))
        found = [
            np.exp(self._weighed.log_probability(self._space.options_of_members(int(design))))
            for design in designs
        ]
        return np.array([each.sum() for each in found])

    def candidates(
        self,
        count: int,
        value: Callable[[np.ndarray], np.ndarray] | None,
        rng: np.random.Generator,
        known: Iterable[int] = (),
    ) -> np.ndarray:
        """Indices of designs that may be the best, at most (count,); one of mirror images.

        By turns the best of those that walked, by their newest score, the best of those drawn from
        the distribution, by what is expected of them (those that failed last), and of those that
        were known, for the reasons of `DesignDistribution.candidates`.

        Args:
            count: How many.
            value: What the critic expects of designs by their indices; None asks the weights.
            rng: Draws the designs.
            known: Designs that were good in an earlier beginning, the best first.
        """
        walked = sorted(self.seen, key=lambda design: -self.seen[design][0])
        drawn = np.unique(self.sample(max(count, self._settings.drawn_designs), rng))
        # What is expected of a design knows nothing of its failures.
        expected = np.where(self._failing(drawn), -np.inf, (value or self.scores_cm)(drawn))
        order = np.argsort(-expected, kind="stable")
        twin = self._space.twin if self._mirrored else int
        return by_turns(count, [walked, drawn[order].tolist(), known], twin)

    def said(self) -> dict[str, float | list[float]]:
        """What metrics say of the scores: in the histogram, the designs of the newest round stand
        for the distribution that they were drawn from."""
        mean = np.concatenate(self._weighed.marginals) @ self.weights_cm
        shares = np.full(len(self._newest_cm), 1.0 / max(len(self._newest_cm), 1))
        return {
            "expected_score_cm": float(self._level_cm + mean),
            "highest_score_cm": max(score for score, _ in self.seen.values()),
            "score_histogram": score_histogram(self._newest_cm, shares),
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """All of the state, for a checkpoint."""
        scores = list(self.seen.values())
        return {
            "weights_cm": self.weights_cm,
            "normal": self._normal,
            "moment": self._moment,
            "level_cm": np.array(self._level_cm),
            "newest_cm": self._newest_cm,
            "seen": np.array(list(self.seen), dtype=np.int64),
            "seen_cm": np.array([score for score, _ in scores]),
            "failing": np.array([failed for _, failed in scores], dtype=bool),
            "nominal": np.array(sorted(self.nominal), dtype=np.int64),
            "fallen_count": np.array(self._fall.count),
            "inverse_temperature": np.array(self.inverse_temperature),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Take over what `arrays` gave."""
        self.weights_cm, self._normal, self._moment, self._newest_cm = (
            np.array(arrays[name]) for name in ("weights_cm", "normal", "moment", "newest_cm")
        )
        self._level_cm = float(arrays["level_cm"])
        self._mean = np.zeros_like(self.weights_cm), self._level_cm  # until the next round
        names = ("seen", "seen_cm", "failing")
        self.seen = {
            int(design): (float(score), bool(failed))
            for design, score, failed in zip(*(arrays[name] for name in names), strict=True)
        }
        self.nominal = {int(each) for each in arrays.get("nominal", ())}
        self._fall.count = int(arrays.get("fallen_count", 0))
        self.set_inverse_temperature(float(arrays["inverse_temperature"]))

    def _lower_nominal(self, designs: np.ndarray, scores: np.ndarray, failing: np.ndarray) -> None:
        before = np.array([self.seen.get(int(each), (0.0, False))[0] for each in designs])
        first = np.array([int(each) in self.nominal for each in designs], dtype=bool)
        told = first & ~failing & ~self._failing(designs)
        fall_cm = self._fall.further_cm(before, scores, told)
        for design in self.nominal:
            score, failed = self.seen[design]
            self.seen[design] = (score - fall_cm, failed)

    def _failing(self, designs: np.ndarray) -> np.ndarray:
        """Whether the newest walk of designs failed, (n,) bool, by their indices (n,)."""
        return np.array([self.seen.get(int(each), (0.0, False))[1] for each in designs], dtype=bool)

    def _weighed_at(self, beta: float) -> WeighedPaths:
        return WeighedPaths(self._space.paths, np.split(beta * self.weights_cm, self._splits))

    def _rows(self, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A row for each design, and for each that symmetries count as one with it: one for each
        option that it has, else zero, (row, option). Also the place in `designs` that each row
        belongs to, (row,), and its share of that design, (row,)."""
        options, counts = self._space.options_of(designs), np.ones(len(designs), dtype=np.int64)
        if self._space.symmetries:
            different, places = np.unique(designs, return_inverse=True)
            found = [self._space.options_of_members(int(each)) for each in different]
            members = [found[place] for place in places]
            options, counts = np.concatenate(members), np.array([len(each) for each in members])
        rows = np.zeros((len(options), len(self.weights_cm)))
        np.put_along_axis(rows, options + self._first, 1.0, axis=1)
        return rows, np.repeat(np.arange(len(designs)), counts), np.repeat(1.0 / counts, counts)

    def _count(
        self, designs: np.ndarray, values: np.ndarray, weight: float = 1.0
    ) -> tuple[np.ndarray, float]:
        """Let values of designs count, all of them from the same unknown level; their mean row,
        (option,), and their mean value."""
        rows, design, share = self._rows(designs)
        row, value = np.average(rows, axis=0, weights=share), float(values.mean())
        root = np.sqrt(share)
        centred = root[:, np.newaxis] * (rows - row)
        self._normal += weight * centred.T @ centred
        self._moment += weight * centred.T @ (root * (values - value)[design])
        return row, value

    def _fit(self) -> None:
        """Move the weights to the least squares of what counts and of their own change, and the
        level with them: scores have the mean of the newest round."""
        lacking = self._moment - self._normal @ self.weights_cm
        damped = self._normal + self._settings.ridge * np.eye(len(lacking))
        self.weights_cm = self.weights_cm + np.linalg.solve(damped, lacking)
        row, value = self._mean
        self._level_cm = float(value - row @ self.weights_cm)
