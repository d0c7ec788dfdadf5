"""What a training found beside what shares nothing with learning: uniform robots under the expert's
gait, and searches with as much simulated time, all in the same unseen worlds.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_identity import reduction_digest, resume_identity
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.evaluation import evaluation_timesteps
from pneumorph.learn.failed_walks import counted_walks
from pneumorph.learn.genetic_algorithm import GeneticSettings
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.study.certified_candidates import (
    CertificateSettings,
    unseen_worlds,
    worlds_of_training,
)
from pneumorph.study.certified_pairs import Band, share_beyond
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.run_beside_search import PAIRS_OF_RUN
from pneumorph.study.search import search
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_result import TrainingResult

Method = Literal["gaits", "genetic", "random"]
METHODS: tuple[Method, ...] = ("gaits", "genetic", "random")

WORLDS = 200
"""Unseen ones, as many as certificates have where nothing else is asked for."""

_GENERATIONS = 6
"""As many at least, where the time is short: one of random candidates and a few of children."""

_SCREENING_WORLDS = 4
"""Worlds of the training that all uniform robots walk in; the best of them walk in all."""
_BEST_OF_SCREENING = 6

_SAID_NOW = ("leg", "identity", "calibration")
"""What rivals that earlier versions kept do not say."""


@dataclass(frozen=True, eq=False)
class Contender:
    """A design and its gait, and what they took.

    Attributes:
        method: ``learned``, ``uniform``, ``by_hand`` or a search's.
        seed: Of the training beside which it stands.
        timesteps: Actions of all robots that were spent on it; of a training that does not say
            what its evaluations took, and of searches beside it, without walks that ranked gaits.
        wall_s: Wall time of that [s]; of a training without its baseline and its certificate.
        design: The design.
        gait: The gait.
        gait_file: Where its gait lies; None of the expert's.
        score_cm: What it was chosen for, in the training's worlds [cm].
    """

    method: str
    seed: int
    timesteps: int
    wall_s: float
    design: Design
    gait: OpenLoopGait
    gait_file: Path | None
    score_cm: float | None

    def walked(self, run: FinishedRun, folder: RunFolder, world_count: int = WORLDS) -> np.ndarray:
        """What of the goal it achieves in unseen worlds [its unit], (world,); NaN where it
        failed."""
        worlds = unseen_worlds(worlds_of(run), world_count, 0)
        steps = run.task.settling_step_count
        achieved, *_ = walks_in_worlds(
            run.spec(), [self.design], [self.gait], worlds, steps, folder, run.goal
        )
        found: np.ndarray = achieved[:, 0]
        return found


@dataclass(frozen=True)
class Found:
    """What a method found, in the unseen worlds."""

    method: str
    """``learned``, or a search's."""
    seed: int
    timesteps: int
    design: str
    band: Band
    share_beyond_expert: float
    """Share of the worlds in which it goes further than the expert's robot does there."""

    @classmethod
    def of(cls, contender: Contender, achieved: np.ndarray, expert: np.ndarray) -> Found:
        """By what it and the expert's robot achieve in the worlds, each (world,)."""
        return cls(
            contender.method,
            contender.seed,
            contender.timesteps,
            str(contender.design),
            Band.of(achieved),
            share_beyond(achieved, expert),
        )


def learned(run: FinishedRun) -> Contender:
    """The best pair of a training."""
    pair, result = run.pairs(1)[0], run.result(TrainingResult)
    return Contender(
        "learned",
        result.seed,
        _spent(run),
        result.training_wall_s + (result.finetuning_wall_s or 0.0),
        pair.design,
        pair.gait,
        run.folder / pair.gait_file,
        result.pairs[0].score_cm,
    )


@dataclass(frozen=True)
class UniformRobot:
    """The best of some designs under the expert's gait, in a training's worlds."""

    design: str
    phase_deg: float
    score: float | None
    """The training's objective, of what it achieves of the goal there [its unit]; None where all
    failed in all of these worlds."""
    walk_count: int
    """Walks that it was chosen by."""
    wall_s: float


def uniform(
    run: FinishedRun, designs: Sequence[str], phases_deg: Sequence[float], work: Path
) -> Contender:
    """The best of some designs with the expert's gait, chosen as the training chose its pairs.

    All walk at every phase in a few of the worlds that the training ranked its pairs in, the best
    of them in all of these worlds, for as long as the pairs do.

    Args:
        run: The training.
        designs: Those with the same module at every place, say.
        phases_deg: How much later regulator 2 is [degrees].
        work: Keeps what was found.
    """
    place = study_folder(work / run.digest() / "uniform", "search")
    usual = _lasting(run)
    asked: dict[str, Any] = {
        "run": str(run.folder),
        "designs": list(designs),
        "phases_deg": list(phases_deg),
        **_files_of(run),
    }
    if usual != run.baseline.gait:  # earlier versions had the baseline's duration
        asked["duration_s"] = usual.duration_s
    found = study_once(
        place,
        UniformRobot,
        asked,
        lambda: _best_uniform(run, designs, phases_deg, place),
        later=_SAID_NOW,
    )
    gait = replace(usual, phase_deg=found.phase_deg)
    return Contender(
        "uniform",
        run.of_summary("seed", int),
        found.walk_count * run.task.action_count,
        found.wall_s,
        Design.parse(found.design),
        gait,
        None,
        None,
    )


def _files_of(run: FinishedRun) -> dict[str, Any]:
    """What its robots are made of, which the names of their files do not say: these may have been
    written again."""
    spec = run.spec()
    return {
        "leg": reduction_digest(spec),
        "identity": resume_identity(spec, run.worlds),
        "calibration": None if spec.calibration is None else spec.calibration.digest(),
    }


def _lasting(run: FinishedRun) -> ExpertGait:
    """The expert's gait for as long as the training's pairs walk, whatever its baseline lasts."""
    return replace(run.baseline.gait, duration_s=run.pairs(1)[0].gait.duration_s)


def _best_uniform(
    run: FinishedRun, designs: Sequence[str], phases_deg: Sequence[float], folder: RunFolder
) -> UniformRobot:
    start, objective = time.monotonic(), run.objective or Objective()
    seed, settings = run.of_summary("seed", int), CertificateSettings()
    worlds, _ = worlds_of_training(objective, worlds_of(run), seed, settings)
    usual = _lasting(run)
    asked = [
        (Design.parse(design), replace(usual, phase_deg=phase))
        for design in designs
        for phase in phases_deg
    ]
    spec, few = run.spec(), worlds[:_SCREENING_WORLDS]

    def scores(chosen: Sequence[tuple[Design, ExpertGait]], seen: Sequence[World]) -> np.ndarray:
        achieved, *_ = walks_in_worlds(
            spec,
            [design for design, _ in chosen],
            [gait for _, gait in chosen],
            seen,
            run.task.settling_step_count,
            folder,
            run.goal,
        )
        failed = np.isnan(achieved.T)
        scored = objective.of(counted_walks(achieved).T)
        # One that failed in all of them comes behind all others.
        return np.where(failed.all(axis=1), -np.inf, scored)

    order = np.argsort(-scores(asked, few), kind="stable")[:_BEST_OF_SCREENING]
    finalists = [asked[number] for number in order]
    final = scores(finalists, worlds)
    design, gait = finalists[int(np.argmax(final))]
    count = len(asked) * len(few) + len(finalists) * len(worlds)
    score = float(final.max()) if np.isfinite(final.max()) else None
    return UniformRobot(str(design), gait.phase_deg, score, count, time.monotonic() - start)


def searched(run: FinishedRun, method: Method, work: Path) -> Contender | None:
    """What a search finds with a training's time, worlds, objective and seed; None for nothing.

    The time is that of all walks, those that rank gaits among them; beside a training of an earlier
    version, which does not say what its evaluations took, that of the others.

    `gaits` searches the gait of each of the training's best designs by CMA-ES, which it is told.
    The genetic algorithm has its usual population, or fewer where the time is short.

    Args:
        run: The training.
        method: Which search.
        work: Keeps the search.
    """
    seed = run.of_summary("seed", int)
    learner = run.structured("coopt", CooptSettings)
    # As much of its time in the nominal world as the training's beginnings have.
    nominal_until = learner.restarts * learner.objective.nominal_until_timestep
    timesteps, finalist_count = _time(run, method)
    settings = SearchSettings(
        method=method,
        timesteps=timesteps,
        seed=seed,
        random_design_count=0,
        environment_count=run.of_settings("coopt.environment_count", int),
        task=run.task,
        space=run.space,
        usual_design=run.baseline.design,
        objective=replace(learner.objective, nominal_until_timestep=nominal_until),
        genetic=GeneticSettings(population=_population(run, timesteps)),
        finalist_count=finalist_count,
    )
    place = study_folder(work / run.digest() / method, "search")
    found = study_once(
        place,
        SearchFindings,
        {"run": str(run.folder), "search": settings, "robot": run.robot, **_files_of(run)},
        lambda: search(
            settings,
            run.spec(),
            place,
            run if method == "gaits" else None,
            run.worlds,
        ),
        later=_SAID_NOW,
    )
    pairs = found.pairs if found.pairs is not None else found.designs
    known = [each for each in pairs or () if each.gait is not None and each.score_cm is not None]
    if not known:
        return None
    best = max(known, key=lambda each: -np.inf if each.score_cm is None else each.score_cm)
    file = place.path / str(best.gait)
    limits = (run.task.minimum_pressure_kPa, run.task.maximum_pressure_kPa)
    gait, _ = read_gait(file, *limits)
    design = Design.parse(best.design)
    spent = found.timesteps
    if _tells_evaluations(run):
        spent += found.finalist_timesteps or 0
    return Contender(method, seed, spent, found.wall_s, design, gait, file, best.score_cm)


def _time(run: FinishedRun, method: Method) -> tuple[int, int]:
    """Actions of a search until it is over, and how many gaits it then ranks: together they take
    as long as the training, the second no more than a third."""
    usual = SearchSettings.finalist_count
    if not _tells_evaluations(run):
        return learned_timesteps(run), usual
    objective = run.objective or Objective()
    if not objective.is_robust:  # nothing walks again at a search's end
        return _spent(run), usual
    each = evaluation_timesteps(1, objective, run.task)
    # A search of gaits ranks one of each design: the expert's and those of the pairs.
    least = 1 + len(run.pairs(PAIRS_OF_RUN)) if method == "gaits" else 1
    count = max(least, min(usual, _spent(run) // (3 * each)))
    return max(1, _spent(run) - count * each), count


def _tells_evaluations(run: FinishedRun) -> bool:
    return run.result(TrainingResult).evaluation_timesteps is not None


def _spent(run: FinishedRun) -> int:
    """Actions of all robots of a training, as far as it tells them."""
    return learned_timesteps(run) + (run.result(TrainingResult).evaluation_timesteps or 0)


def _population(run: FinishedRun, timesteps: int) -> int:
    """Candidates of a generation: as many as there are for `_GENERATIONS` of whole rounds."""
    coopt, usual = run.structured("coopt", CooptSettings), GeneticSettings().population
    together = coopt.designs_per_round
    walk = coopt.objective.worlds_per_design * coopt.task.action_count
    fitting = timesteps // (_GENERATIONS * walk)
    return min(usual, max(2, together, fitting // together * together))


def learned_timesteps(run: FinishedRun) -> int:
    """Actions of all robots that a training took, fine-tuning included, but for walks that rank
    gaits."""
    result = run.result(TrainingResult)
    return result.timesteps + result.finetuning_timesteps


def worlds_of(run: FinishedRun) -> Randomisation:
    """What the training's worlds were drawn from.

    Raises:
        ValueError: It was trained in one.
    """
    if run.worlds is None:
        raise ValueError(f"{run.folder} was trained in one world, expected a robust run")
    return run.worlds
