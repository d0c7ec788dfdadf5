"""A gait driven through a rig's regulators, trial after trial; or a bend test of one leg."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_text
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.unseen_pressure import say_lowered_pressure
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.vented_gait import VentedGait
from pneumorph.hardware.deployment import DeploymentReport, deploy
from pneumorph.hardware.deployment_log import DeploymentLog
from pneumorph.hardware.driver import (
    Clock,
    DriverError,
    ForeignDeviceError,
    RegulatorDriver,
    WallClock,
)
from pneumorph.hardware.guardian import Guardian
from pneumorph.hardware.marker_track import write_track
from pneumorph.hardware.open_driver import open_driver
from pneumorph.hardware.rig import Channel, RigSettings, load_rig
from pneumorph.hardware.schedule import Schedule, plan_schedule, skipped_note
from pneumorph.hardware.trial import LOG_FILE, SCHEDULE_FILE
from pneumorph.hardware.watch import PressureWatch
from pneumorph.reduction.snapshot_range import range_note
from pneumorph.robot.design import Design
from pneumorph.study.deployment_result import BENDS_FILE, DeployedGait, TrialOutcome
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.gait_source import bending_map, find_gait
from pneumorph.study.robot_at_rig import calibrated, with_air
from pneumorph.study.virtual_reality import VirtualReality

CHECKPOINT_FILE = "checkpoint.npz"
"""Of a virtual rig's finite elements, in their trial's folder until all trials are over."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """What the trials of a deployment share."""

    settings: DeploymentSettings
    rig: RigSettings
    schedule: Schedule
    design: Design | None
    folder: RunFolder


def deploy_gait(
    source: Path | None,
    settings: DeploymentSettings,
    robot: RobotOptions,
    folder: RunFolder,
    before_trial: Callable[[int], None] = lambda _: None,
) -> DeployedGait:
    """Plan a gait's schedule, run its trials, and return how each went.

    Args:
        source: Run folder, gait file or policy; None for the expert's gait.
        settings: Rig and trials.
        robot: The simulation that a virtual rig is off from; its calibration moves the gait's
            pressures to those that mean the same to the measured robot.
        folder: Receives ``schedule.csv`` and for each trial ``trial_N/log.csv``, on a virtual rig
            ``trial_N/track.csv`` as well; of a bend test ``bends.csv``.
        before_trial: Called with the number of each trial before a real rig is driven: the robot is
            to be placed.

    Raises:
        DriverError: A trial was stopped; the summary of the trials so far is on disk.
        ValueError: The gait does not fit the rig's limits, or would be cut to another gait by its
            calibration; a bend test is given one; or an option would be ignored.
    """
    start = time.monotonic()
    settings.refuse_source_of_bend_test(source)
    rig = RigSettings() if settings.rig is None else load_rig(settings.rig)
    _refuse_measured(folder, _walks_that_go_on(settings, rig))
    settings.refuse_unused(rig.driver)
    spec = robot.spec()
    if settings.rig is None:
        rig = replace(rig, channels=(Channel(),) * spec.physics.regulator_count)
    if settings.bend_test and rig.driver == "virtual":
        _ = spec.module  # a bend test is of one leg, whichever of the robot's it is
    described: dict[str, Any]
    if settings.bend_test:
        gait: Any = settings.bends.gait(len(rig.channels))
        design, described, goal = None, {"gait": "bend test"}, None
    else:
        found = find_gait(source, settings.design, settings.expert, settings.rank)
        for note in (found.other_design_note, found.own_task_note):
            if note is not None:
                folder.progress.say(note)
        design, goal = found.design, found.goal
        gait = VentedGait.of(found.gait, design)
        described = {"gait": found.name, "design": str(design), "learned_for": found.own_task}
        if found.own_task_note is not None:
            described["notes"] = (found.own_task_note,)
        if spec.calibration is not None:  # otherwise its pressures are commanded as they are
            # Beside a calibration, the options hold the map of the leg as it is before measuring.
            trained = found.bending_map or robot.physics.pressure_map
            gait, cut = calibrated(gait, trained, bending_map(spec), rig, folder)
            described |= cut
    try:
        schedule = plan_schedule(gait, rig)  # first: it knows how many channels there must be
        rig = with_air(rig, spec, design)
        rig.air.check_supply(schedule.pressure_kPa)
        PressureWatch(rig)  # a rig that cannot be watched is refused, though nothing be sent yet
        if rig.driver != "virtual":
            open_driver(rig)  # nor one whose driver cannot be: it is not connected yet
    except ValueError as error:
        if settings.rig is None:
            raise
        raise ValueError(f"rig file {settings.rig}: {error}") from error
    _save_schedule(schedule, design, folder)
    planned = DeployedGait(
        **described,
        goal=goal,
        driver=rig.driver,
        rig=settings_to_dict(rig),
        duration_s=schedule.duration_s,
        command_count=len(schedule.time_s),
        **spec.describe(reduced=False),
    )
    plan = _Plan(settings, rig, schedule, design, folder)
    _say_what_is_taken(plan, robot, spec)
    if settings.dry_run:
        for line in schedule.lines():
            folder.progress.say(line)
        done = replace(planned, schedule=tuple(schedule.lines()))
    elif settings.bend_test and rig.driver == "virtual":
        folder.progress.stage("bending the virtual rig's leg")
        done = _bend_test(_reality(settings, robot), planned, plan)
    elif rig.driver == "virtual":
        _warn_of_missing_sensors(rig, folder)
        done = _virtual_trials(planned, plan, robot)
    else:
        _warn_of_missing_sensors(rig, folder)
        done = _real_trials(planned, plan, before_trial)
    return replace(done, wall_s=time.monotonic() - start)


def _say_what_is_taken(plan: _Plan, robot: RobotOptions, spec: RobotSpec) -> None:
    """Which design and world a described robot has, and how long finite elements will take."""
    settings, say = plan.settings, plan.folder.progress.say
    for note in robot.notes(None if plan.design is None else str(plan.design), spec):
        say(note)
    say_lowered_pressure(spec, float(plan.schedule.pressure_kPa.max(initial=0.0)), say)
    walks = plan.rig.driver == "virtual" and not (settings.dry_run or settings.bend_test)
    if walks and settings.model == "full":
        measured = robot.physics_name == "measured"
        minutes = (1.5 if measured else 0.5) * plan.schedule.duration_s
        say(
            f"the robot behind the virtual rig is of finite elements: about {minutes:.0f} min for "
            f"each of {settings.trials} trials of {plan.schedule.duration_s:g} s on an idle "
            "machine; stopped, the same command with the same --out goes on; --model reduced takes "
            "seconds"
        )


def _walks_that_go_on(settings: DeploymentSettings, rig: RigSettings) -> set[str]:
    """Folders of trials whose walks, where they were stopped, go on from their checkpoints."""
    if rig.driver != "virtual" or settings.model != "full" or settings.bend_test:
        return set()
    return {f"trial_{number}" for number in range(1, settings.trials + 1)}


def _refuse_measured(folder: RunFolder, go_on: set[str]) -> None:
    """Keep what was measured: a trial is not made again, and two robots' are not mixed.

    Args:
        folder: Where trials are to be written.
        go_on: Folders of trials that may have been stopped in their walk.

    Raises:
        ValueError: The folder has other trials.
    """
    trials = [log.parent for log in folder.path.glob(f"*/{LOG_FILE}")]
    if not all(each.name in go_on and (each / CHECKPOINT_FILE).exists() for each in trials):
        raise ValueError(
            f"{folder.path} holds the trials of an earlier deployment, expected a folder of its "
            "own for each: they would be overwritten, or mixed with these; choose another --out"
        )


def _save_schedule(schedule: Schedule, design: Design | None, folder: RunFolder) -> None:
    held = HeldGait(
        schedule.time_s[:-1],
        schedule.pressure_kPa[:-1],
        schedule.duration_s,
        maximum_pressure_kPa=float("inf"),
    )
    comments = {} if design is None else {"design": str(design)}
    write_gait(folder / SCHEDULE_FILE, held, comments)


def _bend_test(reality: VirtualReality, planned: DeployedGait, plan: _Plan) -> DeployedGait:
    bends = plan.settings.bends
    pressures = np.repeat(bends.pressures_kPa, bends.repeats)
    measured = reality.bend_test(pressures)
    lines = ["pressure_kPa,bend_deg"]
    lines += [f"{p:.6g},{b:.4f}" for p, b in zip(pressures, measured, strict=True)]
    text = "\n".join(lines) + "\n"
    path = write_text(plan.folder / BENDS_FILE, text)
    return replace(
        planned, model=plan.settings.model, bends=str(path), measurement_count=len(measured)
    )


def _virtual_trials(planned: DeployedGait, plan: _Plan, robot: RobotOptions) -> DeployedGait:
    reality, settings = _reality(plan.settings, robot), plan.settings
    assert plan.design is not None
    design = plan.design
    planned = replace(
        planned,
        model=settings.model,
        virtual_seed=settings.virtual.seed,
        **robot.spec().describe(settings.model == "reduced", design),
    )

    def trial(number: int, name: str) -> TrialOutcome:
        checkpoint = plan.folder / name / CHECKPOINT_FILE
        driver = reality.rig(design, plan.rig, number, checkpoint, plan.folder.progress)
        report = _driven(plan, driver, driver.clock, None, name)
        try:
            track = driver.track()
        except DriverError as error:
            raise DriverError(f"{name}: {error}") from error
        if track is None:  # it was stopped before the camera saw it move
            return TrialOutcome(**vars(report), trial=name)
        write_track(plan.folder / f"{name}/track.csv", track)
        end_s = plan.schedule.duration_s
        return TrialOutcome(
            **vars(report),
            trial=name,
            distance_cm=track.achieved(FORWARD, end_s),
            turned_deg=track.achieved(Goal("turn_left"), end_s),
            achieved=track.achieved(planned.goal or FORWARD, end_s),
            range_ratio=driver.range_ratio,
        )

    done = _each_trial(planned, plan, trial)
    for each in done.trials:
        (plan.folder / each.trial / CHECKPOINT_FILE).unlink(missing_ok=True)
    return done


def _real_trials(
    planned: DeployedGait, plan: _Plan, before_trial: Callable[[int], None]
) -> DeployedGait:
    def trial(number: int, name: str) -> TrialOutcome:
        before_trial(number)
        guardian = Guardian(plan.rig, plan.folder / f"{name}/guardian.json")
        vented = False
        try:
            report = _driven(plan, open_driver(plan.rig), WallClock(), guardian, name)
            vented = report.vented
            return TrialOutcome(**vars(report), trial=name)
        except ForeignDeviceError:
            vented = True  # nothing was commanded, and another's device is sent nothing
            raise
        finally:
            guardian.dismiss(vented)

    return _each_trial(planned, plan, trial)


def _each_trial(
    planned: DeployedGait,
    plan: _Plan,
    trial: Callable[[int, str], TrialOutcome],
) -> DeployedGait:
    """Run every trial; one that was stopped ends the run.

    Raises:
        DriverError: A trial was stopped; the summary of the trials so far is on disk.
    """
    folder, count = plan.folder, plan.settings.trials
    trials: list[TrialOutcome] = []
    try:
        for number in range(1, count + 1):
            name = f"trial_{number}"
            folder.progress.stage(f"trial {number} of {count}")
            trials.append(outcome := trial(number, name))
            if not outcome.completed:
                raise DriverError(
                    f"{name} was stopped after {outcome.ended_s:.2f} s: {outcome.reason}; "
                    f"{outcome.ending}; its log is {folder.path / name / LOG_FILE}"
                )
    except BaseException as error:
        if trials:
            _save_so_far(replace(planned, trials=tuple(trials)), folder, error)
        raise
    known = [each.distance_cm for each in trials if each.distance_cm is not None]
    achieved = [each.achieved for each in trials if each.achieved is not None]
    ratios = [each.range_ratio for each in trials if each.range_ratio is not None]
    skipped = {each.trial: each.skipped_count for each in trials}
    notes = (
        range_note("the virtual rig's robot", max(ratios, default=None)),
        skipped_note(skipped, len(plan.schedule.time_s) - 1),
    )
    return replace(
        planned,
        trials=tuple(trials),
        mean_distance_cm=float(np.mean(known)) if known else None,
        spread_cm=float(np.std(known, ddof=1)) if len(known) > 1 else None,
        mean_achieved=float(np.mean(achieved)) if achieved else None,
        notes=(*planned.notes, *(note for note in notes if note is not None)),
    )


def _save_so_far(found: DeployedGait, folder: RunFolder, error: BaseException) -> None:
    """Write the summary of the trials so far; where that fails, the error that ended them says so:
    a full disk must not hide what to do at the rig."""
    try:
        folder.save_summary(result_to_dict(found))
    except OSError as failure:
        said = f"the summary cannot be written: {failure}"
        error.args = (f"{error}; {said}",) if str(error) else (said,)


def _reality(settings: DeploymentSettings, robot: RobotOptions) -> VirtualReality:
    if settings.model == "reduced":
        robot.refuse_full_options()
    plain = replace(robot, calibration=None).spec()
    return VirtualReality(plain, settings.virtual, settings.model)


def _warn_of_missing_sensors(rig: RigSettings, folder: RunFolder) -> None:
    blind = [str(number) for number in 1 + np.flatnonzero(~rig.has_sensor)]
    if blind:
        folder.progress.say(
            f"no pressure sensor on channel {', '.join(blind)}: stuck valves, leaks and burst "
            "tubes go unnoticed there"
        )


def _driven(
    plan: _Plan, driver: RegulatorDriver, clock: Clock, guardian: Guardian | None, name: str
) -> DeploymentReport:
    rig, folder = plan.rig, plan.folder
    comments = {"driver": rig.driver, "started_unix_s": f"{time.time():.3f}"}
    with DeploymentLog(folder / f"{name}/{LOG_FILE}", len(rig.channels), comments) as log:
        return deploy(plan.schedule, driver, rig, log, clock, guardian, folder.progress)
