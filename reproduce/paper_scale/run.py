"""The paper's experiment at its scale: what is kept of a training, and everything that follows it.

    python reproduce/paper_scale/run.py [--steps baseline reduced mirror ...]

works with the gaits and metrics that lie beside this file. After a training of one's own,

    pneumorph coopt --preset paper --seed 0 --resume --out runs/paper
    python reproduce/paper_scale/run.py --run runs/paper --out runs/kept

keeps that one's first. Each step is a verb in a folder of its own under --work; those that are
finished are not made again, and full-order robots go on where they were stopped. Figures and
summary.json are written to --out, the latter once every step is there.
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

HERE = Path(os.path.relpath(Path(__file__).parent))
PAIRS = 5
BASELINE = ("phases_deg", "distances_cm", "baseline_best_phase_deg", "baseline_best_distance_cm")
DIGITS = 5
"""Digits of the metrics that are kept."""


class PaperScale:
    """A training and what follows it.

    Args:
        run: Folder of a coopt run to keep; None works with what is kept.
        out: Where small files are kept.
        work: Where the steps run.
    """

    def __init__(self, run: Path | None, out: Path, work: Path) -> None:
        self.run, self.out, self.work = run, out, work

    @property
    def gaits(self) -> list[Path]:
        """The best pairs, each a gait that names its design."""
        return sorted((self.out / "gaits").glob("L?.csv"))

    @property
    def training(self) -> dict[str, Any]:
        """Provenance, settings and baseline of the training that was kept."""
        content: dict[str, Any] = json.loads((self.out / "training.json").read_text())
        return content

    def walk(self, folder: str, *flags: object) -> dict[str, Any]:
        """Simulate one robot in the training's physics."""
        robots = {"robot": self.training["settings"]["robot"]}
        settings = write_json(self.work / "robots.json", robots)
        return run_once(self.work / folder, "simulate", "--settings", settings, *flags)

    def finished(self) -> Path:
        """The training's folder.

        Raises:
            SystemExit: None was given.
        """
        if self.run is None:
            raise SystemExit("this step needs a finished training; give its folder by --run")
        return self.run

    def keep(self) -> None:
        """Metrics, best gaits and provenance of the training, and its figure."""
        run = self.finished()
        learned = read_summary(run)
        for earlier in ("gaits", "full_order"):  # of another training
            shutil.rmtree(self.out / earlier, ignore_errors=True)
        (self.out / "gaits").mkdir(parents=True)
        for rank, pair in enumerate(learned["pairs"][:PAIRS], start=1):
            shutil.copy(run / pair["gait"], self.out / "gaits" / f"L{rank}.csv")
        metrics = read_metrics(run / "training")
        lines = "".join(json.dumps(rounded(line)) + "\n" for line in metrics)
        write_atomically(self.out / "metrics.jsonl", lambda stream: stream.write(lines.encode()))
        figure = reward_figure(
            metrics,
            HISTOGRAM_EDGES_CM,
            learned["baseline_best_distance_cm"],
            learned["best_distance_cm"],
            learned["seen_pairs"][:PAIRS],
        )
        save_figure(figure, self.out / "training.png", ("png",))
        training = {
            "made_by": learned["made_by"],
            "machine": machine(),
            "wall_s": learned["training_wall_s"],
            "finetuning_timesteps": learned["finetuning_timesteps"],
            "finetuning_wall_s": learned.get("finetuning_wall_s"),
            "baseline": {name: learned[name] for name in BASELINE},
            "settings": read_settings(run),
        }
        write_json(self.out / "training.json", finite(training))

    def analysis(self) -> None:
        """Rewards of each step, tilt, load and friction of each leg, distance over friction."""
        run_once(self.work / "analysis", "analyse", self.finished())
        for figure in sorted((self.work / "analysis").glob("*.png")):
            shutil.copy(figure, self.out / figure.name)
        shutil.copy(self.work / "analysis" / "analysis.json", self.out / "analysis.json")

    def baseline(self) -> dict[str, Any]:
        """The expert's gait at every phase."""
        found: dict[str, Any] = self.training["baseline"]
        figure = phase_figure(found["phases_deg"], found["distances_cm"])
        save_figure(figure, self.out / "baseline.png", ("png",))
        return found

    def baseline_full(self) -> dict[str, Any]:
        """The expert's best phase as finite elements."""
        phase = self.baseline()["baseline_best_phase_deg"]
        return self.full_order("B", "--expert.phase-deg", phase)

    def full_order(self, name: str, *gait: object) -> dict[str, Any]:
        """A walk of finite elements: ten minutes, so its summary is kept and not made again."""
        path = self.out / "full_order" / f"{name}.json"
        if not path.exists():
            found = self.walk(f"full/{name}", "--model", "full", *gait)
            path.parent.mkdir(exist_ok=True)
            write_json(path, finite(found))
        summary: dict[str, Any] = json.loads(path.read_text())
        return summary

    def reduced(self) -> list[dict[str, Any]]:
        """The best pairs in the reduced simulator."""
        return [self.walk(f"reduced/{gait.stem}", "--gait", gait) for gait in self.gaits]

    def full(self) -> list[dict[str, Any]]:
        """The best pairs as finite elements."""
        return [self.full_order(gait.stem, "--gait", gait) for gait in self.gaits]

    def mirror(self) -> dict[str, Any]:
        """The mirror image of the best design, driven by the best design's gait."""
        best = self.reduced()[0]
        mirrored = Design.parse(best["design"]).mirror()
        return self.walk("mirror", "--gait", self.gaits[0], "--design", mirrored)

    def summary(self) -> None:
        """Bring the numbers together."""
        training = self.training
        metrics = [json.loads(line) for line in (self.out / "metrics.jsonl").open()]
        last = metrics[-1]
        top_five = [
            {
                "design": walked["design"],
                "distance_cm": walked["distance_cm"],
                "distance_full_order_cm": elements["distance_cm"],
                "gait": f"gaits/{gait.name}",
            }
            for walked, elements, gait in zip(self.reduced(), self.full(), self.gaits, strict=True)
        ]
        best, baseline = top_five[0], self.baseline()
        baseline_cm = baseline["baseline_best_distance_cm"]
        baseline_full_cm = self.baseline_full()["distance_cm"]
        content = {
            "timesteps": last["timestep"],
            "wall_s": training["wall_s"],
            "best_design": best["design"],
            "best_distance_cm": best["distance_cm"],
            "best_distance_full_order_cm": best["distance_full_order_cm"],
            "baseline_best_distance_cm": baseline_cm,
            "baseline_best_phase_deg": baseline["baseline_best_phase_deg"],
            "baseline_best_distance_full_order_cm": baseline_full_cm,
            "times_the_baseline": ratio(best["distance_cm"], baseline_cm),
            "times_the_baseline_full_order": ratio(
                best["distance_full_order_cm"], baseline_full_cm
            ),
            "mirror_image_distance_cm": self.mirror()["distance_cm"],
            "top_five": top_five,
            **{
                name: last[name]
                for name in ("simulate_s", "learn_s", "log_s", "evaluate_s", "update_count")
            },
            "learn_and_log_share": (last["learn_s"] + last["log_s"]) / training["wall_s"],
            "failed_episode_count": sum(line["failed_count"] for line in metrics),
            "training": training,
            "machine_of_this_summary": machine(),
            "commit_of_this_summary": source_commit(),
        }
        write_json(self.out / "summary.json", finite(content))
        distances = distances_figure(top_five, (baseline_cm, baseline_full_cm))
        save_figure(distances, self.out / "distances.png", ("png",))


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
    follows = ("baseline", "reduced", "mirror", "baseline_full", "full", "summary")
    steps = ("keep", "analysis", *follows)
    parser.add_argument("--run", type=Path, help="folder of a finished training to keep")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--work", type=Path, help="by default RUN/paper_scale, or runs/paper_scale")
    parser.add_argument("--steps", nargs="+", choices=steps)
    options = parser.parse_args()
    # One training's walks are not another's: their commands alone would not tell them apart.
    work = options.work or (options.run or Path("runs")) / "paper_scale"
    todo = PaperScale(options.run, options.out, work)
    for step in options.steps or (follows if options.run is None else steps):
        print(f"{step} ...", flush=True)
        make: Callable[[], object] = getattr(todo, step)
        make()
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
