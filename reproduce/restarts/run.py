"""What several short beginnings of a training find: preset fast with several seeds, an hour each.

    python reproduce/restarts/run.py

Each training is a run in a folder of its own under --work, which goes on where it was stopped; a
finished one is read. Its best pair then walks in the worlds of reproduce/robust, beside the
expert's robot there. Writes restarts.json, and the gait of each best pair.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import tyro

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.result import finite, result_from_dict, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.rivals import Found, learned
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, train_once

HERE = Path(__file__).parent


def main(
    seeds: tuple[int, ...] = (0, 1, 2),
    work: Path = Path("runs/restarts"),
    out: Path = HERE,
    threads: int = 0,
    certificate: Path = HERE.parent / "robust" / "certificate.json",
) -> None:
    """Train what is missing, and write what was found.

    Args:
        seeds: Of the trainings.
        work: Their folders.
        out: Folder of restarts.json and the gaits.
        threads: Of the engine; 0 takes every processor.
        certificate: Has the expert's distances in 200 unseen worlds.
    """
    expert = result_from_dict(Certificate, read_json(certificate, "certificate"))
    # The expert's come first.
    expert_cm = np.array(expert.achieved, dtype=float)[:, 0]
    rows = []
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
        rows.append(row)
        if best.gait_file is not None:
            shutil.copy(best.gait_file, out / f"seed_{seed}.csv")
        write_json(out / "restarts.json", finite({"seeds": rows}))
    print(f"wrote {out / 'restarts.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
