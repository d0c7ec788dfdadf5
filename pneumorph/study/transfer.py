"""Trials on a rig beside the simulation of what was commanded: how far reality follows it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, Positive
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import Trial, read_trial, trial_folders
from pneumorph.hardware.trial_comparison import TrialComparison, compare_trials, pressure_tracking
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design
from pneumorph.study.deployed_gait import SCHEDULE_FILE
from pneumorph.study.recorded_walk import Model, recorded_walk


@dataclass(frozen=True)
class TransferSettings(Checked):
    """The simulation, and over which times distances are counted."""

    model: Model = "reduced"
    """Model of the simulated robots: reduced, or finite elements (minutes each)."""
    step_s: Positive = 1.0
    """Length of a step [s]; the reward is the distance covered in each."""
    cycle_s: Positive = 4.0
    """Length of a gait cycle [s]; the slide back is counted within each."""
    video: VideoSettings = field(default_factory=VideoSettings)


@dataclass(frozen=True)
class DistanceRatio:
    """Distance over the first robot's; None where that went nowhere."""

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
    """Measured over simulated distance; None where the simulation goes nowhere."""
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
    figures: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    """Trials that were left out, or cut the comparison short."""


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
        FileNotFoundError: A deployment has no trials, or a trial no track.
        ValueError: There are no runs, one is a bend test, or a label is none or not the only one.
    """
    start = time.monotonic()
    if not runs:
        raise ValueError("runs is empty, expected at least one folder of `pneumorph deploy`")
    labelled = labelled_runs(runs)
    compared: list[tuple[Path, TrialComparison, tuple[Trial, ...]]] = []
    notes: list[str] = []
    for number, (label, run) in enumerate(labelled.items(), start=1):
        folder.progress.stage(f"simulating {label} ({number} of {len(runs)})")
        trials = tuple(read_trial(each, settings.video) for each in trial_folders(run))
        gait, design = _schedule(run)
        trials, told = whole_trials(label, trials, gait.duration_s, settings.step_s)
        notes += told
        found_there = _compared(spec, gait, design, label, trials, settings, folder)
        compared.append((run, found_there, trials))
        spread = found_there.spread_cm
        folder.progress.say(
            f"{label}: {found_there.mean_distance_cm:.1f} cm forward measured, "
            + ("" if spread is None else f"deviation {spread:.1f}, ")
            + f"{found_there.simulated_distance_cm:.1f} cm simulated"
        )
    first = compared[0][1]
    robots = tuple(_robot(run, each, trials, first) for run, each, trials in compared)
    write_json(folder / "comparison.json", {"robots": [result_to_dict(robot) for robot in robots]})
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
        **spec.describe(reduced=settings.model == "reduced"),
        wall_s=time.monotonic() - start,
        notes=tuple(notes),
    )
    comparisons = tuple(each for _, each, _ in compared)
    return TransferStudy(found, comparisons, tuple(trials for _, _, trials in compared))


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


def _robot(
    run: Path, comparison: TrialComparison, trials: Sequence[Trial], first: TrialComparison
) -> ComparedRobot:
    tracking = [pressure_tracking(trial) for trial in trials]
    return ComparedRobot(
        **comparison.summary(),
        pressure_rms_kPa=_mean([each["rms_kPa"] for each in tracking]),
        pressure_delay_s=_mean([each["delay_s"] for each in tracking]),
        distance_over_first=_ratio(comparison, first),
        run=str(run),
        trajectory=_trajectory_file(comparison.label),
    )


def _schedule(run: Path) -> tuple[HeldGait, str]:
    """What a deployment commanded, and the design."""
    gait, comments = read_gait(run / SCHEDULE_FILE, maximum_pressure_kPa=float("inf"))
    if "design" not in comments:
        raise ValueError(f"{run} is a bend test, expected the deployment of a design's gait")
    return gait, comments["design"]


def whole_trials(
    label: str, trials: Sequence[Trial], duration_s: float, step_s: float
) -> tuple[tuple[Trial, ...], list[str]]:
    """Leave out trials that ended early, where others did not: the shortest decides how much of
    the others counts.

    Args:
        label: Name of the robot.
        trials: Its trials.
        duration_s: Length of the gait [s].
        step_s: How much of it a track may miss at most, a step [s].

    Returns:
        Those to compare, and what to tell.
    """
    short = [each for each in trials if each.track.time_s[-1] < duration_s - step_s]
    if not short:
        return tuple(trials), []
    told = ", ".join(f"{each.name} after {each.track.time_s[-1]:.2f} s" for each in short)
    ended = f"{label}: of a gait of {duration_s:g} s the tracks end early: {told}"
    if len(short) == len(trials):
        return tuple(trials), [f"{ended}; what all have in common is compared"]
    return tuple(each for each in trials if each not in short), [f"{ended}; left out"]


def _trajectory_file(label: str) -> str:
    return f"simulated_{label}.npz"


def _compared(
    spec: RobotSpec,
    gait: HeldGait,
    design: str,
    label: str,
    trials: Sequence[Trial],
    settings: TransferSettings,
    folder: RunFolder,
) -> TrialComparison:
    trajectory = recorded_walk(
        spec,
        Design.parse(design),
        gait,
        settings.model,
        folder / f"checkpoint_{label}.npz",
        record_every=5,
        progress=folder.progress,
    )
    trajectory.with_skin_only().save(folder / _trajectory_file(label))
    return compare_trials(
        label,
        design,
        trajectory.time_s,
        trajectory.forward_cm,
        trials,
        settings.step_s,
        settings.cycle_s,
        simulated_turned_deg=trajectory.turned_deg,
    )


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _ratio(comparison: TrialComparison, first: TrialComparison) -> DistanceRatio:
    """Distance over the first robot's, simulated and measured: the paper's factor of 2.3."""

    def over(ours: float, theirs: float) -> float | None:
        return ours / theirs if theirs > 0.0 else None

    return DistanceRatio(
        simulated=over(comparison.simulated_distance_cm, first.simulated_distance_cm),
        measured=over(comparison.mean_distance_cm, first.mean_distance_cm),
    )
