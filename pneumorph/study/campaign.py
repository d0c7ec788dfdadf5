"""Many trainings: every seed with every variant of the settings, and how they compare."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, CountOrNone
from pneumorph.base.executor import ExecutorSettings, run_tasks
from pneumorph.base.flags import flat
from pneumorph.base.idle_settings import is_of_a_run, refuse_idle, within
from pneumorph.base.layers import changed_flags, layered
from pneumorph.base.machine import processor_count
from pneumorph.base.result import in_cm, result_to_dict
from pneumorph.base.run_folder import SETTINGS, RunFolder
from pneumorph.base.settings import (
    load_settings,
    read_settings_file,
    settings_from_dict,
    settings_to_dict,
)
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.learn.settings import CooptSettings
from pneumorph.study.campaign_progress import campaign_progress
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.survived import NONE_SURVIVED
from pneumorph.study.training_options import TrainingOptions, train_once
from pneumorph.study.training_result import TrainingResult

CAMPAIGN_FILE = "campaign.json"

_OF_ALL: tuple[tuple[dict[str, Any], str], ...] = (
    ({"coopt": {"seed": True}}, "--seeds says the runs' seeds"),
    ({"robot": {"executor": True}}, "--executor of the campaign says where all runs are made"),
    ({"resume": True}, "a campaign goes on with its runs anyway"),
)
"""What the campaign says for all its runs, by its place, and why no variant does."""
_ALONE = ExecutorSettings(process_count=1)
"""Where a run computes its own robots: its process shares the machine with those of others."""


@dataclass(frozen=True)
class CampaignSettings(Checked):
    """Which seeds and variants to run, and the settings they share."""

    seeds: tuple[CountOrNone, ...] = (0, 1, 2)
    """Seeds of the runs; --seed and `coopt.seed` of a variant are refused."""
    variants: tuple[Path, ...] = ()
    """Settings files, such as one that sets `coopt.updates` or `robot.physics.damping`, each laid
    over the rest; without them all runs differ by their seed alone. `coopt.seed`, `robot.executor`
    and `resume` are the campaign's and none of a variant's; of a run's ``settings.json``, which
    holds them as well, they are left out."""
    run: Annotated[TrainingOptions, flat] = field(default_factory=TrainingOptions)
    """Settings that all runs share. --executor says where the runs are made: by default one after
    another on this machine, or on all of a Ray cluster."""

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version, whose executor was not that of the robots."""
        now = dict(content)
        if "executor" not in now:
            return now
        executor, run = now.pop("executor"), dict(now.get("run", {}))
        run["robot"] = {**run.get("robot", {}), "executor": executor}
        return {**now, "run": run}

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.seeds or len(set(self.seeds)) < len(self.seeds):
            raise ValueError(f"seeds are {self.seeds}, expected one or more different ones")
        names = [path.stem for path in self.variants]
        if len(set(names)) < len(names):
            raise ValueError(f"variants are named {names}, expected files of different names")

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: those that change nothing in the runs of any
        variant."""
        variants = [self._laid_over(path) for path in self.variants] or [self.run]
        first, *others = (within("run", each) for each in variants)
        return {name: why for name, why in first.items() if all(name in each for each in others)}

    def bases(self, folder: Path | None = None) -> dict[str, TrainingOptions]:
        """What the runs of each variant have in common, by the variant's name.

        Args:
            folder: The campaign's, whose runs may keep what they were begun with; None for none.

        Raises:
            FileNotFoundError: A variant's file is missing.
            ValueError: It cannot be read, sets what no setting is called, what the campaign says
                for all its runs, or what would be ignored beside the rest; or all runs are asked to
                have one seed.
        """
        if self.run.coopt.seed != CooptSettings.seed:
            raise ValueError(
                f"coopt.seed (--seed) is {self.run.coopt.seed}, expected it to be left out: the "
                f"seeds of a campaign's runs are those of --seeds, {self.seeds}"
            )
        if not self.variants:
            return {"run": self.run}
        return {path.stem: self._variant(path, folder) for path in self.variants}

    def _variant(self, path: Path, folder: Path | None) -> TrainingOptions:
        base, options = self.run, self._laid_over(path)
        if is_of_a_run(path):
            return options
        for place, why in _OF_ALL:
            if flags := changed_flags(base, options, place):
                raise ValueError(
                    f"settings file {path}: {', '.join(flags)}: expected to be left out of a "
                    f"variant: it would be ignored; {why}"
                )
        runs = [] if folder is None else [folder / f"{path.stem}-{each}" for each in self.seeds]
        begun = next((each for each in runs if (each / SETTINGS).exists()), None)
        refuse_idle(options, base, [read_settings_file(path)], begun, path)
        return options

    def _laid_over(self, path: Path) -> TrainingOptions:
        """The settings of all runs with those of a variant's file laid over them."""
        load_settings(TrainingOptions, path, self.run)  # what it refuses, it refuses by the file
        return layered(self.run, [read_settings_file(path)])


@dataclass(frozen=True)
class CampaignRun:
    """What one training found and took; see `TrainingResult`."""

    name: str
    """Its folder, VARIANT-SEED."""
    seed: int
    best_design: str | None
    best_distance_cm: float | None
    baseline_best_distance_cm: float
    timesteps: int
    finetuning_timesteps: int
    training_wall_s: float
    wall_s: float
    notes: tuple[str, ...]
    goal: Goal = FORWARD
    best_achieved: float | None = None
    """What of it the best pair achieved [its unit]; None in runs of earlier versions."""
    baseline_best_achieved: float | None = None
    """What the expert's best phase does, in the world as it stands."""
    ranked_by: str | None = None
    """What its pairs are ranked by; None for the distance in one world."""
    score_cm: float | None = None
    """What the best pair scores by that; None where pairs are ranked by their distance."""
    in_drawn_worlds: bool = False
    """Whether the best pair's distance is the mean over drawn worlds, and not that in one."""

    @classmethod
    def of(cls, name: str, found: TrainingResult) -> CampaignRun:
        """That of a training."""
        own = ("name", "score_cm", "in_drawn_worlds")
        kept = [each.name for each in fields(cls) if each.name not in own]
        return cls(
            name,
            **{each: getattr(found, each) for each in kept},
            score_cm=found.pairs[0].score_cm if found.ranked_by and found.pairs else None,
            in_drawn_worlds=bool(found.randomisation),
        )

    @property
    def counted(self) -> float | None:
        """What the best pair achieves [the goal's unit]; None where no robot survived."""
        return self.best_distance_cm if self.best_achieved is None else self.best_achieved

    @property
    def rank(self) -> tuple[float, float]:
        """What runs are compared by: what ranked their pairs, then what the best achieves."""
        scored, counted = self.score_cm, self.counted
        return (0.0 if scored is None else scored, -np.inf if counted is None else counted)


@dataclass(frozen=True)
class Spread:
    """The best of a variant's seeds, by what they achieve [the goal's unit]; none where no robot
    survived any."""

    run_count: int
    mean_best: float | None = field(default=None, metadata=in_cm("mean_best_distance_cm"))
    least_best: float | None = field(default=None, metadata=in_cm("least_best_distance_cm"))
    most_best: float | None = field(default=None, metadata=in_cm("most_best_distance_cm"))
    goal: Goal = FORWARD

    @classmethod
    def of(cls, runs: Sequence[CampaignRun]) -> Spread:
        """That of some runs."""
        far = [run.counted for run in runs if run.counted is not None]
        if not far:
            return cls(0)
        return cls(len(far), float(np.mean(far)), min(far), max(far), runs[0].goal)


@dataclass(frozen=True)
class Campaign:
    """How the runs of a campaign compare."""

    status: str
    """``completed``, or that some runs failed."""
    best_run: str | None
    """None where no robot survived, or where runs do not compare: they differ in their goals, how
    long their robots walk, what pairs are ranked by, the physics, or what their worlds are drawn
    from."""
    best_design: str | None
    best_distance_cm: float | None
    runs: tuple[CampaignRun, ...]
    variants: dict[str, Spread]
    failures: dict[str, str]
    """Why runs failed, by their names; also of those that ended without a robot that survived."""
    wall_s: float
    notes: tuple[str, ...] = ()
    """Why there is no best run, where robots survived."""


def campaign(settings: CampaignSettings, folder: RunFolder) -> Campaign:
    """Make the runs that are not there yet and compare all.

    Args:
        settings: Which runs.
        folder: Receives a folder for each run, and ``campaign.json``. On a cluster all machines
            must see it.

    Raises:
        FileNotFoundError: A variant's file is missing.
        ValueError: A variant cannot be read, or sets what would be ignored.
    """
    start = time.monotonic()
    bases = settings.bases(folder.path)
    options = {
        f"{name}-{seed}": replace(base, coopt=replace(base.coopt, seed=seed))
        for name, base in bases.items()
        for seed in settings.seeds
    }
    failures = _make(options, settings.run.robot.executor, folder)
    trained = {
        name: FinishedRun.read(folder.path / name).result(TrainingResult)
        for name in options
        if name not in failures
    }
    runs = {name: CampaignRun.of(name, found) for name, found in trained.items()}
    walked = [run for run in runs.values() if run.counted is not None]
    failures |= {name: NONE_SURVIVED for name, run in runs.items() if run.counted is None}
    notes = _that_differ({run.name: (options[run.name], trained[run.name]) for run in walked})
    best = None if notes else max(walked, key=lambda run: run.rank, default=None)
    found = Campaign(
        status="completed" if not failures else "some runs failed",
        best_run=None if best is None else best.name,
        best_design=None if best is None else best.best_design,
        best_distance_cm=None if best is None else best.best_distance_cm,
        runs=tuple(runs.values()),
        variants={
            name: Spread.of([runs[each] for seed in settings.seeds
                             if (each := f"{name}-{seed}") in runs])
            for name in bases
        },
        failures=failures,
        wall_s=time.monotonic() - start,
        notes=notes,
    )  # fmt: skip
    content = result_to_dict(found)
    kept = ("runs", "variants", "failures")
    write_json(folder / CAMPAIGN_FILE, {name: content[name] for name in kept})
    return found


def _that_differ(runs: Mapping[str, tuple[TrainingOptions, TrainingResult]]) -> tuple[str, ...]:
    """What to tell of runs whose distances do not compare; nothing of those that do."""
    told: dict[str, Callable[[TrainingOptions, TrainingResult], Any]] = {
        "goals": lambda _, run: run.goal.label,
        "durations of walks": lambda asked, _: f"{_duration_s(asked):.6g} s",
        "what pairs are ranked by": lambda _, run: run.ranked_by or "distance in one world",
        "physics": lambda _, run: run.physics,
        "distributions of worlds": lambda _, run: _distributions(run.randomisation),
    }
    for what, of in told.items():
        names: list[tuple[Any, str]] = []  # the first run of each value, which may have no hash
        for name, run in runs.items():
            if all(of(*run) != value for value, _ in names):
                names.append((of(*run), name))
        if len(names) > 1:
            plain = all(isinstance(value, str) for value, _ in names)
            said = ", ".join(f"{value} in {name}" if plain else name for value, name in names)
            return (
                f"no run is the best of all: their {what} differ ({said}); `variants` has the best "
                "of each",
            )
    return ()


def _duration_s(asked: TrainingOptions) -> float:
    """How long the robots of a training walk [s]."""
    return asked.coopt.task.walk_s(asked.robot.physics.time_step_s)


def _distributions(randomisation: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """What worlds were drawn from, whatever number of them robots learned in, and from when on."""
    if randomisation is None:
        return None
    learning = ("world_count", "nominal_until")
    return {name: each for name, each in randomisation.items() if name not in learning}


def _of_one(options: TrainingOptions) -> TrainingOptions:
    """A run as a worker makes it, whose own folder may be another."""
    shown = tuple(source.resolve() for source in options.demonstrations)
    alone = replace(options.robot, executor=_ALONE)
    return replace(options, robot=alone, demonstrations=shown)


def _make(
    runs: Mapping[str, TrainingOptions], executor: ExecutorSettings, folder: RunFolder
) -> dict[str, str]:
    """Make the runs, and return why some failed."""
    folder.progress.stage(f"{len(runs)} runs")
    if executor.backend == "processes":
        executor = replace(executor, process_count=executor.at_once(usual=1))
    # On a cluster this folder is seen by all machines, the one we are in perhaps not.
    shared = (str(folder.path.resolve()), folder.provenance.get("made_by"), _threads(executor))
    tasks = [(name, settings_to_dict(_of_one(options))) for name, options in runs.items()]
    learners = {name: options.coopt for name, options in runs.items()}
    failures = {}
    with campaign_progress(folder.path, learners, folder.progress) as say:
        for number, failure in run_tasks(run_one, shared, tasks, executor, given_up=str):
            name = tasks[number][0]
            if failure is not None:
                failures[name] = failure
            say(f"{name}: {failure or 'finished'}")
    return failures


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
    place = RunFolder(Path(folder) / name, "coopt", provenance=made_by)
    try:
        train_once(settings_from_dict(TrainingOptions, content), place, threads)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def _threads(executor: ExecutorSettings) -> int:
    """Threads of each run: a Ray task has one processor, processes share the machine's."""
    if executor.backend == "ray":
        return 1
    count = executor.at_once()
    return 0 if count == 1 else max(1, processor_count() // count)
