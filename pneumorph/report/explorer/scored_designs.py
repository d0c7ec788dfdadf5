"""Designs with what is known of each: score, probability, best gait, trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import reading
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.learn.checkpoint import KIND, load_checkpoint
from pneumorph.learn.design_distribution import gibbs
from pneumorph.learn.factored_distribution import FactoredDistribution
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.report.physics_words import MEAN_OVER_WORLDS, Simulated, physics_of, walked_in
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_trajectories import recorded_trajectories
from pneumorph.trajectory import Trajectory

SHOWN_COUNT = 500
"""Designs that are drawn from a space of more than can be listed."""


@dataclass(frozen=True, eq=False)
class ScoredDesigns:
    """Designs of a space and what a run found of them. Axis: design.

    Attributes:
        space: The designs.
        score_cm: Reward of each [cm], (design,), which is its distance where forward is the goal;
            NaN where none is known.
        probability: Of each in the design distribution, (design,); None without one.
        pairs: Label (L1 ...) of the best pairs and what they achieve [the goal's unit], by index of
            the design.
        trajectories: Recorded walks with their labels, by index of the design.
        meaning: What the score is, in a sentence.
        indices: Indices of the designs in the space, (design,); None for all, in its order.
        goal: What they are to do.
        of_pairs: What the pairs' numbers are, where they are not of one walk.
    """

    space: DesignSpace
    score_cm: np.ndarray
    probability: np.ndarray | None = None
    pairs: Mapping[int, tuple[str, float]] = field(default_factory=dict)
    trajectories: Mapping[int, Sequence[tuple[str, Trajectory]]] = field(default_factory=dict)
    meaning: str = "No scores: no run was given."
    indices: np.ndarray | None = None
    goal: Goal = FORWARD
    of_pairs: str = ""

    def __post_init__(self) -> None:
        count = len(self.space) if self.indices is None else len(self.indices)
        for name in ("score_cm", "probability"):
            values = getattr(self, name)
            if values is not None and np.shape(values) != (count,):
                raise ValueError(
                    f"{name} has shape {np.shape(values)}, expected ({count},), one for "
                    "each design of the space; was it made with another space?"
                )

    @property
    def designs(self) -> list[Design]:
        """Each design."""
        if self.indices is None:
            return list(self.space)
        return [self.space[int(index)] for index in self.indices]

    @property
    def is_symmetric(self) -> np.ndarray:
        """Whether a design is its own mirror image but for the names of its regulators, (design,)
        bool; also where it counts as one with an image that is another."""
        if "mirror" in self.space.symmetries:
            return np.array([self.space.has_own_form(design) for design in self.designs])
        if self.indices is None:
            return self.space.mirror_index == np.arange(len(self.space))
        return self.space.images(self.indices)[0] == self.indices

    def place(self, index: int) -> int | None:
        """Place of a design of the space among these; None where it is none of them."""
        return index if self.indices is None else self._places.get(index)

    @cached_property
    def _places(self) -> dict[int, int]:
        return {} if self.indices is None else {int(i): at for at, i in enumerate(self.indices)}


def unscored(space: DesignSpace) -> ScoredDesigns:
    """Return the designs of a space, nothing known of any; some that are drawn at random where
    there are too many to list."""
    if space.is_listed:
        return ScoredDesigns(space, np.full(len(space), np.nan))
    indices = np.unique(space.drawn(SHOWN_COUNT, np.random.default_rng(0)))
    return ScoredDesigns(
        space,
        np.full(len(indices), np.nan),
        meaning=f"No scores: no run was given. These are {len(indices)} of {len(space)} designs, "
        "drawn at random.",
        indices=indices,
    )


def scored_by_training(run: FinishedRun) -> ScoredDesigns:
    """Return the designs of a coopt run with the distribution of its newest checkpoint; of a
    factored one those that walked, and their mirror images where these count as well.

    A score is of a walk, where designs walk in several worlds of one in these: of designs that did
    not walk the checkpoint has what is expected of any. A best pair has what ranked it at the end.

    Raises:
        FileNotFoundError: The run has no checkpoint.
        ArtefactError: Its checkpoints cannot be read.
        ValueError: Its space is not that of its settings.
    """
    space = run.structured("coopt.space", DesignSpace)
    settings = run.structured("coopt", CooptSettings)
    checkpoint = load_checkpoint(run.folder / "training")
    arrays = checkpoint.arrays
    with reading(checkpoint.path, KIND):
        if "distribution/seen" in arrays:
            return _scored_by_factors(run, space, settings, arrays)
        scores = arrays["distribution/scores"]
        beta = float(arrays["distribution/inverse_temperature"])
        tried = _tried(arrays, settings.objective)
    score_cm = np.where(tried, scores, np.nan)
    for index, score in _evaluated_scores(space, run).items():
        score_cm[index] = score
    return ScoredDesigns(
        space,
        score_cm,
        gibbs(scores, beta),
        _pairs(space, run),
        meaning=f"{_meaning(run, settings)} {_where(run)}".strip(),
        goal=run.goal,
        of_pairs=_of_pairs(settings),
    )


def _tried(arrays: Mapping[str, np.ndarray], objective: Objective) -> np.ndarray:
    """Which designs have a score of a walk that counts, (design,) bool."""
    scores = arrays["distribution/scores"]
    if "distribution/walked" not in arrays:
        # Of an earlier version, in which a design that was not tried, or failed, has zero.
        return np.asarray(scores != 0.0)
    tried = arrays["distribution/walked"] & ~arrays["distribution/failing"]
    if objective.is_robust and "distribution/nominal" in arrays:
        tried = tried & ~arrays["distribution/nominal"]
    return np.asarray(tried)


def _meaning(run: FinishedRun, settings: CooptSettings) -> str:
    """What the scores of a training are: in its rounds designs walk in fewer worlds than those
    that rank the best pairs at the end."""
    told, objective = run.summary.get("ranked_by"), settings.objective
    at_end = told if isinstance(told, str) else run.goal.label
    in_rounds = at_end
    if objective.is_robust:
        of_round = replace(objective, evaluation_worlds=objective.worlds_per_design)
        in_rounds = at_end.replace(objective.said, of_round.said)
    raised = settings.expected_scores and not settings.is_factored
    more = ", or what the critic expects where that is more" if raised else ""
    ranked = "what ranked it at the end" + ("" if at_end == in_rounds else f", {at_end}")
    single = ", or walked last in a single world" if objective.is_robust else ""
    centred = objective.is_robust and objective.centring_rounds > 0
    shifted = ", less how easy its round was for all designs" if centred else ""
    return (
        f"Score: newest {in_rounds} in training{shifted}{more}; of a best pair {ranked}. None "
        f"where a design did not walk, or failed{single}."
    )


def _of_pairs(settings: CooptSettings) -> str:
    return MEAN_OVER_WORLDS if settings.objective.is_robust else ""


def _where(run: FinishedRun) -> str:
    """Where the robots of a training walked, in a sentence."""
    return walked_in(physics_of(run.result(Simulated)), run.has_drawn_worlds)


def _scored_by_factors(
    run: FinishedRun,
    space: DesignSpace,
    settings: CooptSettings,
    arrays: Mapping[str, np.ndarray],
) -> ScoredDesigns:
    distribution = FactoredDistribution(
        space, settings.schedule, settings.factored, settings.mirrored_scores
    )
    distribution.restore(
        {
            name.removeprefix("distribution/"): values
            for name, values in arrays.items()
            if name.startswith("distribution/")
        }
    )
    pairs = _pairs(space, run)
    seen, left_out = distribution.seen, set[int]()
    if settings.objective.is_robust:
        left_out = distribution.nominal
    scores = {design: np.nan for design in pairs}
    for design, (score, failed) in seen.items():
        if not failed and design not in left_out:
            scores[design] = score
        else:
            scores.setdefault(design, np.nan)
        if settings.mirrored_scores:
            image = int(space.images(np.array([design]))[0][0])
            if image not in seen or image in left_out:
                scores[image] = scores[design]
    scores |= _evaluated_scores(space, run)
    indices = np.array(sorted(scores))
    return ScoredDesigns(
        space,
        np.array([scores[index] for index in indices.tolist()]),
        distribution.probability_of(indices),
        pairs,
        goal=run.goal,
        meaning=f"{_meaning(run, settings)} These are {len(indices)} designs that walked or whose "
        f"mirror image did, of {len(space):.3g}. {_where(run)}".strip(),
        indices=indices,
        of_pairs=_of_pairs(settings),
    )


def scored_by_evaluation(run: FinishedRun, space: DesignSpace) -> ScoredDesigns:
    """Return a space with the distances of an evaluation's pairs.

    Raises:
        ArtefactError: The run holds no pairs, or is damaged.
        ValueError: A pair's design is not in the space.
    """
    pairs = _pairs(space, run)
    indices = None if space.is_listed else np.array(sorted(pairs))
    known = np.arange(len(space)) if indices is None else indices
    goal = run.result(BestPairs).goal
    score_cm = np.array([pairs.get(int(index), ("", np.nan))[1] for index in known])
    score_cm = score_cm * goal.cm_per_unit
    model = run.of_summary("model", str)
    where = walked_in(physics_of(run.result(Simulated)))
    meaning = f"Score: {goal.label} of the pairs of {run.folder}, {model} model. {where}".strip()
    return ScoredDesigns(space, score_cm, None, pairs, meaning=meaning, indices=indices, goal=goal)


@dataclass(frozen=True)
class ScoredPair:
    """A design, how far it went [cm], what of the goal it achieved [its unit], and what it was
    ranked by [cm]; None in runs of earlier versions."""

    design: str
    distance_cm: float
    achieved: float | None = None
    score_cm: float | None = None


@dataclass(frozen=True)
class BestPairs:
    """What a training and an evaluation both say."""

    pairs: tuple[ScoredPair, ...]
    goal: Goal = FORWARD


def _pairs(space: DesignSpace, run: FinishedRun) -> dict[int, tuple[str, float]]:
    run.of_summary("pairs", list)  # a run of another kind is refused by what it is
    found = run.result(BestPairs)
    achieved = [found.goal.of_pair(pair) for pair in found.pairs]
    return {
        space.index(Design.parse(pair.design)): (f"L{rank}", np.nan if far is None else far)
        for rank, (pair, far) in enumerate(zip(found.pairs, achieved, strict=True), start=1)
    }


def _evaluated_scores(space: DesignSpace, run: FinishedRun) -> dict[int, float]:
    """What the best pairs of a training were ranked by, by index of their design [cm]."""
    return {
        space.index(Design.parse(pair.design)): pair.score_cm
        for pair in run.result(BestPairs).pairs
        if pair.score_cm is not None
    }


def recorded_walks(
    space: DesignSpace, folders: Sequence[Path]
) -> dict[int, list[tuple[str, Trajectory]]]:
    """Return the trajectories in run folders by index of their design, with labels.

    Trajectories without nodes, and those of designs that are not in the space, are left out.
    """
    found: dict[int, list[tuple[str, Trajectory]]] = {}
    for folder in folders:
        for group in recorded_trajectories(folder).values():
            for label, trajectory in group.items():
                name = trajectory.metadata.get("design")
                if trajectory.node_positions_mm is None or not isinstance(name, str):
                    continue
                try:
                    index = space.index(Design.parse(name))
                except ValueError:
                    continue
                found.setdefault(index, []).append((label, trajectory))
    return found
