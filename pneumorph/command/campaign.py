"""Many coopt runs: every seed with every variant of the settings.

A variant is a settings file (JSON or TOML) laid over the preset and the flags. Runs are made one
after another, or side by side (--executor.process-count) as processes of this machine, or as tasks
of Ray (--executor.backend ray) on this machine or on a cluster (--executor.address), whose machines
must see the same run folder. A run whose worker dies is begun again and goes on from its last
checkpoint; the others do not notice. The same command with the same --out goes on with what is
left.

Writes VARIANT-SEED/ for each run, as `pneumorph coopt` does, and campaign.json.

Example: pneumorph campaign --preset fast --seeds 0 1 2 --executor.process-count 2 --out runs/seeds
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_json
from pneumorph.command.campaign_progress import campaign_progress
from pneumorph.command.coopt import TRAINING_FOLDER, CooptOptions, coopt
from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.run_folder import (
    SETTINGS,
    SUMMARY,
    RunFolder,
    finite,
    read_settings,
    read_summary,
)
from pneumorph.command.verb import Verb
from pneumorph.coopt.checkpoint import has_checkpoint
from pneumorph.coopt.settings import CooptSettings
from pneumorph.executor import ExecutorSettings, run_tasks
from pneumorph.machine import processor_count
from pneumorph.settings import load_settings, settings_from_dict, settings_to_dict

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class CampaignOptions:
    """Which runs, where, and what they have in common."""

    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the runs; they replace --seed."""
    variants: tuple[Path, ...] = ()
    """Settings files, such as `coopt.updates` or `robot.simulation.damping`, each laid over the
    rest; without them all runs differ by their seed alone."""
    executor: ExecutorSettings = field(default_factory=ExecutorSettings)
    """Where they run: by default one after another on this machine, or on all of a Ray cluster."""
    run: Annotated[CooptOptions, flat] = field(default_factory=CooptOptions)

    def __post_init__(self) -> None:
        if not self.seeds or len(set(self.seeds)) < len(self.seeds):
            raise ValueError(f"seeds are {self.seeds}, expected one or more different ones")
        names = [path.stem for path in self.variants]
        if len(set(names)) < len(names):
            raise ValueError(f"variants are named {names}, expected files of different names")


def campaign(options: CampaignOptions, folder: RunFolder) -> dict[str, Any]:
    """Make the runs that are not there yet and compare all."""
    start = time.monotonic()
    variants = _variants(options)
    tasks = [
        (f"{name}-{seed}", _seeded(base, seed))
        for name, base in variants.items()
        for seed in options.seeds
    ]
    folder.progress.stage(f"{len(tasks)} runs")
    failures = {}
    executor = options.executor
    if executor.backend == "processes":
        executor = replace(executor, process_count=executor.at_once(usual=1))
    # On a cluster this folder is seen by all machines, the one we are in perhaps not.
    shared = (str(folder.path.resolve()), folder.provenance.get("made_by"), _threads(executor))
    learners = {name: settings_from_dict(CooptOptions, each).coopt for name, each in tasks}
    with campaign_progress(folder.path, learners, folder.progress) as say:
        for number, failure in run_tasks(run_one, shared, tasks, executor, given_up=str):
            name = tasks[number][0]
            if failure is not None:
                failures[name] = failure
            say(f"{name}: {failure or 'finished'}")
    runs = [
        {"name": name, **_result(folder.path / name)} for name, _ in tasks if name not in failures
    ]
    result = {
        "runs": runs,
        "variants": {
            name: _spread(runs, [f"{name}-{seed}" for seed in options.seeds]) for name in variants
        },
        "failures": failures,
    }
    write_json(folder / "campaign.json", finite(result))
    walked = [run for run in runs if run["best_distance_cm"] is not None]
    best = max(walked, key=lambda run: run["best_distance_cm"], default=None)
    return {
        "status": "completed" if not failures else "some runs failed",
        "best_run": best and best["name"],
        "best_design": best and best["best_design"],
        "best_distance_cm": best and best["best_distance_cm"],
        **result,
        "wall_s": time.monotonic() - start,
    }


def run_one(
    shared: tuple[str, dict[str, Any] | None, int], task: tuple[str, dict[str, Any]]
) -> str | None:
    """Make one run, or go on with it; a finished one of the same settings is left alone.

    Args:
        shared: The campaign's folder, what made it, and the engine's threads where the run leaves
            their number open (it does not change what comes out).
        task: Name and settings of the run.

    Returns:
        Why it failed, or None: one failure does not end the others.
    """
    folder, made_by, threads = shared
    name, content = task
    options = replace(settings_from_dict(CooptOptions, content), resume=True)
    place = RunFolder(Path(folder) / name, "coopt", provenance=made_by)
    robot = replace(options.robot, threads=options.robot.threads or threads)
    try:
        with place.alone():
            _refuse_other_settings(place.path, options)
            if not (place.path / SUMMARY).exists():
                place.save_settings(settings_to_dict(options))
                place.save_summary(coopt(replace(options, robot=robot), place))
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def _refuse_other_settings(folder: Path, options: CooptOptions) -> None:
    """Keep a run from being written over by one that differs from it."""
    begun = (folder / SUMMARY).exists() or has_checkpoint(folder / TRAINING_FOLDER)
    if begun and (folder / SETTINGS).exists():
        there, asked = read_settings(folder), settings_to_dict(options)
        # Read as settings: one that is newer than the run had its default.
        learner = settings_from_dict(CooptSettings, there["coopt"])
        if {**there, "coopt": settings_to_dict(learner), "resume": asked["resume"]} != asked:
            raise ValueError(
                f"{folder} holds a run of other settings, expected the same; choose another --out"
            )


def _threads(executor: ExecutorSettings) -> int:
    """Threads of each run: a Ray task has one processor, processes share the machine's."""
    if executor.backend == "ray":
        return 1
    count = executor.at_once()
    return 0 if count == 1 else max(1, processor_count() // count)


def _variants(options: CampaignOptions) -> dict[str, CooptOptions]:
    if not options.variants:
        return {"run": options.run}
    return {path.stem: load_settings(CooptOptions, path, options.run) for path in options.variants}


def _seeded(base: CooptOptions, seed: int) -> dict[str, Any]:
    return settings_to_dict(replace(base, coopt=replace(base.coopt, seed=seed)))


def _result(folder: Path) -> dict[str, Any]:
    summary = read_summary(folder)
    names = ("seed", "best_design", "best_distance_cm", "baseline_best_distance_cm", "timesteps",
             "finetuning_timesteps", "training_wall_s", "wall_s", "notes")  # fmt: skip
    return {name: summary[name] for name in names}


def _spread(runs: list[dict[str, Any]], names: list[str]) -> dict[str, Any]:
    """Mean and range of the best distances of a variant's seeds."""
    found = [
        run["best_distance_cm"]
        for run in runs
        if run["name"] in names and run["best_distance_cm"] is not None
    ]
    if not found:
        return {"run_count": 0}
    return {
        "run_count": len(found),
        "mean_best_distance_cm": float(np.mean(found)),
        "least_best_distance_cm": min(found),
        "most_best_distance_cm": max(found),
    }


VERB = Verb(
    CampaignOptions,
    campaign,
    {
        name: (lambda preset=preset: CampaignOptions(run=preset()))  # type: ignore[misc]
        for name, preset in COOPT.presets.items()
    },
)
