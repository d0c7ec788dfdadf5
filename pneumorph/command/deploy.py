"""Drive a rig with a gait: timed commands, a watchdog, and logs of every trial.

The gait is a run's best pair (runs/quick), a gait file (CSV, or sorotraj YAML), a policy (npz with
--design), or the expert's. The rig is --rig FILE (JSON or TOML: driver, channels, limits), by
default a virtual one: a robot that is off by a seeded amount behind imperfect regulators. --dry-run
prints the schedule and commands nothing.

A real run vents on Ctrl-C, on a lost connection, a late or senseless answer, a stuck sensor or a
pressure out of range, and a guardian process vents when this one dies. With --calibration the
gait's pressures are those that mean to the measured robot what they meant in training.

Writes schedule.csv and, for each trial, trial_N/log.csv and on the virtual rig trial_N/track.csv;
on a real one put the video tracker's table there. --bend-test measures one leg instead.

Example: pneumorph deploy runs/quick --model reduced --trials 5 --out runs/deploy-L1
"""

from __future__ import annotations

import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_atomically
from pneumorph.command.gait_source import find_gait, recalibrated
from pneumorph.command.robots import Model, RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.command.virtual_reality import VirtualReality
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.open_loop_gait import OpenLoopGait
from pneumorph.hardware.deployment import DeploymentReport, deploy
from pneumorph.hardware.deployment_log import DeploymentLog
from pneumorph.hardware.driver import Clock, DriverError, RegulatorDriver, WallClock
from pneumorph.hardware.guardian import Guardian
from pneumorph.hardware.marker_track import write_track
from pneumorph.hardware.rig import RigSettings, load_rig, open_driver
from pneumorph.hardware.schedule import Schedule, plan_schedule
from pneumorph.hardware.trial import LOG_FILE
from pneumorph.hardware.virtual_rig import VirtualRigSettings
from pneumorph.robot.design import Design
from pneumorph.settings import settings_to_dict

flat = tyro.conf.arg(name="")

SCHEDULE_FILE = "schedule.csv"
BENDS_FILE = "bends.csv"


@dataclass(frozen=True)
class BendTestSettings:
    """A bend test: regulator 1 climbs a staircase while the leg is held at its root."""

    highest_kPa: float = 90.0
    """Last pressure [kPa]."""
    step_kPa: float = 10.0
    """Step between pressures [kPa]."""
    hold_s: float = 10.0
    """How long each is held, to read the bend [s]."""
    repeats: int = 3
    """Measurements of each pressure on the virtual rig."""

    @property
    def pressures_kPa(self) -> np.ndarray:
        """The stairs [kPa]."""
        return np.arange(self.step_kPa, self.highest_kPa + 0.5 * self.step_kPa, self.step_kPa)

    def gait(self, regulator_count: int) -> HeldGait:
        """The staircase."""
        held = np.zeros((len(self.pressures_kPa), regulator_count))
        held[:, 0] = self.pressures_kPa
        return HeldGait.evenly(held, self.hold_s)


@dataclass(frozen=True)
class DeployOptions:
    """The gait, the rig and its trials."""

    source: tyro.conf.Positional[Path | None] = None
    """Run folder, gait file or policy; by default the expert's gait."""
    rank: int = 1
    """Which of a run's best pairs."""
    design: str | None = None
    """Design, where the gait does not name it."""
    trials: int = 5
    """How often the gait is run."""
    dry_run: bool = False
    """Print the schedule and command nothing."""
    bend_test: bool = False
    """Run a bend test of one leg instead of a gait."""
    rig: Path | None = None
    """Rig file; by default a virtual rig."""
    model: Model = "full"
    """Robot behind the virtual rig: finite elements (many minutes a trial), or reduced."""
    virtual: VirtualRigSettings = field(default_factory=VirtualRigSettings)
    bends: BendTestSettings = field(default_factory=BendTestSettings)
    expert: ExpertGait = field(default_factory=ExpertGait)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        if self.trials < 1:
            raise ValueError(f"trials is {self.trials}, expected at least 1")


def deploy_gait(options: DeployOptions, folder: RunFolder) -> dict[str, Any]:
    """Plan a gait's schedule, run its trials, and return how each went."""
    start = time.monotonic()
    rig = RigSettings() if options.rig is None else load_rig(options.rig)
    workshop = Workshop(options.robot)
    gait, design, described = _gait(options, workshop, rig)
    schedule = plan_schedule(gait, rig)
    _save_schedule(schedule, design, folder)
    summary: dict[str, Any] = {
        **described,
        "driver": rig.driver,
        "rig": settings_to_dict(rig),
        "duration_s": schedule.duration_s,
        "command_count": len(schedule.time_s),
        "calibration": workshop.calibration_description,
    }
    if options.dry_run:
        for line in schedule.lines():
            folder.progress.say(line)
        summary["schedule"] = schedule.lines()
    elif options.bend_test and rig.driver == "virtual":
        reality = VirtualReality(workshop, options.virtual, options.model)
        folder.progress.stage("bending the virtual rig's leg")
        summary |= _bend_test(reality, options, folder)
    else:
        summary["trials"] = _run_trials(options, workshop, rig, schedule, design, folder, summary)
        summary |= _distances(summary["trials"])
    return summary | {"wall_s": time.monotonic() - start}


def _gait(
    options: DeployOptions, workshop: Workshop, rig: RigSettings
) -> tuple[OpenLoopGait, Design | None, dict[str, Any]]:
    if options.bend_test:
        return options.bends.gait(len(rig.channels)), None, {"gait": "bend test"}
    found = find_gait(options.source, options.design, options.expert, options.rank)
    measured = workshop.simulation.pressure_map
    highest = min(channel.highest_kPa for channel in rig.channels)
    gait = found.gait
    # Without a calibration the gait's own pressures are commanded as they are.
    if workshop.calibration is not None:
        gait = recalibrated(gait, found.pressure_map, measured, highest)
    return gait, found.design, {"gait": found.name, "design": str(found.design)}


def _save_schedule(schedule: Schedule, design: Design | None, folder: RunFolder) -> None:
    held = HeldGait(
        schedule.time_s[:-1],
        schedule.pressure_kPa[:-1],
        schedule.duration_s,
        maximum_pressure_kPa=float("inf"),
    )
    comments = {} if design is None else {"design": str(design)}
    write_gait(folder / SCHEDULE_FILE, held, comments)


def _bend_test(
    reality: VirtualReality, options: DeployOptions, folder: RunFolder
) -> dict[str, Any]:
    pressures = np.repeat(options.bends.pressures_kPa, options.bends.repeats)
    measured = reality.bend_test(pressures)
    lines = ["pressure_kPa,bend_deg"]
    lines += [f"{p:.6g},{b:.4f}" for p, b in zip(pressures, measured, strict=True)]
    text = "\n".join(lines) + "\n"
    path = write_atomically(folder / BENDS_FILE, lambda stream: stream.write(text.encode()))
    return {"model": options.model, "bends": str(path), "measurement_count": len(measured)}


def _run_trials(
    options: DeployOptions,
    workshop: Workshop,
    rig: RigSettings,
    schedule: Schedule,
    design: Design | None,
    folder: RunFolder,
    summary: dict[str, Any],
) -> list[dict[str, Any]]:
    """Run every trial; a trial that was stopped ends the run.

    Raises:
        DriverError: A trial was stopped; the summary of the trials so far is on disk.
    """
    reality = (
        VirtualReality(workshop, options.virtual, options.model)
        if rig.driver == "virtual"
        else None
    )
    if reality is not None:
        summary["model"] = options.model
        summary |= workshop.leg_used(options.model)
        summary["virtual_seed"] = options.virtual.seed
    trials: list[dict[str, Any]] = []
    for number in range(1, options.trials + 1):
        name = f"trial_{number}"
        folder.progress.stage(f"trial {number} of {options.trials}")
        if reality is None:
            _wait_for_person(number)
            report = _real_trial(rig, schedule, folder, name)
            trial: dict[str, Any] = {"trial": name, **asdict(report)}
        else:
            assert design is not None
            driver = reality.rig(design, rig, number)
            report = _trial(rig, schedule, driver, driver.clock, None, folder, name)
            track = driver.track()
            write_track(folder / f"{name}/track.csv", track)
            travel = float(track.forward_cm(np.array([schedule.duration_s]))[0])
            trial = {"trial": name, **asdict(report), "distance_cm": travel}
        trials.append(trial)
        if not report.completed:
            folder.save_summary({**summary, "trials": trials})
            raise DriverError(
                f"{name} was stopped after {report.ended_s:.2f} s: {report.reason}; "
                + ("vented" if report.vented else "NOT VENTED, cut the supply by hand")
                + f"; its log is {folder.path / name / LOG_FILE}"
            )
    return trials


def _wait_for_person(number: int) -> None:
    if sys.stdin is not None and sys.stdin.isatty():
        input(f"Place the robot for trial {number} and press Enter. ")


def _real_trial(
    rig: RigSettings, schedule: Schedule, folder: RunFolder, name: str
) -> DeploymentReport:
    guardian = Guardian(rig, folder / f"{name}/guardian.json")
    vented = False
    try:
        report = _trial(rig, schedule, open_driver(rig), WallClock(), guardian, folder, name)
        vented = report.vented
        return report
    finally:
        guardian.dismiss(vented)


def _trial(
    rig: RigSettings,
    schedule: Schedule,
    driver: RegulatorDriver,
    clock: Clock,
    guardian: Guardian | None,
    folder: RunFolder,
    name: str,
) -> DeploymentReport:
    comments = {"driver": rig.driver, "started_unix_s": f"{time.time():.3f}"}
    with DeploymentLog(folder / f"{name}/{LOG_FILE}", len(rig.channels), comments) as log:
        return deploy(schedule, driver, rig, log, clock, guardian, folder.progress)


def _distances(trials: list[dict[str, Any]]) -> dict[str, Any]:
    distances = [trial["distance_cm"] for trial in trials if "distance_cm" in trial]
    if not distances:
        return {}
    spread = float(np.std(distances, ddof=1)) if len(distances) > 1 else None
    return {"mean_distance_cm": float(np.mean(distances)), "spread_cm": spread}


VERB = Verb(DeployOptions, deploy_gait)
