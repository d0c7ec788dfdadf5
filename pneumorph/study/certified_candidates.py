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


@dataclass(frozen=True)
class RoundSettings(Checked):
    """How long a leg is reduced again where it parts from its finite elements."""

    limit: CountOrNone = 2
    """At most so many new reductions; 0 for none, only to see where the two models part."""
    budget_s: Positive = 43_200.0
    """No further one is begun once walks of finite elements, reductions and fine-tuning have taken
    so long [s]."""


@dataclass(frozen=True)
class CertificateSettings(Checked):
    """Which pairs, in which worlds, and whether as finite elements too."""

    pair_count: Count = 5
    """How many of the best pairs."""
    world_count: Annotated[int, Bounds(least=4)] = 200
    """Worlds that nothing was chosen in, which bands are of."""
    world_seed: CountOrNone = 0
    """Seed of these worlds; those of trainings are drawn otherwise for every seed."""
    tuning_world_count: Count = 24
    """Worlds of the training that the expert's phase is tuned in, for its own mean."""
    cycle_s: Annotated[float, Bounds(above=0.0)] = 4.0
    """Length of a cycle, over which a slide back is counted [s]."""
    full: bool = False
    """Walk as finite elements as well: the best pair in the world as it stands and in its worst
    ones, the others in the former. Hours; what was walked is kept."""
    worst_world_count: CountOrNone = 2
    """How many of the worst worlds."""
    rounds: RoundSettings = field(default_factory=RoundSettings)
    """Where the two models part, the leg is reduced again with these walks among its snapshots, the
    pairs' designs are fine-tuned on it, and walk again."""
    randomisation: Randomisation = field(default_factory=measured_worlds)


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
    """

    run: Path
    pairs: tuple[Pair, ...]
    task: CrawlingTask
    baseline: PhaseSweepSettings
    seen: tuple[World, ...]
    ranked_there: bool
    drawn: Randomisation
    seen_mean: np.ndarray | None = None

    @classmethod
    def of_run(cls, run: FinishedRun, settings: CertificateSettings) -> Candidates:
        """Those of a finished run; raises as `FinishedRun.pairs`."""
        objective, drawn, seed = run.objective, settings.randomisation, 0
        if run.worlds is not None and objective is not None and objective.is_robust:
            drawn, seed = run.worlds, run.of_summary("seed", int)
        seen, ranked = worlds_of_training(objective, drawn, seed, settings)
        pairs = tuple(run.pairs(settings.pair_count))
        return cls(run.folder, pairs, run.task, run.baseline, tuple(seen), ranked, drawn)

    @classmethod
    def of_training(
        cls,
        pairs: Sequence[KeptPair],
        run: Path,
        settings: CooptSettings,
        baseline: PhaseSweepSettings,
        drawn: Randomisation | None,
        certificate: CertificateSettings,
    ) -> Candidates:
        """Those of a training that has just ended, before its summary is written.

        Args:
            pairs: Its pairs, the best first.
            run: The run's folder.
            settings: What it was trained with.
            baseline: The expert's gaits.
            drawn: What its worlds were drawn from; None for one world.
            certificate: How many pairs, and which worlds otherwise.
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
        return cls(run, tuple(chosen), task, baseline, tuple(seen), ranked, drawn, seen_mean)


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
