"""Trials on a rig beside the simulation of what was commanded: how far reality follows it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, Positive
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import Trial, read_trials, trial_folders
from pneumorph.hardware.trial_comparison import (
    LEAST_SIMULATED,
    TrialComparison,
    check_length,
    compare_trials,
    pressure_tracking,
)
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design
from pneumorph.study.deployed_gait import SCHEDULE_FILE
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_walk import Model, recorded_walk

SAME_LINE = 1e-3
"""Calibrations whose lines differ by a smaller share convert pressures alike, to 0.1 kPa."""


@dataclass(frozen=True)
class TransferSettings(Checked):
    """The simulation, and over which times is counted what the robots achieve."""

    model: Model = "reduced"
    """Model of the simulated robots: reduced, or finite elements (minutes each)."""
    step_s: Positive = 1.0
    """Length of a step [s]; the reward is what is achieved in each."""
    cycle_s: Positive = 4.0
    """Length of a gait cycle [s]; the slide back is counted within each."""
    video: VideoSettings = field(default_factory=VideoSettings)


@dataclass(frozen=True)
class DistanceRatio:
    """What was achieved over what the first robot achieved; None where that was nothing."""

    simulated: float | None
    measured: float | None


@dataclass(frozen=True)
class ComparedRobot:
    """One robot, simulated and measured. Means are over its trials."""

    label: str
    design: str
    simulated_distance_cm: float
    distances_cm: tuple[float, ...]
    """Of each trial."""
    mean_distance_cm: float
    spread_cm: float | None
    """Standard deviation over trials; None of a single one."""
    transfer_ratio: float | None
    """Measured over simulated, of what counts; None where the simulation achieves nothing."""
    simulated_reward_per_step_cm: tuple[float, ...]
    mean_reward_per_step_cm: tuple[float, ...]
    simulated_backsliding_cm: float
    mean_backsliding_cm: float
    path_rms_cm: float
    pressure_rms_kPa: float | None
    """Commanded against sensed pressure; None without sensors, as is the delay."""
    pressure_delay_s: float | None
    distance_over_first: DistanceRatio
    run: str
    """Folder of its deployment."""
    trajectory: str
    """File of its simulation, in the run's folder."""
    simulated_turned_deg: float | None = None
    """How far the simulation turned to the left; None in files of earlier versions."""
    mean_turned_deg: float | None = None
    """The same of the trials whose tracks tell; None where none does."""
    simulated_achieved: float | None = None
    """What of the goal the simulation achieved [the goal's unit]; None in files of earlier
    versions, whose goal is the distance."""
    achieved: tuple[float, ...] = ()
    """The same of each trial."""
    mean_achieved: float | None = None
    achieved_spread: float | None = None
    """Standard deviation over trials; None of a single one."""
    simulated_step_rewards: tuple[float, ...] = ()
    """What of the goal was achieved in each step [the goal's unit]."""
    mean_step_rewards: tuple[float, ...] = ()


@dataclass(frozen=True)
class Transfer:
    """Robots simulated and measured; the plain numbers are the last robot's."""

    model: str
    transfer_ratio: float | None
    mean_distance_cm: float
    spread_cm: float | None
    simulated_distance_cm: float
    step_s: float
    cycle_s: float
    robots: tuple[ComparedRobot, ...]
    damping: str
    calibration: UsedCalibration
    wall_s: float
    leg: PartsSummary | None = None
    """The reduced leg; None for finite elements."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    goal: Goal = FORWARD
    """What counts of the robots' motion: what the last one was taught."""
    simulated_achieved: float | None = None
    """What of it the last robot's simulation achieved [its unit]; None as in the robots."""
    mean_achieved: float | None = None
    """The same of the last robot's trials."""
    achieved_spread: float | None = None
    """Standard deviation over them; None of a single one."""
    figures: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    """Trials that were left out or cut the comparison short, simulations that did not come to their
    end, and robots that were taught something else than what is compared."""


@dataclass(frozen=True, eq=False)
class TransferStudy:
    """What came out, with the paths and the trials for those who draw them.

    Attributes:
        found: The result.
        comparisons: Paths of each robot, simulated and measured.
        trials: Trials of each robot.
    """

    found: Transfer
    comparisons: tuple[TrialComparison, ...]
    trials: tuple[tuple[Trial, ...], ...]


def transfer(
    runs: Sequence[str], settings: TransferSettings, spec: RobotSpec, folder: RunFolder
) -> TransferStudy:
    """Simulate what was deployed and set it beside the trials.

    Args:
        runs: Folders of deployments, as LABEL=FOLDER or FOLDER.
        settings: How they are compared.
        spec: The simulated robot.
        folder: Receives ``simulated_LABEL.npz`` and ``comparison.json``.

    Raises:
        FileNotFoundError: A deployment has no trials, or one that was not stopped no track.
        ValueError: There are no runs, one is a bend test, or a label is none or not the only one.
    """
    start = time.monotonic()
    if not runs:
        raise ValueError("runs is empty, expected at least one folder of `pneumorph deploy`")
    notes: list[str] = []
    deployed = [
        _Deployed.read(label, run, settings, notes) for label, run in labelled_runs(runs).items()
    ]
    goal = _goal(deployed, notes)
    model = spec.describe(reduced=settings.model == "reduced")
    for each in deployed:
        notes += each.other_pressures(model["calibration"])
    compared: list[TrialComparison] = []
    for number, each in enumerate(deployed, start=1):
        folder.progress.stage(f"simulating {each.label} ({number} of {len(runs)})")
        compared.append(_compared(spec, each, settings, folder, goal))
        counted = compared[-1].counted
        if not counted.simulated_whole:
            notes.append(
                f"the simulation of {each.label} ended after {counted.time_s[-1]:.2f} s of "
                f"{each.gait.duration_s:g} s: what was measured until then stands beside it, and "
                "there is no ratio"
            )
        elif counted.transfer_ratio is None:
            notes.append(
                f"the simulation of {each.label} achieves {counted.simulated_end:.2g} {goal.unit}, "
                f"less than {LEAST_SIMULATED[goal.unit]:g}: there is no ratio to so little"
            )
        folder.progress.say(
            f"{each.label}: {goal.label} {goal.said(counted.mean)} measured, "
            + ("" if counted.spread is None else f"deviation {goal.said(counted.spread)}, ")
            + f"{goal.said(counted.simulated_end)} simulated"
        )
    robots = tuple(
        _robot(each, comparison, compared[0])
        for each, comparison in zip(deployed, compared, strict=True)
    )
    told = {"goal": goal.label, "unit": goal.unit, "robots": [*map(result_to_dict, robots)]}
    write_json(folder / "comparison.json", told)
    last = robots[-1]
    found = Transfer(
        model=settings.model,
        transfer_ratio=last.transfer_ratio,
        mean_distance_cm=last.mean_distance_cm,
        spread_cm=last.spread_cm,
        simulated_distance_cm=last.simulated_distance_cm,
        step_s=settings.step_s,
        cycle_s=settings.cycle_s,
        robots=robots,
        **model,
        wall_s=time.monotonic() - start,
        goal=goal,
        simulated_achieved=last.simulated_achieved,
        mean_achieved=last.mean_achieved,
        achieved_spread=last.achieved_spread,
        notes=tuple(notes),
    )
    return TransferStudy(found, tuple(compared), tuple(each.trials for each in deployed))


def labelled_runs(runs: Sequence[str]) -> dict[str, Path]:
    """Folders by their labels, of LABEL=FOLDER or FOLDER.

    Raises:
        ValueError: A label is none, has slashes or is given twice.
    """
    found: dict[str, Path] = {}
    for text in runs:
        label, _, path = text.rpartition("=")
        label = label or Path(path).name
        if not label or set(label) & set("/\\"):
            raise ValueError(
                f"{text}: the label {label!r} names files of its own, expected one without "
                "slashes: LABEL=FOLDER"
            )
        if label in found:
            raise ValueError(
                f"{text}: the label {label!r} is that of {found[label]} already, expected one for "
                "each run: LABEL=FOLDER"
            )
        found[label] = Path(path)
    return found


@dataclass(frozen=True, eq=False)
class _Deployed:
    """What was commanded and measured of one robot."""

    label: str
    run: Path
    gait: HeldGait
    design: Design
    trials: tuple[Trial, ...]

    @classmethod
    def read(cls, label: str, run: Path, settings: TransferSettings, notes: list[str]) -> _Deployed:
        """Read it; what is left out of it goes to the notes."""
        if not (run / SCHEDULE_FILE).is_file():
            trial_folders(run)  # says what a folder lacks that is none of a deployment
        gait, comments = read_gait(run / SCHEDULE_FILE, maximum_pressure_kPa=float("inf"))
        if "design" not in comments:
            raise ValueError(f"{run} is a bend test, expected the deployment of a design's gait")
        tracked, unseen = read_trials(run, settings.video)
        if unseen:
            notes.append(f"{label}: {', '.join(unseen)}: stopped, and without a track; left out")
        trials, told = whole_trials(label, tracked, gait.duration_s, settings.step_s)
        notes += [*told, *lost_notes(label, trials)]
        check_length(label, gait.duration_s, trials, settings.step_s)
        return cls(label, run, gait, Design.parse(comments["design"]), trials)

    @cached_property
    def finished(self) -> FinishedRun | None:
        """Its deployment; None where the folder has no summary."""
        return FinishedRun.read(self.run) if (self.run / SUMMARY).is_file() else None

    def goal(self) -> Goal | None:
        """What it was taught; None where no summary says so."""
        return None if self.finished is None else self.finished.goal

    def other_pressures(self, ours: UsedCalibration) -> list[str]:
        """What to tell where its commands were made for a robot whose pressures do otherwise."""
        theirs = None if self.finished is None else self.finished.calibration
        if theirs is None or theirs.digest is None:
            return []  # commanded as the gait has them
        lines = [(each.slope, each.intercept_kPa) for each in (theirs, ours)]
        if np.allclose(lines[0], lines[1], rtol=SAME_LINE):
            return []
        (slope, intercept), (our_slope, our_intercept) = lines
        return [
            f"{self.label} was deployed with {theirs.file} (slope {slope:.4g}, intercept "
            f"{intercept:.4g} kPa), for which its pressures were converted, and is simulated with "
            f"{ours.file} ({our_slope:.4g}, {our_intercept:.4g} kPa): these are not the commands "
            f"that the simulation should have; --calibration {theirs.file} simulates it as deployed"
        ]

    def tells_of(self, goal: Goal) -> bool:
        """Whether all tracks tell what of a goal was achieved."""
        return all(trial.track.achieved(goal, 0.0) is not None for trial in self.trials)


def _goal(deployed: Sequence[_Deployed], notes: list[str]) -> Goal:
    """What counts: what the last robot was taught, or the distance where nobody knows or tracks do
    not tell that; what a reader would not expect goes to the notes."""
    goals = {each.label: each.goal() for each in deployed}
    goal = goals[deployed[-1].label] or FORWARD
    unknown = ", ".join(label for label, own in goals.items() if own is None)
    if unknown:
        notes.append(f"what {unknown} was taught is not known: its folder has no {SUMMARY}")
    other = ", ".join(label for label, own in goals.items() if own is not None and own != goal)
    if other:
        notes.append(f"{other} was taught something else than the {goal.label} that is compared")
    silent = ", ".join(each.label for each in deployed if not each.tells_of(goal))
    if not silent:
        return goal
    notes.append(
        f"a {goal.label} counts, and the tracks of {silent} do not tell it: distances forward "
        "are compared; a second marker in front of the first tells (--video.marker-ahead)"
    )
    return FORWARD


def _robot(
    deployed: _Deployed, comparison: TrialComparison, first: TrialComparison
) -> ComparedRobot:
    tracking = [pressure_tracking(trial) for trial in deployed.trials]
    return ComparedRobot(
        **comparison.summary(),
        pressure_rms_kPa=_mean([each["rms_kPa"] for each in tracking]),
        pressure_delay_s=_mean([each["delay_s"] for each in tracking]),
        distance_over_first=_ratio(comparison, first),
        run=str(deployed.run),
        trajectory=_trajectory_file(comparison.label),
    )


def whole_trials(
    label: str, trials: Sequence[Trial], duration_s: float, step_s: float
) -> tuple[tuple[Trial, ...], list[str]]:
    """Leave out trials that were stopped, or whose tracks begin late or end early, where others do
    not: the shortest decides how much of the others counts, and what came before its begin is not
    known.

    Args:
        label: Name of the robot.
        trials: Its trials.
        duration_s: Length of the gait [s].
        step_s: How much of it a trial may miss at most, a step [s].

    Returns:
        Those to compare, and what to tell.
    """
    short = [
        each for each in trials if each.end_s < duration_s - step_s or each.track.time_s[0] > step_s
    ]
    if not short:
        return tuple(trials), []
    told = ", ".join(
        f"{each.name} from {max(each.track.time_s[0], 0.0):.2f} to {each.end_s:.2f} s"
        + (" (stopped)" if each.pressures.stopped else "")
        for each in short
    )
    ended = f"{label}: of a gait of {duration_s:g} s trials tell of a part: {told}"
    if len(short) == len(trials):
        return tuple(trials), [f"{ended}; what all have in common is compared"]
    return tuple(each for each in trials if each not in short), [f"{ended}; left out"]


def lost_notes(label: str, trials: Sequence[Trial]) -> list[str]:
    """What to tell of markers that were not seen for a while: straight lines are compared there."""
    told = [
        f"{each.name} from {begin_s:.2f} to {end_s:.2f} s"
        for each in trials
        for begin_s, end_s in each.track.lost()
        if end_s > 0.0 and begin_s < each.end_s
    ]
    if not told:
        return []
    return [
        f"{label}: the marker was not seen in {', '.join(told)}: the path is taken for a straight "
        "line there, and rewards of those steps and slides back are those of the line"
    ]


def _trajectory_file(label: str) -> str:
    return f"simulated_{label}.npz"


def _compared(
    spec: RobotSpec,
    deployed: _Deployed,
    settings: TransferSettings,
    folder: RunFolder,
    goal: Goal,
) -> TrialComparison:
    checkpoint = folder / f"checkpoint_{deployed.label}.npz"
    trajectory = recorded_walk(
        spec,
        deployed.design,
        deployed.gait,
        settings.model,
        checkpoint,
        record_every=5,
        progress=folder.progress,
        keep_checkpoint=True,
    )
    trajectory.with_skin_only().save(folder / _trajectory_file(deployed.label))
    checkpoint.unlink(missing_ok=True)
    return compare_trials(
        deployed.label,
        str(deployed.design),
        trajectory,
        deployed.trials,
        goal,
        settings.step_s,
        settings.cycle_s,
    )


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _ratio(comparison: TrialComparison, first: TrialComparison) -> DistanceRatio:
    """What counts over the first robot's, simulated and measured: the paper's factor of 2.3."""

    def over(ours: float, theirs: float) -> float | None:
        return ours / theirs if theirs > 0.0 else None

    whole = comparison.counted.simulated_whole and first.counted.simulated_whole
    return DistanceRatio(
        simulated=over(comparison.counted.simulated_end, first.counted.simulated_end)
        if whole
        else None,
        measured=over(comparison.counted.mean, first.counted.mean),
    )
