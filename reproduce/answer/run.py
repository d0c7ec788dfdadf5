"""Is the answer good? Searches that share nothing with learning, with as much simulated time.

    python reproduce/answer/run.py RUN [--steps gaits random genetic]

`gaits` looks for the best gait of the expert's design, of L1 to L5 and of 30 random designs by
CMA-ES; `random` and `genetic` search designs and gaits together with the run's own number of
timesteps, fine-tuning included. All are resumable. Then answer.json and the two figures.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from pneumorph.artefact import write_json
from pneumorph.command.run_folder import finite, read_settings, read_summary
from pneumorph.command.run_once import run_once
from pneumorph.command.search import CURVE_FILE
from pneumorph.coopt.metrics import read_metrics
from pneumorph.report.search_figure import coopt_curve, learning_curves_figure, own_gaits_figure
from pneumorph.report.style import save_figure

HERE = Path(__file__).parent
METHODS = ("random", "genetic")


def main() -> None:
    """Search what is missing, compare and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path, help="folder of the coopt run")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--work", type=Path, default=Path("runs/answer"))
    parser.add_argument("--steps", nargs="+", choices=("gaits", *METHODS),
                        default=("gaits", *METHODS))  # fmt: skip
    parser.add_argument("--gait-timesteps", type=int, help="less than the 960 gaits a design")
    options = parser.parse_args()
    learned, settings = read_summary(options.run), read_settings(options.run)
    timesteps = learned["timesteps"] + learned["finetuning_timesteps"]
    work = options.work
    result: dict[str, Any] = {
        "run": learned.get("made_by"),
        "timesteps": timesteps,
        "coopt": {name: learned[name] for name in ("best_design", "best_distance_cm")},
    }
    shorter = () if options.gait_timesteps is None else ("--timesteps", options.gait_timesteps)
    if "gaits" in options.steps:
        gaits = run_once(work / "gaits", "search", "--run", options.run, *shorter)
        result["gaits"] = {
            name: gaits[name]
            for name in ("designs", "mean_policy_gap_cm", "largest_policy_gap_cm", "timesteps",
                         "wall_s")
        }  # fmt: skip
        save_figure(own_gaits_figure(gaits["designs"]), options.out / "own_gaits.png", ("png",))
    action_s = (
        settings["coopt"]["task"]["action_step_count"]
        * (settings["robot"]["simulation"]["time_step_s"])
    )
    simulated_s, best_cm = coopt_curve(read_metrics(options.run / "training"), action_s)
    # Fine-tuning ends the curve with the best pair that is reported.
    reported = max(learned["best_distance_cm"], best_cm[-1])
    curves = {"learned together": ([*simulated_s, timesteps * action_s], [*best_cm, reported])}
    for method in METHODS:
        if method not in options.steps:
            continue
        found = run_once(
            work / method, "search", "--method", method, "--run", options.run,
            "--timesteps", timesteps,
        )  # fmt: skip
        curve = json.loads((work / method / CURVE_FILE).read_text())
        curves[f"{method} search"] = (curve["simulated_s"], curve["best_distance_cm"])
        result[method] = {
            name: found[name]
            for name in ("best_design", "best_distance_cm", "timesteps", "simulated_s", "pairs",
                         "wall_s")
        }  # fmt: skip
    figure = learning_curves_figure(curves, learned["baseline_best_distance_cm"])
    save_figure(figure, options.out / "learning_curves.png", ("png",))
    write_json(options.out / "answer.json", finite(result))
    print(f"wrote {options.out / 'answer.json'}")


if __name__ == "__main__":
    main()
