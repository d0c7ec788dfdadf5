"""Trials on a rig beside the simulation of what was commanded: how far reality follows it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, Positive
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.trial import Trial
from pneumorph.hardware.trial_comparison import (
    LEAST_SIMULATED,
    TrialComparison,
    compare_trials,
    pressure_tracking,
)
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.study.deployed_robot import DeployedRobot, labelled_runs
from pneumorph.study.recorded_walk import Model, recorded_walk


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
    """What was achieved over what the first robot achieved; None where that was next to nothing, to
    which noise alone has a ratio, or backward."""

    simulated: float | None
    measured: float | None


@dataclass(frozen=True)
class ComparedRobot:
    """One robot, simulated and measured. Means are over its trials."""

    label: str
    design: str
    simulated_distance_cm: float
    distances_cm: tuple[float, ...]
    """Of each trial, (trial,)."""
    mean_distance_cm: float
    spread_cm: float | None
    """Standard deviation over trials; None of a single one."""
    transfer_ratio: float | None
    """Measured over simulated, of what counts; None where the simulation achieves nothing."""
    simulated_reward_per_step_cm: tuple[float, ...]
    """Forward travel in each step, (step,)."""
    mean_reward_per_step_cm: tuple[float, ...]
    """The same of the trials."""
    simulated_backsliding_cm: float
    """Mean furthest slide back in a cycle."""
    mean_backsliding_cm: float
    """The same of the trials."""
    path_rms_cm: float
    """Root mean square difference of forward travel, the trials' mean from the simulation."""
    pressure_rms_kPa: float | None
    """Commanded against sensed pressure; None without sensors, as is the delay."""
    pressure_delay_s: float | None
    """By how much the sensed pressure is behind the commanded one."""
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
    """What of the goal was achieved in each step [the goal's unit], (step,)."""
    mean_step_rewards: tuple[float, ...] = ()
    """The same of the trials."""


@dataclass(frozen=True)
class Transfer:
    """Robots simulated and measured; the plain numbers are the last robot's."""

    model: str
    transfer_ratio: float | None
    mean_distance_cm: float
    spread_cm: float | None
    simulated_distance_cm: float
    step_s: float
    """Length of a step, whose rewards are told [s]."""
    cycle_s: float
    """Length of a cycle, over which slides back are counted [s]."""
    robots: tuple[ComparedRobot, ...]
    damping: str
    calibration: UsedCalibration
    wall_s: float
    """Wall time of all [s]."""
    leg: PartsSummary | None = None
    """The reduced leg; None for finite elements."""
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
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
    notes = [*spec.calibration_notes]
    deployed = [
        DeployedRobot.read(label, run, settings.video, settings.step_s, notes)
        for label, run in labelled_runs(runs).items()
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


def _goal(deployed: Sequence[DeployedRobot], notes: list[str]) -> Goal:
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
    deployed: DeployedRobot, comparison: TrialComparison, first: TrialComparison
) -> ComparedRobot:
    with_legs = {number for leg in deployed.design.fittings for number in leg.regulators}
    tracking = [
        pressure_tracking(trial, with_legs, deployed.gait.duration_s) for trial in deployed.trials
    ]
    return ComparedRobot(
        **comparison.summary(),
        pressure_rms_kPa=_mean([each["rms_kPa"] for each in tracking]),
        pressure_delay_s=_mean([each["delay_s"] for each in tracking]),
        distance_over_first=_ratio(comparison, first),
        run=str(deployed.run),
        trajectory=_trajectory_file(comparison.label),
    )


def _trajectory_file(label: str) -> str:
    return f"simulated_{label}.npz"


def _compared(
    spec: RobotSpec,
    deployed: DeployedRobot,
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
        return ours / theirs if theirs >= LEAST_SIMULATED[comparison.counted.goal.unit] else None

    whole = comparison.counted.simulated_whole and first.counted.simulated_whole
    return DistanceRatio(
        simulated=over(comparison.counted.simulated_end, first.counted.simulated_end)
        if whole
        else None,
        measured=over(comparison.counted.mean, first.counted.mean),
    )
