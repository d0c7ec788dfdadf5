"""Sections of the real robot: trials, calibration, transfer."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np

from pneumorph.hardware.deployment import DeploymentReport
from pneumorph.hardware.deployment_log import read_log
from pneumorph.hardware.marker_track import (
    MarkerTrack,
    VideoSettings,
    read_track,
    says_its_units,
)
from pneumorph.hardware.trial import LOG_FILE, TRACK_PATTERN, Trial, read_trials, trial_folders
from pneumorph.report import page
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.page import Section
from pneumorph.report.scene import Actor
from pneumorph.report.sheet import Sheet
from pneumorph.report.trial_figures import trials_figure
from pneumorph.report.walk_figures import step_figure
from pneumorph.study.deployed_robot import whole_trials
from pneumorph.study.deployment_result import BENDS_FILE, DeployedGait
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import FittedCalibration
from pneumorph.study.fitted_valves import NORMAL_95
from pneumorph.study.transfer import ComparedRobot, Transfer
from pneumorph.trajectory import Trajectory


def deployment_sections(found: DeployedGait, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return what a dry run would command, or the trials, or the bends that were measured."""
    sections = []
    if found.schedule:
        lines = page.command_lines(found.schedule)
        sections.append(Section("What would be commanded", lines))
    if found.trials:
        sections.append(_trials_section(found, run, sheet))
    if found.bends is not None:
        rows = [line.split(",") for line in (run.folder / BENDS_FILE).read_text().splitlines()]
        sections.append(Section("Measured bends", page.table(rows[0], rows[1:])))
    return sections


def _trials_section(found: DeployedGait, run: FinishedRun, sheet: Sheet) -> Section:
    logs, tracks = [], dict[str, MarkerTrack]()
    for folder in trial_folders(run.folder):
        log = read_log(folder / LOG_FILE)
        if len(log.time_s):
            logs.append(log)
        files = sorted(folder.glob(TRACK_PATTERN))
        if len(files) == 1 and says_its_units(files[0]):
            tracks[folder.name.replace("_", " ")] = read_track(files[0])
    caption = "Commanded (dashed) and sensed pressures, the first trial boldly"
    caption += "; below, the marker's travel." if tracks else "."
    names = ["trial", *(each.name for each in fields(DeploymentReport)), "distance_cm"]
    rows = [[getattr(trial, name) for name in names] for trial in found.trials]
    header = [name.replace("_", " ") for name in names]
    if found.goal is not None and not found.goal.is_forward:
        header.append(found.goal.in_unit(found.goal.label))
        rows = [[*row, trial.achieved] for row, trial in zip(rows, found.trials, strict=True)]
    body = page.table(header, rows)
    if logs:
        body = sheet.drawn("trials", trials_figure(logs, tracks), caption) + body
    return Section("Trials", body)


def transfer_sections(found: Transfer, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return robots simulated and measured, side by side and step by step."""
    goal = found.goal
    pictures = [
        page.picture(run.folder / name, caption)
        for name, caption in (
            ("transfer_rewards.png", f"{goal.title} simulated and measured; dots are trials."),
            ("transfer_gaits.png", f"Pressures commanded and sensed, and {goal.label} over time."),
        )
    ]
    columns = ["simulated_distance_cm", "mean_distance_cm", "spread_cm", "transfer_ratio",
               "simulated_backsliding_cm", "mean_backsliding_cm", "path_rms_cm"]  # fmt: skip
    header = [name.replace("_", " ") for name in columns]
    if not goal.is_forward:
        columns = ["simulated_achieved", "mean_achieved", "achieved_spread", "transfer_ratio"]
        header = [
            *(goal.in_unit(f"{goal.label}, {each}") for each in ("simulated", "measured")),
            goal.in_unit("deviation"),
            "transfer ratio",
        ]
    table = page.table(
        ["", "design", *header],
        [
            [each.label, each.design, *(getattr(each, name) for name in columns)]
            for each in found.robots
        ],
    )
    step_s = found.step_s
    paths = _summed_steps(found)
    shortest = min(float(time_s[-1]) for time_s, _ in paths.values())
    steps = step_figure(paths, step_s, min(found.cycle_s, shortest), goal)
    drawn = sheet.drawn(
        "steps",
        steps,
        f"{goal.title} of every {step_s:g} s, simulated and measured (mean of trials), and "
        "below zero the furthest slide back between steps.",
    )
    return [
        Section("Simulated and measured", "".join(pictures) + table),
        *_replay_sections(found, run, sheet),
        Section("Step by step", drawn),
    ]


def _replay_sections(found: Transfer, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return each simulated robot beside the first of its trials that is still on disk."""
    sections = []
    for each in found.robots:
        label, simulated = each.label, run.folder / each.trajectory
        if not simulated.exists():
            continue
        walked = Trajectory.load(simulated)
        actors: list[Actor | MarkerActor] = [Actor.of(walked, f"{label} simulated", found.goal)]
        duration_s = float(walked.time_s[-1])
        if (trial := _first_trial(each, found.step_s, duration_s, run)) is not None:
            actors.append(MarkerActor.of(trial, f"{label} {trial.name.replace('_', ' ')}"))
        caption = "The simulation, and the marker of the first trial."
        if not found.goal.is_forward:
            caption += (
                f" Of the simulation {found.goal.label} is told, of a marker its way forward."
            )
        replay = sheet.replayed(actors, caption)
        sections.append(Section(f"Replay of {label}", replay))
    return sections


def _first_trial(
    robot: ComparedRobot, step_s: float, duration_s: float, run: FinishedRun
) -> Trial | None:
    """The first trial that was compared, if all are still on disk."""
    video = run.structured("settings.video", VideoSettings)
    try:
        trials, _ = read_trials(Path(robot.run), video)
    except FileNotFoundError:
        return None
    whole, _ = whole_trials(robot.label, trials, duration_s, step_s)
    return whole[0]


def _summed_steps(found: Transfer) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What of the goal is achieved at the end of each step, by robot and source."""
    paths = {}
    for each in found.robots:
        told = (
            (each.simulated_reward_per_step_cm, each.mean_reward_per_step_cm)
            if found.goal.is_forward
            else (each.simulated_step_rewards, each.mean_step_rewards)
        )
        for rewards, name in zip(told, ("simulated", "measured"), strict=True):
            way = np.concatenate([[0.0], np.cumsum(rewards)])
            paths[f"{each.label} {name}"] = (found.step_s * np.arange(len(way)), way)
    return paths


def calibration_sections(found: FittedCalibration, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return what was fitted, with its confidence intervals."""
    fitted = {
        "slope": found.slope,
        "intercept_kPa": found.intercept_kPa,
        "modulus_factor": found.modulus_factor,
        "stiffness_damping_s": found.stiffness_damping_s,
        "friction": found.friction,
    }
    for kind, conductances in (
        ("filling", found.filling_mm3_per_s_kPa),
        ("venting", found.venting_mm3_per_s_kPa),
    ):
        for number, conductance in enumerate(conductances or (), start=1):
            fitted[f"{kind}_{number}_mm3_per_s_kPa"] = conductance
    rows = [
        (name.replace("_", " "), value, *found.confidence_intervals_95.get(name, ("", "")))
        for name, value in fitted.items()
        if value is not None
    ]
    rows += [
        (name.replace("_", " "), value, value - NORMAL_95 * spread, value + NORMAL_95 * spread)
        for name, (value, spread) in found.measured.items()
    ]
    table = page.table(["parameter", "fitted", "95 % from", "to"], rows)
    pictures = [
        page.picture(run.folder / name, caption)
        for fit, name, caption in (
            ("pressure", "calibration.png", "Pressures of equal bend, and the line through them."),
            ("air", "air_fit.png", "The first trial's pressures, and those of the fitted valves."),
            ("trajectories", "path_fit.png", "The first trial's path, before and after the fit."),
        )
        if fit in found.fit and (run.folder / name).exists()
    ]
    return [Section("Fitted parameters", page.side_by_side(*pictures) + table)]
