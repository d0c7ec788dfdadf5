"""What is certified: pairs of a training, the expert beside them, and the worlds of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, CountOrNone, Positive
from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import Goal
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.coopt_result import KeptPair
from pneumorph.learn.evaluation import EVALUATION_SEED
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import worlds_of_round
from pneumorph.study.finished_run import FinishedRun, Pair

LEAST_WORLD_COUNT = 4
"""Worlds that a band can be told from."""


@dataclass(frozen=True)
class RoundSettings(Checked):
    """Rounds of a full certificate. In each, the leg is reduced again with the walks in which
    reduced robots and finite elements disagreed, and the pairs are fine-tuned on it and walk
    again."""

    limit: CountOrNone = 2
    """Largest number of rounds; 0 only reports where the two models disagree."""
    budget_s: Positive = 43_200.0
    """No round begins once finite-element walks, reductions and fine-tuning have taken this long
    together [s]; one that has begun is finished."""


@dataclass(frozen=True)
class CertificateSettings(Checked):
    """Which pairs are certified, in which worlds, and whether as finite elements too."""

    pair_count: Count = 5
    """Number of best pairs to certify."""
    world_count: Annotated[int, Bounds(least=LEAST_WORLD_COUNT)] = 200
    """Number of unseen worlds in which the pairs walk; the reported bands are percentiles over
    them. More make the bands sharper and take longer."""
    world_seed: CountOrNone = 0
    """Seed of the unseen worlds. They are never those of a training, whatever its seed."""
    tuning_world_count: Count = 24
    """Number of the training's worlds in which the expert's phase is tuned, by its mean distance
    there."""
    cycle_s: Annotated[float, Bounds(above=0.0)] = 4.0
    """Length of a gait cycle [s]; the slide back is counted within each."""
    full: bool = False
    """Also walk as finite elements: the best pair in the nominal world and in its worst worlds, the
    other pairs in the nominal world. Takes hours; finished walks are kept."""
    worst_world_count: CountOrNone = 2
    """In how many of its worst worlds the best pair walks as finite elements."""
    rounds: RoundSettings = field(default_factory=RoundSettings)
    """With --full: where reduced robots and finite elements disagree, the leg is reduced again with
    these walks among its snapshots, and the pairs are fine-tuned on it and walk again."""
    randomisation: Randomisation = field(default_factory=measured_worlds)

    def __post_init__(self) -> None:
        super().__post_init__()
        usual = {"rounds": RoundSettings(), "worst_world_count": type(self).worst_world_count}
        for name, value in usual.items():
            if not self.full and getattr(self, name) != value:
                raise ValueError(
                    f"{name} is {getattr(self, name)}, expected it to be left out without --full "
                    "(--certify of coopt): it is of finite elements and would be ignored"
                )


@dataclass(frozen=True, eq=False)
class Candidates:
    """What is certified.

    Attributes:
        run: Folder of the training.
        pairs: Its best pairs, the best first.
        task: What they were asked to do.
        baseline: The expert's gaits.
        seen: Worlds of the training, to choose in.
        ranked_there: Whether the training ranked its pairs in them.
        drawn: What its worlds were drawn from; where it did not rank over worlds, what the
            certificate's are drawn from.
        seen_mean: What the pairs achieve in the training's worlds in the mean [unit of the task's
            goal], (pair,), where it has just ranked them there; None where nobody tells.
        own_task: What the training's task was called, where it was none of the package's: its
            reward is not known here.
    """

    run: Path
    pairs: tuple[Pair, ...]
    task: CrawlingTask
    baseline: PhaseSweepSettings
    seen: tuple[World, ...]
    ranked_there: bool
    drawn: Randomisation
    seen_mean: np.ndarray | None = None
    own_task: str | None = None

    @classmethod
    def of_run(cls, run: FinishedRun, settings: CertificateSettings) -> Candidates:
        """Those of a finished run; raises as `FinishedRun.pairs`."""
        objective, drawn, seed = run.objective, settings.randomisation, 0
        if run.worlds is not None and objective is not None and objective.is_robust:
            drawn, seed = run.worlds, run.of_summary("seed", int)
        seen, ranked = worlds_of_training(objective, drawn, seed, settings)
        pairs = tuple(run.pairs(settings.pair_count))
        own = run.own_task
        return cls(
            run.folder, pairs, run.task, run.baseline, tuple(seen), ranked, drawn, own_task=own
        )

    @classmethod
    def of_training(
        cls,
        pairs: Sequence[KeptPair],
        run: Path,
        settings: CooptSettings,
        baseline: PhaseSweepSettings,
        drawn: Randomisation | None,
        certificate: CertificateSettings,
        own_task: str | None = None,
    ) -> Candidates:
        """Those of a training that has just ended, before its summary is written.

        Args:
            pairs: Its pairs, the best first.
            run: The run's folder.
            settings: What it was trained with.
            baseline: The expert's gaits.
            drawn: What its worlds were drawn from; None for one world.
            certificate: How many pairs, and which worlds otherwise.
            own_task: What its task was called; None for one of the package's.
        """
        robust, task = settings.objective.is_robust, settings.task
        drawn = drawn if drawn is not None and robust else certificate.randomisation
        seen, ranked = worlds_of_training(settings.objective, drawn, settings.seed, certificate)
        limits = (task.minimum_pressure_kPa, task.maximum_pressure_kPa)
        chosen = [
            Pair(
                Design.parse(each.design),
                f"{TRAINING_FOLDER}/{each.gait}",
                read_gait(run / TRAINING_FOLDER / each.gait, *limits)[0],
                each.distance_cm,
                each.achieved,
            )
            for each in pairs[: certificate.pair_count]
        ]
        seen_mean = np.array([pair.achieved for pair in chosen]) if ranked else None
        return cls(
            run, tuple(chosen), task, baseline, tuple(seen), ranked, drawn, seen_mean, own_task
        )


def unseen_worlds(randomisation: Randomisation, count: int, seed: int) -> list[World]:
    """Worlds that no training of any seed draws: theirs have seeds of two numbers."""
    rng = np.random.default_rng([seed, 11, 1])
    return [randomisation.draw(rng) for _ in range(count)]


def worlds_of_training(
    objective: Objective | None, drawn: Randomisation, seed: int, settings: CertificateSettings
) -> tuple[list[World], bool]:
    """Worlds to choose in, and whether a training ranked its pairs in them.

    Args:
        objective: What the training ranked designs by; None for no training.
        drawn: What its worlds were drawn from.
        seed: Its seed.
        settings: Say what else worlds are drawn from, where it was trained in one.
    """
    if objective is None or not objective.is_robust:
        rng = np.random.default_rng([settings.world_seed, 13, 1])
        count = settings.tuning_world_count
        return [settings.randomisation.draw(rng) for _ in range(count)], False
    side_by_side = objective.worlds_per_design
    rounds = -(-objective.evaluation_worlds // side_by_side)
    worlds = [
        world
        for number in range(rounds)
        for world in worlds_of_round(drawn, seed, EVALUATION_SEED + number, side_by_side)
    ]
    return worlds[: objective.evaluation_worlds], True


def own_task_notes(own_task: str | None, goal: Goal, trained: bool = False) -> list[str]:
    """What to say where pairs were trained for a reward that is not known here.

    Args:
        own_task: What the task was called; None for one of the package's.
        goal: What they are told by, and ranked where they are.
        trained: Whether their order is that of the training.
    """
    if own_task is None:
        return []
    if trained:
        return [f"ranked as in the training, by the reward of {own_task}; told is {goal.label}"]
    return [
        f"ranked by {goal.label}: {own_task}, the task that was learned, is in no file of the run"
    ]
