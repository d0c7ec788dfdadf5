"""What several short beginnings of a training find: preset fast with several seeds, an hour each.

    python reproduce/restarts/run.py
    python reproduce/restarts/run.py --walk-again

Each training is a run in a folder of its own under --work, which goes on where it was stopped; a
finished one is read. Its best pair then walks in the worlds of reproduce/robust, beside the
expert's robot there. Writes restarts.json, in which other seeds stay as they are, and the gait of
each best pair. With --walk-again nothing is trained: the gaits that are kept walk in these worlds
on the legs of today.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.result import finite, result_from_dict, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.gait.gait_file import read_gait
from pneumorph.robot.design import Design
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.rivals import WORLDS, Contender, Found, learned
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, train_once

HERE = Path(__file__).parent


def main(
    seeds: tuple[int, ...] = (0, 1, 2),
    work: Path = Path("runs/restarts"),
    out: Path = HERE,
    threads: int = 0,
    certificate: Path = HERE.parent / "robust" / "certificate.json",
    walk_again: bool = False,
) -> None:
    """Train what is missing, and write what was found.

    Args:
        seeds: Of the trainings, or which of those that are there walk again.
        work: Their folders.
        out: Folder of restarts.json and the gaits.
        threads: Of the engine; 0 takes every processor.
        certificate: Has the expert's distances in 200 unseen worlds.
        walk_again: Walk the gaits of restarts.json, and train nothing.
    """
    expert = result_from_dict(Certificate, read_json(certificate, "certificate"))
    # The expert's come first.
    expert_cm = np.array(expert.achieved, dtype=float)[:, 0]
    summary = out / "restarts.json"
    kept = read_json(summary, "JSON")["seeds"] if walk_again or summary.exists() else []
    if walk_again:
        rows = [
            _walked_again(row, out, work, expert_cm, threads) if row["seed"] in seeds else row
            for row in kept
        ]
        write_json(summary, finite({"seeds": rows}))
        print(f"wrote {summary}")
        return
    for seed in seeds:
        options = PRESETS["fast"]()
        options = replace(options, coopt=replace(options.coopt, seed=seed))
        folder = study_folder(work / f"seed_{seed}", "coopt")
        found = train_once(options, folder, threads)
        run = FinishedRun.read(folder.path)
        best = learned(run)
        far_cm = best.walked(run, RunFolder(folder.path, "coopt"))
        row = {
            **result_to_dict(Found.of(best, far_cm, expert_cm)),
            "score_cm": best.score_cm,
            "restart_scores_cm": found.restart_scores_cm,
            "wall_s": found.wall_s,
        }
        kept = sorted(
            [row, *(each for each in kept if each["seed"] != seed)], key=lambda each: each["seed"]
        )
        if best.gait_file is not None:
            shutil.copy(best.gait_file, out / f"seed_{seed}.csv")
        write_json(summary, finite({"seeds": kept}))
    print(f"wrote {summary}")


def _walked_again(
    row: dict[str, Any], out: Path, work: Path, expert_cm: np.ndarray, threads: int
) -> dict[str, Any]:
    """What is kept of a seed, with the bands of today's legs."""
    options, seed = PRESETS["fast"](), row["seed"]
    task, file = options.coopt.task, out / f"seed_{seed}.csv"
    gait, comments = read_gait(file, task.minimum_pressure_kPa, task.maximum_pressure_kPa)
    design = Design.parse(comments["design"])
    achieved, *_ = walks_in_worlds(
        replace(options.robot, threads=threads).spec(),
        [design],
        [gait],
        unseen_worlds(options.randomisation, WORLDS, 0),
        task.settling_step_count,
        RunFolder(work, "coopt"),
        task.goal,
    )
    best = Contender(
        row["method"],
        seed,
        row["timesteps"],
        row["wall_s"],
        design,
        gait,
        file,
        row["score_cm"],
    )
    return {**row, **result_to_dict(Found.of(best, achieved[:, 0], expert_cm))}


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
