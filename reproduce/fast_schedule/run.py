"""A better schedule: three seeds of preset fast beside the run at the paper's scale.

    python reproduce/fast_schedule/run.py [--seeds 0 1 2] [--processes 1]

The seeds are a campaign (resumable, on Ray with --ray-address); flags that are not listed go to it.
Then fast.json with how near each comes to the full run's best, fast.png with all learning curves,
and what is kept of each run.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from pneumorph.artefact import write_json
from pneumorph.cli import run
from pneumorph.command.kept_run import keep_run
from pneumorph.command.learning_curve import learning_curve
from pneumorph.command.run_folder import finite, read_summary
from pneumorph.report.search_figure import learning_curves_figure
from pneumorph.report.style import save_figure

HERE = Path(__file__).parent
WITHIN_CM = 0.5


def main() -> None:
    """Train what is missing, compare and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--full", type=Path, default=HERE.parent / "paper_scale", help="run at the paper's scale"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--runs", type=Path, default=Path("runs/fast"), help="campaign's folder")
    parser.add_argument("--processes", type=int, help="runs side by side")
    parser.add_argument("--ray-address", help="cluster to run on")
    parser.add_argument("--out", type=Path, default=HERE)
    options, flags = parser.parse_known_args()
    where: tuple[object, ...] = ()
    if options.processes is not None:
        where += ("--executor.process-count", options.processes)
    if options.ray_address is not None:
        where += ("--executor.backend", "ray", "--executor.address", options.ray_address)
    # It leaves finished runs alone, whatever the seeds and processes of the last time.
    command = ("campaign", "--preset", "fast", "--out", options.runs, "--seeds", *options.seeds)
    if run([*map(str, command), *map(str, where), *flags]) != 0:
        raise SystemExit("not all runs were completed; the same command goes on with what is left")
    campaign = read_summary(options.runs)
    full = read_summary(options.full)
    timesteps = full["timesteps"] + full["finetuning_timesteps"]
    rows = [
        {
            **each,
            "behind_cm": full["best_distance_cm"] - each["best_distance_cm"],
            "reached": each["best_distance_cm"] > full["best_distance_cm"] - WITHIN_CM,
            "share_of_timesteps": (each["timesteps"] + each["finetuning_timesteps"]) / timesteps,
        }
        for each in campaign["runs"]
    ]
    content = {
        "full_best_distance_cm": full["best_distance_cm"],
        "full_timesteps": timesteps,
        "within_cm": WITHIN_CM,
        "reached_count": sum(bool(row["reached"]) for row in rows),
        "runs": rows,
    }
    write_json(options.out / "fast.json", finite(content))
    curves = {"paper's schedule": learning_curve(options.full)}
    for row in rows:
        folder = options.runs / str(row["name"])
        keep_run(folder, options.out / f"seed_{row['seed']}")
        curves[f"fast, seed {row['seed']}"] = learning_curve(folder)
    figure = learning_curves_figure(curves, full["baseline_best_distance_cm"])
    save_figure(figure, options.out / "fast.png", ("png",))
    print(f"wrote {options.out / 'fast.json'}")


if __name__ == "__main__":
    main()
