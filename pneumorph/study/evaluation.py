"""The best pairs of a finished run, walked once more."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.idle_numbers import idle_notes
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.walk import walk
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.reduction.snapshot_range import known_ratio, range_note
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.analysis import Walker
from pneumorph.study.certified_candidates import own_task_notes
from pneumorph.study.certified_walks import full_order_identity
from pneumorph.study.finished_run import FinishedRun, Pair
from pneumorph.study.furthest import furthest
from pneumorph.study.recorded_walk import Model, recorded_walk
from pneumorph.study.robustness import (
    Robustness,
    draw_worlds,
    robustness,
    walks_in_worlds,
)
from pneumorph.study.survived import status_of
from pneumorph.study.toppled_note import toppled_in_worlds_note
from pneumorph.trajectory import Trajectory

REPEATS_WITHIN = {"cm": 0.05, "degrees": 0.5}
"""A replay of the same physics on another machine may round differently, but no more than this in
the goal's unit."""
REPLAY_PAGE = "replay.html"
"""Shows the recorded walks of an evaluation side by side."""


@dataclass(frozen=True)
class EvaluationSettings(Checked):
    """Which pairs to simulate, in which model, and whether in random worlds too."""

    model: Model = "reduced"
    """Model of the robots: reduced, or finite elements (minutes each)."""
    pair_count: Count = 5
    """Number of best pairs to evaluate."""
    record: bool = False
    """Save the trajectory of each pair."""
    randomize: bool = False
    """Also walk the pairs in worlds drawn at random, and report how their ranking changes."""
    world_count: Count = 64
    """Number of worlds that --randomize draws."""
    world_seed: CountOrNone = 0
    """Seed of the worlds of --randomize."""
    randomisation: Randomisation = field(default_factory=measured_worlds)
    """What these worlds are drawn from; those of the measured physics unless said. `pneumorph
    evaluate` takes those that the run was trained in, or else the usual ones of its physics."""

    @property
    def records(self) -> bool:
        """Whether the trajectories are saved."""
        return self.record or self.model == "full"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.randomize and self.model == "full":
            raise ValueError(
                "randomize walks reduced robots only (a full robot takes half an hour or more for "
                "each world), got --model full"
            )

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: of worlds that nobody draws."""
        names = () if self.randomize else ("world_count", "world_seed", "randomisation")
        return dict.fromkeys(names, "without --randomize")


@dataclass(frozen=True)
class EvaluatedPair:
    """A pair's distance beside that which its run reported [cm]."""

    design: str
    gait: str
    """File of the gait, from the run's folder."""
    reported_distance_cm: float | None
    distance_cm: float | None
    """None where the simulation failed."""
    range_ratio: float | None = None
    """How far any leg went relative to the furthest snapshot it was reduced from; None where that
    is not known, and for finite elements."""
    achieved: float | None = None
    """What of the goal it achieved [its unit]; None where the simulation failed, and in files of
    earlier versions."""
    reported_achieved: float | None = None


@dataclass(frozen=True)
class Evaluation:
    """What came of walking the best pairs of a run again."""

    run: str
    model: str
    best_design: str
    """The pair that achieved most of the run's goal here; the run's first where all failed."""
    best_distance_cm: float | None
    reported_distance_cm: float | None
    """What the run reported of that pair."""
    damping: str
    calibration: UsedCalibration
    notes: tuple[str, ...]
    """Pairs that did not repeat what their run reported, or left the range of their legs'
    snapshots."""
    pairs: tuple[EvaluatedPair, ...]
    """In the run's order."""
    wall_s: float
    """Wall time of all [s]."""
    leg: PartsSummary | None = None
    """The reduced leg; None for finite elements."""
    robustness: Robustness | None = None
    """How the pairs fare in other worlds, where that was asked for."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    goal: Goal = FORWARD
    best_achieved: float | None = None
    """What of it that pair achieved; None as there."""
    status: str = "completed"
    """``completed``, or that no robot survived, in drawn worlds neither."""

    def derived(self) -> dict[str, Any]:
        """Of the worlds, for those who read the file: the pairs by their mean, and the first's."""
        found, ending = self.robustness, "_cm" if self.goal.unit == "cm" else ""
        if found is None:
            return {}
        first = next(each for each in found.pairs if each.label == found.robust_ranking[0])
        return {
            "ranking_in_worlds": ", ".join(found.robust_ranking),
            f"first_mean_in_worlds{ending}": first.mean,
            f"first_tenth_percentile_in_worlds{ending}": first.tenth_percentile,
        }


def evaluate(
    run: FinishedRun | Path | str,
    settings: EvaluationSettings | None = None,
    robot: RobotSpec | None = None,
    folder: RunFolder | None = None,
) -> Evaluation:
    """Walk the best pairs of a run again and return what they achieve beside what the run says.

    Args:
        run: The run or its folder.
        settings: Which pairs and how.
        robot: What they walk as; None for the leg and physics of the run.
        folder: Receives trajectories and is told how far it is; None for RUN/evaluation. Those of
            reduced robots of an earlier evaluation there are removed; finished walks of finite
            elements are read where the same are asked for.

    Raises:
        ArtefactError: The run holds no pairs, or is damaged.
        ValueError: A gait asks for more than the robot's supply has, or worlds are drawn that the
            robot cannot be in.
    """
    start = time.monotonic()
    settings = settings or EvaluationSettings()
    run = run if isinstance(run, FinishedRun) else FinishedRun.read(Path(run))
    spec = robot or run.spec()
    folder = folder or RunFolder(run.folder / "evaluation", "evaluate")
    pairs, task = run.pairs(settings.pair_count), run.task
    spec.check_supply(pair.gait for pair in pairs)
    if settings.randomize:
        check_worlds(spec, settings.randomisation)
    if settings.model == "full":
        spec.check_reduction()
    _remove_recorded(folder.path)
    folder.progress.stage(f"walking {len(pairs)} pairs with the {settings.model} model")
    if not settings.records:
        walked = _together(spec, pairs, task, folder)
    else:
        walked = _one_by_one(spec, pairs, task, settings.model, folder)
    worlds = None
    if settings.randomize:
        nominal = [each.achieved for each in walked]
        worlds = _in_worlds(spec, settings, pairs, nominal, task, folder)
    evaluated = [
        EvaluatedPair(
            str(pair.design),
            pair.gait_file,
            pair.distance_cm,
            each.distance_cm,
            each.range_ratio,
            each.achieved,
            pair.achieved,
        )
        for pair, each in zip(pairs, walked, strict=True)
    ]
    best = furthest(evaluated)
    survived = best.achieved is not None
    reduced, drawn = settings.model == "reduced", settings.randomize
    notes = _notes(evaluated, run, task.goal, in_worlds=drawn) if reduced else []
    if settings.randomize:
        notes += idle_notes(spec, settings.randomisation)
        if run.robot.physics_name != "measured" and settings.randomisation == measured_worlds():
            notes.append(
                f"the worlds are those of the measured physics, and the run's robots are of "
                f"{run.robot.physics_name!r}: randomisation says what else they are drawn from"
            )
    if worlds is not None:
        told = toppled_in_worlds_note("one robot or another", worlds.toppled_share)
        notes += [] if told is None else [told]
        survived = survived or not np.isnan(worlds.achieved).all()
    return Evaluation(
        run=str(run.folder),
        model=settings.model,
        best_design=best.design,
        best_distance_cm=best.distance_cm,
        reported_distance_cm=best.reported_distance_cm,
        goal=task.goal,
        best_achieved=best.achieved,
        **spec.describe(reduced=settings.model == "reduced"),
        notes=(*spec.calibration_notes, *notes),
        pairs=tuple(evaluated),
        robustness=worlds,
        wall_s=time.monotonic() - start,
        status=status_of(survived or None),
    )


def trajectory_file(model: Model, rank: int | str) -> str:
    """Name of the recorded walk of a pair, ranked from 1."""
    return f"trajectory_{model}_L{rank}.npz"


def _remove_recorded(folder: Path) -> None:
    """Remove what an earlier evaluation in the same folder recorded of reduced robots, seconds of
    work, and the page that shows it; ways of finite elements took hours and go to `earlier`."""
    for file in folder.glob(trajectory_file("reduced", "*")):
        file.unlink()
    for file in folder.glob(trajectory_file("full", "*")):
        (folder / "earlier").mkdir(exist_ok=True)
        file.replace(folder / "earlier" / file.name)
    (folder / REPLAY_PAGE).unlink(missing_ok=True)


def _in_worlds(
    spec: RobotSpec,
    settings: EvaluationSettings,
    pairs: Sequence[Pair],
    nominal: Sequence[float | None],
    task: CrawlingTask,
    folder: RunFolder,
) -> Robustness:
    drawn = spec.agreeing_worlds(settings.randomisation)
    worlds = draw_worlds(drawn, settings.world_count, settings.world_seed)
    folder.progress.stage(f"walking in {len(worlds)} worlds")
    walked = walks_in_worlds(
        spec,
        [pair.design for pair in pairs],
        [pair.gait for pair in pairs],
        worlds,
        task.settling_step_count,
        folder,
        task.goal,
    )
    return robustness(
        [f"L{rank}" for rank in range(1, len(pairs) + 1)],
        np.array([np.nan if far is None else far for far in nominal]),
        walked.achieved,
        worlds,
        settings_to_dict(drawn),
        walked.range_ratio,
        task.goal,
        walked.lean_deg,
    )


def _notes(
    pairs: Sequence[EvaluatedPair], run: FinishedRun, goal: Goal, *, in_worlds: bool
) -> list[str]:
    """Remarks where a reduced robot did not repeat what its run reported, or left its range.

    Args:
        pairs: As they were walked in the world that the physics say.
        run: Whose they are.
        goal: What they are to achieve.
        in_worlds: Whether they walk in drawn worlds besides.
    """
    notes = own_task_notes(run.own_task, goal)
    if run.has_drawn_worlds:
        notes.append(
            "the run reported distances in worlds drawn at random, these are of the one that the "
            "physics say: they need not agree"
            + ("" if in_worlds else " (--randomize walks in drawn worlds)")
        )
    for pair in pairs:
        now, then = pair.achieved, pair.reported_achieved
        if now is None:
            differ = "worlds" if run.has_drawn_worlds else "physics"
            notes.append(f"{pair.design} diverged; {differ}, leg or machine differ")
        elif (
            then is not None
            and not run.has_drawn_worlds
            and not abs(now - then) < REPEATS_WITHIN[goal.unit]
        ):
            notes.append(
                f"{pair.design} {goal.verb} {now:.2f}{goal.symbol}, the run reported "
                f"{then:.2f}{goal.symbol}: physics, leg or machine differ"
            )
        if (note := range_note(pair.design, pair.range_ratio)) is not None:
            notes.append(note)
    return notes


@dataclass(frozen=True)
class _Walked:
    """What a pair did, None where that is not known: as an `EvaluatedPair` has it."""

    distance_cm: float | None
    achieved: float | None
    range_ratio: float | None


def _together(
    spec: RobotSpec, pairs: Sequence[Pair], task: CrawlingTask, folder: RunFolder
) -> list[_Walked]:
    walked = walk(
        spec.simulator([pair.design for pair in pairs]),
        [pair.gait for pair in pairs],
        duration_s=pairs[0].gait.duration_s,
        time_step_s=spec.physics.time_step_s,
        settling_step_count=task.settling_step_count,
        progress=folder.progress,
    )
    told = (walked.distance_cm, walked.achieved(task.goal))
    return [
        _Walked(_known(distance), _known(achieved), known_ratio(ratio))
        for distance, achieved, ratio in zip(*told, walked.range_ratio, strict=True)
    ]


def _known(far: float) -> float | None:
    return None if np.isnan(far) else float(far)


def _one_by_one(
    spec: RobotSpec, pairs: Sequence[Pair], task: CrawlingTask, model: Model, folder: RunFolder
) -> list[_Walked]:
    walked = []
    for rank, pair in enumerate(pairs, start=1):
        walker = Walker(f"L{rank}", pair.design, pair.gait, task.settling_step_count)
        if model == "full":
            trajectory = _full(spec, walker, folder)
        else:
            trajectory = recorded_walk(
                spec, pair.design, pair.gait, settling_steps=task.settling_step_count
            ).with_skin_only()
        trajectory.save(folder / trajectory_file(model, rank))
        walked.append(
            _Walked(
                trajectory.distance_cm,
                task.goal.achieved(trajectory),
                trajectory.metadata.get("range_ratio"),
            )
        )
        folder.progress(rank, len(pairs), "walking")
    return walked


def _full(spec: RobotSpec, walker: Walker, folder: RunFolder) -> Trajectory:
    """The way of finite elements, with its skin alone: one that was finished is read, one that was
    stopped goes on. Files are named after all that a way depends on."""
    identity = full_order_identity(spec, walker)[:16]
    file, checkpoint = (folder / f"full_order/{identity}{end}.npz" for end in ("", "_on_its_way"))
    if file.exists():
        found = Trajectory.load(file)
        # One that ended for a reason that was not kept may come further now.
        if found.status == "completed" or "reason" in found.metadata:
            return found
    made = recorded_walk(
        spec,
        walker.design,
        walker.gait,
        "full",
        checkpoint,
        settling_steps=walker.settling_steps,
        progress=folder.progress,
        keep_checkpoint=True,
    ).with_skin_only()
    made.save(file)
    checkpoint.unlink(missing_ok=True)
    return made
