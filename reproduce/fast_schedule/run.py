"""A better schedule: three seeds of schedule.toml beside the run at the paper's scale.

    python reproduce/fast_schedule/run.py

The seeds are a campaign, resumable, on Ray with --ray-address; --settings names a file of further
settings of it. Then fast.json with how near each comes to the full run's best, fast.png with all
learning curves, and what is kept of each run.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.learn.settings import CooptSettings
from pneumorph.report.learning_figures import learning_curves_figure
from pneumorph.report.style import save_figure
from pneumorph.study.campaign import CampaignSettings, campaign
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.kept_run import keep_run
from pneumorph.study.learning_curve import learning_curve
from pneumorph.study.study_once import make_study, study_folder
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_result import TrainingResult

HERE = Path(__file__).parent
PUBLISHED = load_settings(RobotOptions, HERE.parent / "published.toml")
SCHEDULE = load_settings(CooptSettings, HERE / "schedule.toml")
WITHIN_CM = 0.5


def main(
    full: Path = HERE.parent / "paper_scale",
    seeds: tuple[int, ...] = (0, 1, 2),
    runs: Path = Path("runs/fast"),
    processes: int | None = None,
    ray_address: str | None = None,
    settings: Path | None = None,
    out: Path = HERE,
) -> None:
    """Train what is missing, compare and draw.

    Args:
        full: Run at the paper's scale.
        seeds: Of the runs.
        runs: The campaign's folder.
        processes: Runs side by side.
        ray_address: Cluster to run on.
        settings: JSON or TOML file of settings laid over the campaign's.
        out: Folder of fast.json, the figure and what is kept.
    """
    executor = ExecutorSettings(
        "processes" if ray_address is None else "ray", processes, ray_address
    )
    robot = replace(PUBLISHED, executor=executor)
    asked = CampaignSettings(seeds, run=TrainingOptions(coopt=SCHEDULE, robot=robot))
    if settings is not None:
        asked = load_settings(CampaignSettings, settings, asked)
    # It leaves finished runs alone, whatever the seeds and processes of the last time.
    place = study_folder(runs, "campaign")
    with place.alone():
        found = make_study(place, asked, lambda: campaign(asked, place))
    if found.status != "completed":
        raise SystemExit("not all runs were completed; the same command goes on with what is left")
    learned = FinishedRun.read(full).result(TrainingResult)
    best_cm, timesteps = learned.best_distance_cm, learned.timesteps + learned.finetuning_timesteps
    if best_cm is None:
        raise SystemExit(f"no robot of {full} survived, there is nothing to compare with")
    rows: list[dict[str, Any]] = [
        {
            **result_to_dict(each),
            "behind_cm": best_cm - (each.best_distance_cm or 0.0),
            "reached": (each.best_distance_cm or 0.0) > best_cm - WITHIN_CM,
            "share_of_timesteps": (each.timesteps + each.finetuning_timesteps) / timesteps,
        }
        for each in found.runs
    ]
    content = {
        "full_best_distance_cm": best_cm,
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
    figure = learning_curves_figure(curves, learned.baseline_best_distance_cm)
    save_figure(figure, out / "fast.png", ("png",))
    print(f"wrote {out / 'fast.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
