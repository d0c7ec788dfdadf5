"""Sections of the real robot: trials, calibration, transfer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.hardware.deployment_log import read_log
from pneumorph.hardware.marker_track import read_track
from pneumorph.hardware.trial import LOG_FILE, TRACK_PATTERN, read_trial, trial_folders
from pneumorph.report import page
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.page import Section
from pneumorph.report.run import Run
from pneumorph.report.scene import Actor
from pneumorph.report.sheet import Sheet
from pneumorph.report.step_figure import step_figure
from pneumorph.report.trials_figure import trials_figure
from pneumorph.trajectory import Trajectory


def trial_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return the trials of `pneumorph deploy`, and the comparison of `pneumorph transfer`."""
    sections = []
    if run.summary.get("schedule"):
        lines = page.command_lines(run.summary["schedule"])
        sections.append(Section("What would be commanded", lines))
    if run.summary.get("trials"):
        sections.append(_trials_section(run, sheet))
    if (run.folder / "bends.csv").exists():
        rows = [line.split(",") for line in (run.folder / "bends.csv").read_text().splitlines()]
        sections.append(Section("Measured bends", page.table(rows[0], rows[1:])))
    if (run.folder / "comparison.json").exists():
        sections += _transfer_sections(run, sheet)
    return sections


def _trials_section(run: Run, sheet: Sheet) -> Section:
    logs, tracks = [], []
    for folder in trial_folders(run.folder):
        log = read_log(folder / LOG_FILE)
        if len(log.time_s):
            logs.append(log)
        found = sorted(folder.glob(TRACK_PATTERN))
        if len(found) == 1:
            tracks.append(read_track(found[0], None))
    caption = "Commanded (dashed) and sensed pressures, the first trial boldly"
    caption += "; below, the marker's travel." if tracks else "."
    trials = run.summary["trials"]
    plain = [key for key, value in trials[0].items() if isinstance(value, str | int | float)]
    rows = [[trial.get(key) for key in plain] for trial in trials]
    body = page.table([key.replace("_", " ") for key in plain], rows)
    if logs:
        body = sheet.drawn("trials", trials_figure(logs, tracks), caption) + body
    return Section("Trials", body)


def _transfer_sections(run: Run, sheet: Sheet) -> list[Section]:
    robots = json.loads((run.folder / "comparison.json").read_text())["robots"]
    pictures = [
        page.picture(run.folder / name, caption)
        for name, caption in (
            ("transfer_rewards.png", "Distance simulated and measured; dots are trials."),
            ("transfer_gaits.png", "Pressures commanded and sensed, and travel over time."),
        )
        if (run.folder / name).exists()
    ]
    columns = ["simulated_distance_cm", "mean_distance_cm", "spread_cm", "transfer_ratio",
               "simulated_backsliding_cm", "mean_backsliding_cm", "path_rms_cm"]  # fmt: skip
    table = page.table(
        ["", "design", *(name.replace("_", " ") for name in columns)],
        [[each["label"], each["design"], *(each[name] for name in columns)] for each in robots],
    )
    step_s, cycle_s = (float(run.settings[name]) for name in ("step_s", "cycle_s"))
    steps = step_figure(
        _summed_steps(robots, step_s), step_s, min(cycle_s, _shortest(robots, step_s))
    )
    drawn = sheet.drawn(
        "steps",
        steps,
        f"Reward of every {step_s:g} s, simulated and measured (mean of trials), and below zero "
        "the furthest slide back between steps.",
    )
    return [
        Section("Simulated and measured", "".join(pictures) + table),
        *_replay_sections(run, robots, sheet),
        Section("Step by step", drawn),
    ]


def _replay_sections(run: Run, robots: list[dict[str, Any]], sheet: Sheet) -> list[Section]:
    """Return each simulated robot beside the first of its trials that is still on disk."""
    sections = []
    for text, each in zip(run.settings["runs"], robots, strict=True):
        label, deployed = each["label"], Path(text.rpartition("=")[2])
        simulated = run.folder / f"simulated_{label}.npz"
        if not simulated.exists():
            continue
        actors: list[Actor | MarkerActor] = [
            Actor.of(Trajectory.load(simulated), f"{label} simulated")
        ]
        if deployed.exists():
            trial = read_trial(trial_folders(deployed)[0])
            actors.append(MarkerActor.of(trial, f"{label} {trial.name.replace('_', ' ')}"))
        replay = sheet.replayed(actors, "The simulation, and the marker of the first trial.")
        sections.append(Section(f"Replay of {label}", replay))
    return sections


def _summed_steps(
    robots: list[dict[str, Any]], step_s: float
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Travel at the end of each step, by robot and source."""
    paths = {}
    for each in robots:
        for key, name in (
            ("simulated_reward_per_step_cm", "simulated"),
            ("mean_reward_per_step_cm", "measured"),
        ):
            travel = np.concatenate([[0.0], np.cumsum(each[key])])
            paths[f"{each['label']} {name}"] = (step_s * np.arange(len(travel)), travel)
    return paths


def _shortest(robots: list[dict[str, Any]], step_s: float) -> float:
    return step_s * min(len(each["simulated_reward_per_step_cm"]) for each in robots)


def calibration_sections(run: Run) -> list[Section]:
    """Return what `pneumorph calibrate` fitted, with its confidence intervals."""
    intervals = run.summary.get("confidence_intervals_95")
    if intervals is None:
        return []
    rows = [
        (name.replace("_", " "), run.summary[name], *intervals.get(name, ("", "")))
        for name in (
            "slope", "intercept_kPa", "modulus_factor", "stiffness_damping_s", "friction",
        )
        if run.summary.get(name) is not None
    ]  # fmt: skip
    table = page.table(["parameter", "fitted", "95 % from", "to"], rows)
    pictures = [
        page.picture(run.folder / name, caption)
        for name, caption in (
            ("calibration.png", "Pressures of equal bend, and the line through them."),
            ("path_fit.png", "The first trial's path, before and after the fit."),
        )
        if (run.folder / name).exists()
    ]
    return [Section("Fitted parameters", page.side_by_side(*pictures) + table)]
