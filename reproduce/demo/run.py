"""What the demo finds: its training with several seeds, five idle minutes each on two cores.

    python reproduce/demo/run.py

Each training is a run in a folder of its own under --work, which goes on where it was stopped; a
finished one is read. Then demo.json with what each found, and the gait of its best pair.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.settings import load_settings
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, TrainingOptions, train_once

HERE = Path(__file__).parent


def main(
    seeds: tuple[int, ...] = (0, 1, 2, 3),
    work: Path = Path("runs/demo_seeds"),
    out: Path = HERE,
    threads: int = 0,
    settings: Path | None = None,
) -> None:
    """Train what is missing, and write what was found.

    Args:
        seeds: Of the trainings.
        work: Their folders.
        out: Folder of demo.json and the gaits.
        threads: Of the engine; 0 takes every processor.
        settings: JSON or TOML file of settings laid over the demo's.
    """
    rows = []
    out.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        options = PRESETS["quick"]()
        if settings is not None:
            options = load_settings(TrainingOptions, settings, options)
        options = replace(options, coopt=replace(options.coopt, seed=seed))
        folder = study_folder(work / f"seed_{seed}", "coopt")
        found = train_once(options, folder, threads)
        certificate = found.certificate
        row: dict[str, Any] = {
            "seed": seed,
            "design": found.best_design,
            "score_cm": found.pairs[0].score_cm if found.pairs else None,
            "wall_s": found.wall_s,
        }
        if certificate is not None:
            best = certificate.pairs[int(certificate.best.removeprefix("L")) - 1]
            row |= {
                "design": best.design,
                "median_cm": best.band.median,
                "tenth_percentile_cm": best.band.low,
                "ninetieth_percentile_cm": best.band.high,
                "share_beyond_expert": best.share_beyond_expert,
                "nominal_cm": best.nominal,
                "expert_median_cm": certificate.expert_median,
                "world_count": certificate.world_count,
            }
            shutil.copy(folder.path / best.gait, out / f"seed_{seed}.csv")
        rows.append(row)
        print(row, flush=True)
    write_json(out / "demo.json", finite({"seeds": rows}))
    print(f"wrote {out / 'demo.json'}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
