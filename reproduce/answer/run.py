"""Is the answer good? Searches that share nothing with learning, with as much simulated time.

    python reproduce/answer/run.py RUN [--steps gaits random genetic]

`gaits` looks for the best gait of the expert's design, of L1 to L5 and of 30 random designs by
CMA-ES; `random` and `genetic` search designs and gaits together with the run's own number of
timesteps, fine-tuning included. All are resumable. Then answer.json and the two figures, of all
that was searched for this run, now or earlier.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from pneumorph.artefact import write_json
from pneumorph.command.learned_run import run_digest
from pneumorph.command.learning_curve import learning_curve
from pneumorph.command.run_folder import SUMMARY, finite, read_summary
from pneumorph.command.run_once import run_once
from pneumorph.command.search import CURVE_FILE
from pneumorph.report.search_figure import learning_curves_figure, own_gaits_figure
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
    learned = read_summary(options.run)
    timesteps = learned["timesteps"] + learned["finetuning_timesteps"]
    work = options.work / run_digest(options.run)
    result: dict[str, Any] = {
        "run": learned.get("made_by"),
        "timesteps": timesteps,
        "coopt": {name: learned[name] for name in ("best_design", "best_distance_cm")},
    }
    shorter = () if options.gait_timesteps is None else ("--timesteps", options.gait_timesteps)

    def searched(step: str, *flags: object) -> dict[str, Any] | None:
        """A search's summary; None where it is neither asked for nor finished."""
        if step not in options.steps:
            return read_summary(work / step) if (work / step / SUMMARY).exists() else None
        return run_once(work / step, "search", "--run", options.run, *flags)

    gaits = searched("gaits", *shorter)
    if gaits is not None:
        result["gaits"] = {
            name: gaits[name]
            for name in ("designs", "policy_gaps_cm", "timesteps", "wall_s")
        }  # fmt: skip
        save_figure(own_gaits_figure(gaits["designs"]), options.out / "own_gaits.png", ("png",))
    curves = {"learned together": learning_curve(options.run)}
    for method in METHODS:
        found = searched(method, "--method", method, "--timesteps", timesteps)
        if found is None:
            continue
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
