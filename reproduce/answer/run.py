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
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.run_folder import SUMMARY
from pneumorph.learn.search_run import CURVE_FILE
from pneumorph.report.learning_figures import learning_curves_figure, own_gaits_figure
from pneumorph.report.style import save_figure
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.learning_curve import learning_curve
from pneumorph.study.search import search
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_result import TrainingResult

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
    learned = FinishedRun.read(run)
    trained = learned.result(TrainingResult)
    timesteps = trained.timesteps + trained.finetuning_timesteps
    work = work / learned.digest()
    result: dict[str, Any] = {
        "run": learned.summary.get("made_by"),
        "timesteps": timesteps,
        "coopt": {name: getattr(trained, name) for name in ("best_design", "best_distance_cm")},
    }

    def searched(
        method: Literal["gaits", "random", "genetic"], timesteps: int | None
    ) -> SearchFindings | None:
        """What a search found; None where it is neither asked for nor finished."""
        if method not in steps:
            there = (work / method / SUMMARY).exists()
            return FinishedRun.read(work / method).result(SearchFindings) if there else None
        place = study_folder(work / method, "search")
        settings = SearchSettings(
            method=method, timesteps=timesteps, task=learned.task, space=learned.space
        )
        return study_once(
            place,
            SearchFindings,
            {"run": str(run), "search": settings, "robot": learned.robot},
            lambda: search(settings, learned.robot.spec(), place, learned),
        )

    gaits = searched("gaits", gait_timesteps)
    if gaits is not None:
        result["gaits"] = _chosen(gaits, "designs", "policy_gaps_cm", "timesteps", "wall_s")
        save_figure(own_gaits_figure(gaits.designs or ()), out / "own_gaits.png", ("png",))
    curves = {"learned together": learning_curve(run)}
    for method in METHODS:
        found = searched(method, timesteps)
        if found is None:
            continue
        curve = json.loads((work / method / CURVE_FILE).read_text())
        curves[f"{method} search"] = (curve["simulated_s"], curve["best_distance_cm"])
        result[method] = _chosen(
            found, "best_design", "best_distance_cm", "timesteps", "simulated_s", "pairs", "wall_s"
        )
    figure = learning_curves_figure(curves, trained.baseline_best_distance_cm)
    save_figure(figure, out / "learning_curves.png", ("png",))
    write_json(out / "answer.json", finite(result))
    print(f"wrote {out / 'answer.json'}")


def _chosen(found: SearchFindings, *names: str) -> dict[str, Any]:
    content = result_to_dict(found)
    return {name: content[name] for name in names}


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
