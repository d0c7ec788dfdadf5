"""A better schedule: three seeds of preset fast beside the run at the paper's scale.

    python reproduce/fast_schedule/run.py

The seeds are a campaign (resumable, on Ray with --ray-address); --flags="..." go to it. Then
fast.json with how near each comes to the full run's best, fast.png with all learning curves,
and what is kept of each run.
"""

from __future__ import annotations

import shlex
from pathlib import Path

import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.run_folder import finite, read_summary
from pneumorph.base.settings import load_settings, settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.report.learning_figures import learning_curves_figure
from pneumorph.report.style import save_figure
from pneumorph.study.kept_run import keep_run
from pneumorph.study.learning_curve import learning_curve

HERE = Path(__file__).parent
PUBLISHED = load_settings(RobotOptions, HERE.parent / "published.toml")
WITHIN_CM = 0.5


def main(
    full: Path = HERE.parent / "paper_scale",
    seeds: tuple[int, ...] = (0, 1, 2),
    runs: Path = Path("runs/fast"),
    processes: int | None = None,
    ray_address: str | None = None,
    flags: str = "",
    out: Path = HERE,
) -> None:
    """Train what is missing, compare and draw.

    Args:
        full: Run at the paper's scale.
        seeds: Of the runs.
        runs: The campaign's folder.
        processes: Runs side by side.
        ray_address: Cluster to run on.
        flags: Further flags of the campaign, in one argument.
        out: Folder of fast.json, the figure and what is kept.
    """
    where: tuple[object, ...] = ()
    if processes is not None:
        where += ("--executor.process-count", processes)
    if ray_address is not None:
        where += ("--executor.backend", "ray", "--executor.address", ray_address)
    # It leaves finished runs alone, whatever the seeds and processes of the last time.
    robot = {"run": {"robot": settings_to_dict(PUBLISHED)}}
    settings = write_json(runs.with_suffix(".json"), robot)
    command = (
        "campaign", "--preset", "fast", "--settings", settings, "--out", runs,
        "--seeds", *seeds,
    )  # fmt: skip
    if run([*map(str, command), *map(str, where), *shlex.split(flags)]) != 0:
        raise SystemExit("not all runs were completed; the same command goes on with what is left")
    campaign = read_summary(runs)
    learned = read_summary(full)
    timesteps = learned["timesteps"] + learned["finetuning_timesteps"]
    rows = [
        {
            **each,
            "behind_cm": learned["best_distance_cm"] - each["best_distance_cm"],
            "reached": each["best_distance_cm"] > learned["best_distance_cm"] - WITHIN_CM,
            "share_of_timesteps": (each["timesteps"] + each["finetuning_timesteps"]) / timesteps,
        }
        for each in campaign["runs"]
    ]
    content = {
        "full_best_distance_cm": learned["best_distance_cm"],
        "full_timesteps": timesteps,
        "within_cm": WITHIN_CM,
        "reached_count": sum(bool(row["reached"]) for row in rows),
        "runs": rows,
    }
    write_json(out / "fast.json", finite(content))
    curves = {"paper's schedule": learning_curve(full)}
    for row in rows:
        folder = runs / str(row["name"])
        keep_run(folder, out / f"seed_{row['seed']}")
        curves[f"fast, seed {row['seed']}"] = learning_curve(folder)
    figure = learning_curves_figure(curves, learned["baseline_best_distance_cm"])
    save_figure(figure, out / "fast.png", ("png",))
    print(f"wrote {out / 'fast.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
