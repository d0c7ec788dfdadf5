"""The gap explained: the best pairs found under each damping, walked under the other.

    python reproduce/damping_gap/run.py

The published one is the run at the paper's scale that is kept. A run that is not there is trained
by the faster schedule (../fast_schedule) and resumed where it was stopped; what is kept of it is
objective/. Then each one's best five are analysed under both dampings: damping_gap.json and
damping_gap.png.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.run_folder import SUMMARY
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.physics import Damping
from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)
from pneumorph.study.analysis import AnalysedRobot, Analysis, AnalysisSettings, analyse
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.kept_run import keep_run
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_options import TrainingOptions, train_once

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(os.path.relpath(Path(__file__).parent))
PAPER_SCALE = HERE.parent / "paper_scale"
PUBLISHED = load_settings(RobotOptions, HERE.parent / "published.toml")
SCHEDULE = load_settings(CooptSettings, HERE.parent / "fast_schedule" / "schedule.toml")
DAMPINGS: tuple[Damping, ...] = ("published", "objective")
SURVIVES_WITHIN_CM = 1.0
"""The paper calls a distance within 1 cm of the simulated one a strong agreement (section VI-B)."""


def damped(robot: RobotOptions, damping: Damping) -> RobotOptions:
    """A robot under a damping, all other physics as they are."""
    return replace(robot, physics=replace(robot.physics, damping=damping))


def analysed(run: Path, damping: Damping, folder: Path) -> Analysis:
    """The best pairs of a run under a damping."""
    learned, place = FinishedRun.read(run), study_folder(folder, "analyse")
    robot = damped(learned.robot, damping)
    settings = AnalysisSettings(lowest_friction=0.6, highest_friction=1.4)
    asked = {"run": str(run), "analysis": settings, "robot": robot}
    return study_once(
        place, Analysis, asked, lambda: analyse(learned, settings, robot.spec(), place)
    )


def compared(own: Analysis, other: Analysis) -> list[dict[str, Any]]:
    """Each pair under its own damping and the other."""
    rows = []
    for mine, theirs in zip(own.robots, other.robots, strict=True):
        if mine.label == "B":
            continue
        rows.append(
            {
                "label": mine.label,
                "design": mine.design,
                "survives": survives(mine, theirs),
                **walk_of(mine, "own"),
                **walk_of(theirs, "other"),
            }
        )
    return rows


def walk_of(robot: AnalysedRobot, damping: str) -> dict[str, Any]:
    """What a pair does under its own damping or the other."""
    slipping = {f"{leg.angle_deg:.1f}": leg.slipping_share for leg in robot.legs}
    walk = {
        "front_slipping_share": front_slipping(robot),
        "slipping_share_by_leg_angle_deg": slipping,
        **{name: getattr(robot, name) for name in
           ("distance_cm", "hub_load_share", "pitch_range_deg")},
        "backsliding_cm": robot.backsliding,
    }  # fmt: skip
    return {f"{damping}_{name}": value for name, value in walk.items()}


def survives(own: AnalysedRobot, other: AnalysedRobot) -> bool:
    """Whether a pair keeps its distance under the other damping, to the paper's 1 cm either way."""
    if own.distance_cm is None or other.distance_cm is None:
        return False
    return abs(other.distance_cm - own.distance_cm) < SURVIVES_WITHIN_CM


def front_slipping(robot: AnalysedRobot) -> float | None:
    """Share of the front legs' load that rests on points which slip; None where none is pressed.

    Front legs are those that lie before the middle of the robot's own legs: many a learned robot
    has all of them on one side of its disk.
    """
    forward = np.cos(np.radians([leg.angle_deg for leg in robot.legs]))
    middle = 0.5 * (forward.max() + forward.min())
    legs = [leg for leg, place in zip(robot.legs, forward, strict=True) if place >= middle]
    load = sum(leg.mean_load_mN for leg in legs)
    if not load:
        return None
    return sum(leg.mean_load_mN * leg.slipping_share for leg in legs) / load


@figure_style()
def gap_figure(rows: dict[str, list[dict[str, Any]]]) -> Figure:
    """Distances of each run's best pairs under both dampings."""
    figure = new_figure(6.4, 3.0)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (trained, pairs) in zip(panels, rows.items(), strict=True):
        place = np.arange(len(pairs))
        for shift, name, colour in (
            (-0.2, "own_distance_cm", LEARNED_COLOUR),
            (0.2, "other_distance_cm", BASELINE_COLOUR),
        ):
            heights = [np.nan if pair[name] is None else pair[name] for pair in pairs]
            label = "trained with" if shift < 0.0 else "under the other"
            bars = axes.bar(place + shift, heights, 0.38, color=colour, label=label)
            axes.bar_label(bars, fmt="%.1f", fontsize=7)
        axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
        axes.set_title(f"found under {trained} damping")
        axes.set(xticks=place, xticklabels=[pair["label"] for pair in pairs])
        axes.margins(y=0.08)
    panels[0].set_ylabel("distance in 20 s (cm)")
    panels[0].legend(fontsize=7)
    return figure


def main(
    published: Path = PAPER_SCALE,
    objective: Path = Path("runs/objective"),
    out: Path = HERE,
    work: Path = Path("runs/damping_gap"),
    seed: int = 0,
) -> None:
    """Train what is missing, walk, compare and draw.

    Args:
        published: Coopt run under published damping.
        objective: Coopt run under objective damping.
        out: Folder of damping_gap.json and the figure.
        work: Where the pairs walk.
        seed: Of a run that is trained.
    """
    runs: dict[Damping, Path] = {"published": published, "objective": objective}
    for damping, run in runs.items():
        if not (run / SUMMARY).exists():
            coopt = replace(SCHEDULE, seed=seed)
            robot = damped(PUBLISHED, damping)
            train_once(TrainingOptions(coopt=coopt, robot=robot), study_folder(run, "coopt"))
        there = FinishedRun.read(run).robot.physics.damping
        if there != damping:
            raise SystemExit(f"{run} was trained with {there} damping, expected {damping}")
    if objective.resolve() != (out / "objective").resolve():
        keep_run(objective, out / "objective")
    found = {
        (trained, walked): analysed(run, walked, work / FinishedRun.read(run).digest() / walked)
        for trained, run in runs.items()
        for walked in DAMPINGS
    }
    rows: dict[str, list[dict[str, Any]]] = {
        trained: compared(found[trained, trained], found[trained, other])
        for trained, other in (DAMPINGS, DAMPINGS[::-1])
    }
    content = {
        trained: {"surviving_count": sum(pair["survives"] for pair in pairs), "pairs": pairs}
        for trained, pairs in rows.items()
    }
    write_json(out / "damping_gap.json", finite(content))
    save_figure(gap_figure(rows), out / "damping_gap.png", ("png",))
    print(f"wrote {out / 'damping_gap.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
