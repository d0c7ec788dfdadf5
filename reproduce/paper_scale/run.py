"""Everything that follows the training at the paper's scale: summary.json, figures, small files.

    pneumorph coopt --preset paper --seed 0 --resume --out runs/paper
    python reproduce/paper_scale/run.py runs/paper [--steps baseline training reduced ...]

Each step is a verb in a folder of its own under RUN/paper_scale; those that are finished are not
made again, and full-order robots go on where they were stopped. What is kept (figures, gaits,
metrics, summary.json) is written to --out once every step is there.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.artefact import write_atomically, write_json
from pneumorph.command.run_folder import finite, read_settings, read_summary
from pneumorph.command.run_once import run_once
from pneumorph.coopt.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.provenance import source_commit
from pneumorph.report.phase_figure import phase_figure
from pneumorph.report.reward_figure import reward_figure
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
DIGITS = 5
"""Digits of the metrics that are kept."""


class PaperScale:
    """The steps after a training.

    Args:
        run: Folder of the coopt run.
        out: Where what is kept goes.
    """

    def __init__(self, run: Path, out: Path) -> None:
        self.run, self.out = run, out
        self.work = run / "paper_scale"
        self.learned = read_summary(run)
        self.settings = read_settings(run)

    def baseline(self) -> None:
        """The expert's gait at every phase, as the run swept it."""
        figure = phase_figure(self.learned["phases_deg"], self.learned["distances_cm"])
        save_figure(figure, self.out / "baseline.png", ("png",))

    def training(self) -> None:
        """Histogram of rewards weighted by the design distribution over training."""
        metrics = read_metrics(self.run / "training")
        figure = reward_figure(
            metrics,
            HISTOGRAM_EDGES_CM,
            self.learned["baseline_best_distance_cm"],
            self.learned["best_distance_cm"],
            self.learned["seen_pairs"][:5],
        )
        save_figure(figure, self.out / "training.png", ("png",))
        lines = "".join(json.dumps(rounded(line)) + "\n" for line in metrics)
        write_atomically(self.out / "metrics.jsonl", lambda stream: stream.write(lines.encode()))

    def reduced(self) -> dict[str, Any]:
        """The best pairs once more in the reduced simulator."""
        return run_once(self.work / "reduced", "evaluate", self.run)

    def full(self) -> dict[str, Any]:
        """The best pairs as finite elements."""
        return run_once(self.work / "full", "evaluate", self.run, "--model", "full")

    def baseline_full(self) -> dict[str, Any]:
        """The expert's best phase as finite elements."""
        robots = write_json(self.work / "robots.json", {"robot": self.settings["robot"]})
        return run_once(
            self.work / "baseline_full", "simulate", "--model", "full", "--settings", robots,
            "--expert.phase-deg", self.learned["baseline_best_phase_deg"],
        )  # fmt: skip

    def mirror(self) -> dict[str, Any]:
        """The mirror image of the best design, driven by the best design's gait."""
        robots = write_json(self.work / "robots.json", {"robot": self.settings["robot"]})
        best = self.learned["pairs"][0]
        return run_once(
            self.work / "mirror", "simulate", "--settings", robots,
            "--gait", self.run / best["gait"],
            "--design", Design.parse(best["design"]).mirror(),
        )  # fmt: skip

    def analysis(self) -> dict[str, Any]:
        """Rewards of each step, tilt, load and friction of each leg, distance over friction."""
        found = run_once(self.work / "analysis", "analyse", self.run)
        self.out.mkdir(parents=True, exist_ok=True)
        for figure in sorted((self.work / "analysis").glob("*.png")):
            shutil.copy(figure, self.out / figure.name)
        shutil.copy(self.work / "analysis" / "analysis.json", self.out / "analysis.json")
        return found

    def summary(self) -> None:
        """Bring the numbers together and keep the gaits."""
        learned = self.learned
        reduced, full = self.reduced()["pairs"], self.full()["pairs"]
        baseline_full = self.baseline_full()["distance_cm"]
        mirror = self.mirror()["distance_cm"]
        baseline = learned["baseline_best_distance_cm"]
        top_five = []
        for rank, (pair, again, elements) in enumerate(
            zip(learned["pairs"][:5], reduced, full, strict=True), start=1
        ):
            shutil.copy(self.run / pair["gait"], self.out / f"L{rank}.csv")
            top_five.append(
                {
                    "design": pair["design"],
                    "source": pair["source"],
                    "distance_cm": pair["distance_cm"],
                    "distance_again_cm": again["distance_cm"],
                    "distance_full_order_cm": elements["distance_cm"],
                    "gait": f"L{rank}.csv",
                }
            )
        best_full = top_five[0]["distance_full_order_cm"]
        content = {
            "timesteps": learned["timesteps"],
            "wall_s": learned["training_wall_s"],
            "best_design": learned["best_design"],
            "best_distance_cm": learned["best_distance_cm"],
            "best_distance_full_order_cm": best_full,
            "baseline_best_distance_cm": baseline,
            "baseline_best_phase_deg": learned["baseline_best_phase_deg"],
            "baseline_best_distance_full_order_cm": baseline_full,
            "times_the_baseline": ratio(learned["best_distance_cm"], baseline),
            "times_the_baseline_full_order": ratio(best_full, baseline_full),
            "mirror_image_distance_cm": mirror,
            "top_five": top_five,
            "finetuning_timesteps": learned["finetuning_timesteps"],
            "finetuning_wall_s": learned.get("finetuning_wall_s"),
            **{
                name: learned[name]
                for name in ("simulate_s", "learn_s", "log_s", "evaluate_s", "other_s",
                             "learn_and_log_share", "update_count", "failed_episode_count",
                             "damping", "seed", "notes", "made_by")
            },
            "machine": machine(),
            "commit_of_this_summary": source_commit(),
            "settings": self.settings,
        }  # fmt: skip
        write_json(self.out / "summary.json", finite(content))
        baselines = (baseline, baseline_full)
        save_figure(distances_figure(top_five, baselines), self.out / "distances.png", ("png",))


@figure_style()
def distances_figure(
    top_five: list[dict[str, Any]], baselines: tuple[float, float | None]
) -> Figure:
    """Distances of the baseline and the best pairs in both models."""
    figure = new_figure(5.2, 3.0)
    axes = figure.add_subplot()
    labels = ["B", *(f"L{rank}" for rank in range(1, len(top_five) + 1))]
    reduced = [baselines[0], *(pair["distance_cm"] for pair in top_five)]
    full = [baselines[1], *(pair["distance_full_order_cm"] for pair in top_five)]
    place = np.arange(len(labels))
    for shift, values, colour, label in (
        (-0.2, reduced, LEARNED_COLOUR, "reduced"),
        (0.2, full, BASELINE_COLOUR, "full order"),
    ):
        heights = np.array([np.nan if value is None else value for value in values])
        bars = axes.bar(place + shift, heights, 0.38, color=colour, label=label)
        axes.bar_label(bars, fmt="%.1f", fontsize=7)
    axes.set(xticks=place, xticklabels=labels, ylabel="distance in 20 s (cm)")
    axes.legend()
    return figure


def ratio(distance: float | None, baseline: float | None) -> float | None:
    """How many times as far; None where the baseline does not come forward at all."""
    return None if distance is None or not baseline or baseline <= 0.0 else distance / baseline


def machine() -> dict[str, Any]:
    """What this machine is."""
    model = platform.processor()
    for line in Path("/proc/cpuinfo").read_text().splitlines() if os.name == "posix" else []:
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "processor": model,
        "processor_count": count,
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
    }


def rounded(value: Any) -> Any:
    """The same with numbers of few digits."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def main() -> None:
    """Make the steps that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = ("baseline", "training", "reduced", "mirror", "analysis", "baseline_full", "full",
             "summary")  # fmt: skip
    parser.add_argument("run", type=Path, help="folder of the coopt run")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--steps", nargs="+", choices=steps, default=steps)
    options = parser.parse_args()
    todo = PaperScale(options.run, options.out)
    for step in options.steps:
        print(f"{step} ...", flush=True)
        make: Callable[[], object] = getattr(todo, step)
        make()
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
