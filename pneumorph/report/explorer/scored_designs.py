"""Designs with what is known of each: score, probability, best gait, trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.design_distribution import gibbs
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_trajectories import recorded_trajectories
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class ScoredDesigns:
    """A design space and what a run found in it. Axis: design.

    Attributes:
        space: The designs, in the space's order.
        score_cm: Distance of each [cm], (design,); NaN where none is known.
        probability: Of each in the design distribution, (design,); None without one.
        pairs: Label (L1 ...) and distance [cm] of the best pairs, by index of the design.
        trajectories: Recorded walks with their labels, by index of the design.
        meaning: What the score is, in a sentence.
    """

    space: DesignSpace
    score_cm: np.ndarray
    probability: np.ndarray | None = None
    pairs: Mapping[int, tuple[str, float]] = field(default_factory=dict)
    trajectories: Mapping[int, Sequence[tuple[str, Trajectory]]] = field(default_factory=dict)
    meaning: str = "No scores: no run was given."

    def __post_init__(self) -> None:
        for name in ("score_cm", "probability"):
            values = getattr(self, name)
            if values is not None and np.shape(values) != (len(self.space),):
                raise ValueError(
                    f"{name} has shape {np.shape(values)}, expected ({len(self.space)},), one for "
                    "each design of the space; was it made with another space?"
                )


def unscored(space: DesignSpace) -> ScoredDesigns:
    """Return the designs of a space, nothing known of any."""
    return ScoredDesigns(space, np.full(len(space), np.nan))


def scored_by_training(run: FinishedRun) -> ScoredDesigns:
    """Return the designs of a coopt run with the distribution of its newest checkpoint.

    A score of exactly zero is that of a design which was never tried, or failed, and becomes NaN.

    Raises:
        FileNotFoundError: The run has no checkpoint.
        ArtefactError: Its checkpoints cannot be read.
        ValueError: Its space is not that of its settings.
    """
    space = run.structured("coopt.space", DesignSpace)
    arrays = load_checkpoint(run.folder / "training").arrays
    scores = arrays["distribution/scores"]
    beta = float(arrays["distribution/inverse_temperature"])
    return ScoredDesigns(
        space,
        np.where(scores == 0.0, np.nan, scores),
        gibbs(scores, beta),
        _pairs(space, run),
        meaning="Score: newest distance in training; none where a design was not tried or failed.",
    )


def scored_by_evaluation(run: FinishedRun, space: DesignSpace) -> ScoredDesigns:
    """Return a space with the distances of an evaluation's pairs.

    Raises:
        ArtefactError: The run holds no pairs, or is damaged.
        ValueError: A pair's design is not in the space.
    """
    pairs = _pairs(space, run)
    score_cm = np.full(len(space), np.nan)
    for index, (_, distance) in pairs.items():
        score_cm[index] = distance
    model = run.of_summary("model", str)
    meaning = f"Score: distance of the pairs of {run.folder}, {model} model."
    return ScoredDesigns(space, score_cm, None, pairs, meaning=meaning)


@dataclass(frozen=True)
class ScoredPair:
    """A design and how far it went [cm]."""

    design: str
    distance_cm: float


@dataclass(frozen=True)
class BestPairs:
    """What a training and an evaluation both say."""

    pairs: tuple[ScoredPair, ...]


def _pairs(space: DesignSpace, run: FinishedRun) -> dict[int, tuple[str, float]]:
    run.of_summary("pairs", list)  # a run of another kind is refused by what it is
    return {
        space.index(Design.parse(pair.design)): (f"L{rank}", pair.distance_cm)
        for rank, pair in enumerate(run.result(BestPairs).pairs, start=1)
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
