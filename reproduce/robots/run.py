"""The examples of docs/own_robot.md at full size: what learning makes of robots of one's own.

    python reproduce/robots/run.py

Each example is trained in the measured physics, and stands in the same unseen worlds beside its
best uniform robot under the expert's gait and beside a genetic algorithm with as much simulated
time. Every step keeps what it made in --work, so the same call goes on where it was stopped; then
robots.json, the gaits and the figure of all that has been made there.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tyro

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.layers import layered
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import laid_over, read_settings_file
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.report.style import BASELINE_COLOUR, LEARNED_COLOUR, new_axes, save_figure
from pneumorph.simulation.randomisation import World
from pneumorph.study.analysis import walkers
from pneumorph.study.certified_pairs import Band, share_beyond
from pneumorph.study.certified_walks import FullOrderWalk, full_order_walks
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.gait_source import find_gait
from pneumorph.study.near_worlds import near_worlds
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.rivals import Contender, searched, uniform
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.shown_worlds import SHOWN_WORLDS
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, TrainingOptions, train_once
from pneumorph.study.training_result import TrainingResult
from pneumorph.study.training_run import BEST_TRAJECTORY_FILE
from pneumorph.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
_EXAMPLES = HERE.parent.parent / "examples"
_TWO_CHAMBERS = {"robot": {"described": str(_EXAMPLES / "two_chambers.toml")}}
_SUMMARY = "robots.json"
_METHODS = ("learned", "expert", "uniform", "genetic", "by_hand")
Step = Literal["learn", "uniform", "genetic", "full"]
STEPS: tuple[Step, ...] = ("learn", "uniform", "genetic")


@dataclass(frozen=True)
class Example:
    """A robot and what it is asked to do."""

    uniform: tuple[str, ...]
    """Designs with one kind of module that stand for what is built without a search: the expert's
    gait has two regulators, the fore and the hind legs', say."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """What is other than the preset has, as nested settings."""
    settings: Path | None = None
    """A file of such, over `changes`."""
    by_hand: Path | None = None
    """File of a gait that a person wrote, with its design."""

    def options(self, seed: int, over: Mapping[str, Any]) -> TrainingOptions:
        """Its training, in the measured physics.

        Args:
            seed: Of the training.
            over: Settings that are laid over its own.
        """
        said = {} if self.settings is None else read_settings_file(self.settings)
        physics = {} if "robot" in self.changes else {"robot": {"based_on": "measured"}}
        options = layered(PRESETS["quick"](), [laid_over(physics, self.changes), said, over])
        if options.robot.leg_name != "measured":
            raise ValueError(f"the robot is {options.robot.leg_name}, expected measured")
        return replace(options, coopt=replace(options.coopt, seed=seed))


def _of_one_module(layouts: Sequence[str], letters: str) -> tuple[str, ...]:
    """Layouts of regulators with each kind of module in turn."""
    kinds = ("", *letters)
    return tuple(
        ".".join(each if each == "0" else f"{kind}{each}" for each in layout.split("."))
        for layout in layouts
        for kind in kinds
    )


_FORE_AND_HIND = ("1.0.0.2.2.0.0.1", "0.1.2.0.0.2.1.0", "1.0.2.0.0.2.0.1", "0.1.0.2.2.0.1.0")
_HEADING = {"reward": {"goal": "heading", "heading_deg": 90.0}}
EXAMPLES: dict[str, Example] = {
    "plate": Example(
        _of_one_module(("1.0.0.2.2.0.0.1", "0.1.2.0.0.2.1.0", "1.1.0.2.2.0.1.1"), "bcd"),
        {"robot": {"described": str(_EXAMPLES / "large_plate.toml")}},
    ),
    "rough_ground": Example(_FORE_AND_HIND, settings=_EXAMPLES / "rough_ground.toml"),
    "climbing": Example(
        _FORE_AND_HIND,
        {"robot": {"based_on": "measured", "physics": {"floor_slope_deg": 10.0}}},
    ),
    "payload": Example(
        (*_of_one_module(("1.0.2.2.0.1",), "b"), "1.1.2.2.1.1"),
        {"robot": {"described": str(_EXAMPLES / "tasks" / "payload.toml")}},
    ),
    "turning": Example(
        (
            "0.1+1.0.2+2.0.1+1.0.2+2",
            "0.1+1.0.1+1.0.2+2.0.2+2",
            "0.1+2.0.1+2.0.1+2.0.1+2",
            "0.1+1.2+2.0.0.1+1.2+2.0",
        ),
        {**_TWO_CHAMBERS, "coopt": {"task": {"reward": {"goal": "turn_left"}}}},
        by_hand=_EXAMPLES / "gaits" / "turn_by_hand.csv",
    ),
    "heading": Example(
        (
            "0.1+1.2+2.0.1+1.0.0.2+2",
            "0.1+1.1+1.0.2+2.0.0.2+2",
            "0.1+1.2+2.0.2+2.0.0.1+1",
            "0.1+2.2+1.0.2+1.0.0.1+2",
        ),
        {**_TWO_CHAMBERS, "coopt": {"task": _HEADING, "space": {"symmetries": []}}},
    ),
}
PHASES_DEG = tuple(60.0 * number for number in range(6))


def main(
    examples: tuple[str, ...] = tuple(EXAMPLES),
    seeds: tuple[int, ...] = (0,),
    steps: tuple[Step, ...] = STEPS,
    work: Path = Path("runs/robots"),
    out: Path = HERE,
    threads: int = 0,
    settings: Path | None = None,
) -> None:
    """Make the steps that are missing, and write what is known.

    Args:
        examples: Which of them.
        seeds: Of the trainings.
        steps: Which of them; full walks finite elements in the nominal world, hours.
        work: Where the steps are made.
        out: Folder of robots.json, the gaits and the figure.
        threads: Of the engine in trainings; 0 takes every processor.
        settings: JSON or TOML file of settings laid over those of each example.
    """
    over = {} if settings is None else read_settings_file(settings)
    rows = _read(out / _SUMMARY)
    out.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        for name in examples:
            options = EXAMPLES[name].options(seed, over)
            folder = study_folder(work / name / f"seed_{seed}", "coopt")
            if "learn" in steps:
                train_once(options, folder, threads)
            run = FinishedRun.read(folder.path)
            row = _row(name, run, work / "beside", steps, out, rows)
            rows = [each for each in rows if (each["example"], each["seed"]) != (name, seed)]
            rows = sorted([*rows, row], key=lambda each: (each["example"], each["seed"]))
            write_json(out / _SUMMARY, finite({"robots": rows}))
            save_figure(bands_figure(rows), out / "robots.png", ("png",))
            print(row, flush=True)
    print(f"wrote {out / _SUMMARY}")


def _row(
    name: str,
    run: FinishedRun,
    work: Path,
    steps: Sequence[Step],
    out: Path,
    earlier: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """What is known of a training and of those beside it; what is not asked for is as it was."""
    found = run.result(TrainingResult)
    certificate = found.certificate
    if certificate is None:
        raise ValueError(f"{run.folder} has no certificate, expected that of the preset")
    digest, place = run.digest(), int(certificate.best.removeprefix("L"))
    # The expert's come first.
    theirs, ours = np.array(certificate.achieved, dtype=float).T[[0, place]]
    pair, expert = certificate.pairs[place - 1], certificate.expert
    gait = f"{name}_{found.seed}.csv"
    shutil.copy(run.folder / pair.gait, out / gait)
    row: dict[str, Any] = {
        **next((dict(each) for each in earlier if each["digest"] == digest), {}),
        "example": name,
        "seed": found.seed,
        "digest": digest,
        "goal": found.goal.label,
        "unit": found.goal.unit,
        "design_count": len(run.space),
        "world_count": certificate.world_count,
        "learned": {
            "design": pair.design,
            **_band(ours),
            "timesteps": found.timesteps + found.finetuning_timesteps,
            "wall_s": found.wall_s,
            "score_cm": found.pairs[place - 1].score_cm,
            "gait": gait,
            "nominal": pair.nominal,
            "optimism": pair.optimism,
            "left_range_share": pair.left_range_share,
            "hub_load_share": pair.hub_load_share,
            "walks": _walks(run),
        },
        "expert": {
            "design": expert.design,
            "phase_deg": expert.phase_deg,
            **_band(theirs, ours),
        },
    }
    beside: list[Contender | None] = []
    if "uniform" in steps:
        beside.append(uniform(run, EXAMPLES[name].uniform, PHASES_DEG, work))
    if "genetic" in steps:
        beside.append(searched(run, "genetic", work))
    folder = RunFolder(work / digest, "robots")
    for each in beside:
        if each is not None:
            achieved = each.walked(run, folder, certificate.world_count)
            row[each.method] = {
                "design": str(each.design),
                **_band(achieved, ours),
                "timesteps": each.timesteps,
                "wall_s": each.wall_s,
                "score_cm": each.score_cm,
            }
            if isinstance(each.gait, ExpertGait):
                row[each.method]["phase_deg"] = each.gait.phase_deg
    by_hand = EXAMPLES[name].by_hand
    if by_hand is not None:
        row["by_hand"] = _by_hand(by_hand, run, folder, certificate.world_count, ours)
    if "full" in steps:
        walker = walkers(run, place)[-1]
        spec = run.spec()
        (kept,) = full_order_walks(spec, [(walker, None)], folder, goal=found.goal)
        near, *_ = walks_in_worlds(
            spec,
            [walker.design],
            [walker.gait],
            near_worlds(World.nominal(spec.physics), spec.physics),
            walker.settling_steps,
            folder,
            found.goal,
            keep=True,
        )
        walk = FullOrderWalk.of(None, kept, pair.nominal, found.goal, near=near[:, 0])
        row["full"] = result_to_dict(walk, found.goal.unit)
    return row


def _by_hand(
    path: Path, run: FinishedRun, folder: RunFolder, world_count: int, ours: np.ndarray
) -> dict[str, Any]:
    """What a gait that nobody searched for does: seconds, so that it walks whatever the steps."""
    source, seed = find_gait(path, None, ExpertGait()), run.result(TrainingResult).seed
    hand = Contender("by_hand", seed, 0, 0.0, source.design, source.gait, path, None)
    steps = run.task.settling_step_count
    nominal = recorded_walk(run.spec(), source.design, source.gait, settling_steps=steps)
    return {
        "design": str(source.design),
        "gait": path.name,
        **_band(hand.walked(run, folder, world_count), ours),
        "nominal": run.goal.achieved(nominal),
    }


def _band(achieved: np.ndarray, learned: np.ndarray | None = None) -> dict[str, Any]:
    """Of what a robot achieves in the worlds, (world,), and in how many the learned one achieves
    more."""
    band = Band.of(achieved)
    told = {
        "median": band.median,
        "tenth_percentile": band.low,
        "ninetieth_percentile": band.high,
        "failed_count": band.failed_count,
    }
    return told if learned is None else {**told, "learned_beyond": share_beyond(learned, achieved)}


def _walks(run: FinishedRun) -> dict[str, dict[str, float]]:
    """How the best pair goes in the world as it stands, in one of its median and in a bad one."""
    files = {"nominal": BEST_TRAJECTORY_FILE}
    files |= {name: file for name, (file, _) in SHOWN_WORLDS.items()}
    found = {}
    for name, file in files.items():
        if (run.folder / file).exists():
            walk = Trajectory.load(run.folder / file)
            upright = np.clip(walk.hub_rotation[:, 2, 2], -1.0, 1.0)
            tilt_deg = np.degrees(np.arccos(upright))
            found[name] = {
                "forward_cm": float(walk.forward_cm[-1]),
                "left_cm": float(walk.left_cm[-1]),
                "turned_deg": float(walk.turned_deg[-1]),
                "mean_tilt_deg": float(tilt_deg.mean()),
                "largest_tilt_deg": float(tilt_deg.max()),
                "last_tilt_deg": float(tilt_deg[-1]),
            }
    return found


def bands_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Each example beside its rivals: a line from the 10th to the 90th percentile, a point at the
    median."""
    names = [name for name in EXAMPLES if any(row["example"] == name for row in rows)]
    figure, grid = new_axes(6.4, 0.5 + 1.3 * len(names))
    grid.remove()
    figure.set_layout_engine("constrained")
    for axes, name in zip(figure.subplots(len(names), 1, squeeze=False)[:, 0], names, strict=True):
        own = [row for row in rows if row["example"] == name]
        for place, row in enumerate(own):
            for line, method in enumerate(_METHODS):
                if method in row:
                    y, band = line + 0.2 * (place - 0.5 * (len(own) - 1)), row[method]
                    colour = LEARNED_COLOUR if method == "learned" else BASELINE_COLOUR
                    axes.plot(
                        [band["tenth_percentile"], band["ninetieth_percentile"]],
                        [y, y],
                        color=colour,
                    )
                    axes.plot(band["median"], y, "o", color=colour, markersize=4)
        axes.set_yticks(range(len(_METHODS)), [each.replace("_", " ") for each in _METHODS])
        axes.set_ylim(len(_METHODS) - 0.5, -0.5)
        axes.set_xlabel(f"{name.replace('_', ' ')}: {own[0]['goal']} ({own[0]['unit']})")
    return figure


def _read(summary: Path) -> list[dict[str, Any]]:
    """The rows of an earlier call."""
    return list(read_json(summary, "summary")["robots"]) if summary.exists() else []


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
