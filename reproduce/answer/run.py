"""Is the answer good? Searches that share nothing with learning, with as much simulated time.

    python reproduce/answer/run.py RUN

`gaits` looks for the best gait of the expert's design, of L1 to L5 and of 30 random designs by
CMA-ES; `random` and `genetic` search designs and gaits together with the run's own number of
timesteps, fine-tuning included. All are resumable. Then answer.json and the two figures, of all
that was searched for this run, now or earlier.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import result_from_dict
from pneumorph.base.run_folder import SUMMARY, finite, read_summary
from pneumorph.learn.search_run import CURVE_FILE
from pneumorph.report.learning_figures import learning_curves_figure, own_gaits_figure
from pneumorph.report.style import save_figure
from pneumorph.run_once import run_once
from pneumorph.study.finished_run import run_digest
from pneumorph.study.learning_curve import learning_curve
from pneumorph.study.search_findings import SearchFindings

HERE = Path(__file__).parent
METHODS: tuple[Literal["random", "genetic"], ...] = ("random", "genetic")


def main(
    run: tyro.conf.Positional[Path],
    out: Path = HERE,
    work: Path = Path("runs/answer"),
    steps: tuple[Literal["gaits", "random", "genetic"], ...] = ("gaits", *METHODS),
    gait_timesteps: int | None = None,
) -> None:
    """Search what is missing, compare and draw.

    Args:
        run: Folder of the coopt run.
        out: Folder of answer.json and the figures.
        work: Where the searches run.
        steps: Which of them.
        gait_timesteps: Less than the 960 gaits a design.
    """
    learned = read_summary(run)
    timesteps = learned["timesteps"] + learned["finetuning_timesteps"]
    work = work / run_digest(run)
    result: dict[str, Any] = {
        "run": learned.get("made_by"),
        "timesteps": timesteps,
        "coopt": {name: learned[name] for name in ("best_design", "best_distance_cm")},
    }
    shorter = () if gait_timesteps is None else ("--timesteps", gait_timesteps)

    def searched(step: str, *flags: object) -> dict[str, Any] | None:
        """A search's summary; None where it is neither asked for nor finished."""
        if step not in steps:
            return read_summary(work / step) if (work / step / SUMMARY).exists() else None
        return run_once(work / step, "search", "--run", run, *flags)

    gaits = searched("gaits", *shorter)
    if gaits is not None:
        result["gaits"] = {
            name: gaits[name] for name in ("designs", "policy_gaps_cm", "timesteps", "wall_s")
        }
        found_gaits = result_from_dict(SearchFindings, gaits).designs or ()
        save_figure(own_gaits_figure(found_gaits), out / "own_gaits.png", ("png",))
    curves = {"learned together": learning_curve(run)}
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
    save_figure(figure, out / "learning_curves.png", ("png",))
    write_json(out / "answer.json", finite(result))
    print(f"wrote {out / 'answer.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
