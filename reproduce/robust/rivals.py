"""Searches that share nothing with learning, with as much simulated time, in the same worlds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.objective import Objective
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.certified_pairs import Band
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.search import SearchSettings, search
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_run import TrainingResult

Method = Literal["gaits", "genetic", "random"]
METHODS: tuple[Method, ...] = ("gaits", "genetic", "random")

WORLDS = 200
"""Unseen ones, those of the certificates."""


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


def learned(run: FinishedRun, folder: RunFolder, expert_cm: np.ndarray) -> Found:
    """The best pair of a training, beside the expert's distances in the worlds [cm], (world,)."""
    pair, timesteps = run.pairs(1)[0], learned_timesteps(run)
    seed = run.of_summary("seed", int)
    return _found("learned", run, seed, timesteps, pair.design, pair.gait, folder, expert_cm)


def searched(run: FinishedRun, method: Method, work: Path, expert_cm: np.ndarray) -> Found | None:
    """What a search finds with a training's time, worlds, objective and seed; None for nothing.

    `gaits` searches the gait of each of the training's best designs by CMA-ES, which it is told.

    Args:
        run: The training.
        method: Which search.
        work: Keeps the search.
        expert_cm: Distances of the expert's robot in the unseen worlds [cm], (world,).
    """
    same = learned_timesteps(run)
    seed = run.of_summary("seed", int)
    settings = SearchSettings(
        method=method,
        timesteps=same,
        seed=seed,
        random_design_count=0,
        environment_count=run.of_settings("coopt.environment_count", int),
        task=run.task,
        space=run.space,
        objective=run.objective or Objective(),
    )
    place = study_folder(work / run.digest() / method, "search")
    found = study_once(
        place,
        SearchFindings,
        {"run": str(run.folder), "search": settings, "robot": run.robot},
        lambda: search(
            settings,
            run.robot.spec(),
            place,
            run if method == "gaits" else None,
            run.worlds,
        ),
    )
    pairs = found.pairs if found.pairs is not None else found.designs
    known = [each for each in pairs or () if each.gait is not None and each.score_cm is not None]
    if not known:
        return None
    best = max(known, key=lambda each: each.score_cm or -np.inf)
    limits = (run.task.minimum_pressure_kPa, run.task.maximum_pressure_kPa)
    gait, _ = read_gait(place.path / str(best.gait), *limits)
    design = Design.parse(best.design)
    return _found(method, run, seed, found.timesteps, design, gait, place, expert_cm)


def learned_timesteps(run: FinishedRun) -> int:
    """Actions of all robots that a training took, fine-tuning included."""
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


def _found(
    method: str,
    run: FinishedRun,
    seed: int,
    timesteps: int,
    design: Design,
    gait: HeldGait,
    folder: RunFolder,
    expert_cm: np.ndarray,
) -> Found:
    worlds = unseen_worlds(worlds_of(run), WORLDS, 0)
    steps = run.task.settling_step_count
    far, _ = walks_in_worlds(run.robot.spec(), [design], [gait], worlds, steps, folder)
    # As certificates have it, who fails goes nowhere.
    beyond = float(np.mean(np.nan_to_num(far[:, 0]) > np.nan_to_num(expert_cm)))
    return Found(method, seed, timesteps, str(design), Band.of(far[:, 0]), beyond)
