"""Does a weight for each option of each site find what a score for each design finds?

    python reproduce/factored/run.py --preset quick
    python reproduce/factored/run.py --preset fast

The paper's space, which is small enough for both, in one world. Each training is a run in a folder
of its own under --work, which goes on where it was stopped; a finished one is read. After each one
factored.json is written: what is known of the other preset and of other seeds stays in it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, get_args

import tyro

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.result import finite
from pneumorph.base.settings import load_settings
from pneumorph.learn.objective import Objective
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, TrainingOptions, train_once

HERE = Path(__file__).parent
SUMMARY = "factored.json"
Distribution = Literal["enumerated", "factored"]


def options_of(preset: str, distribution: Distribution, seed: int) -> TrainingOptions:
    """A preset's training in the nominal world alone."""
    options = PRESETS[preset]()
    return replace(
        options,
        randomize=False,
        certified_world_count=0,
        coopt=replace(options.coopt, seed=seed, distribution=distribution, objective=Objective()),
    )


def main(
    preset: Literal["quick", "fast"] = "fast",
    distributions: tuple[Distribution, ...] = get_args(Distribution),
    seeds: tuple[int, ...] = (0, 1, 2),
    work: Path = Path("runs/factored"),
    out: Path = HERE,
    threads: int = 0,
    settings: Path | None = None,
) -> None:
    """Train what is missing, and write what was found.

    Args:
        preset: Of the trainings.
        distributions: How designs are scored.
        seeds: Of the trainings.
        work: Their folders.
        out: Folder of factored.json.
        threads: Of the engine; 0 takes every processor.
        settings: JSON or TOML file of settings laid over the preset's.
    """
    path = out / SUMMARY
    known: dict[str, Any] = read_json(path, "JSON") if path.exists() else {}
    for seed in seeds:
        for distribution in distributions:
            options = options_of(preset, distribution, seed)
            if settings is not None:
                options = load_settings(TrainingOptions, settings, options)
            folder = study_folder(work / f"{preset}_{distribution}_{seed}", "coopt")
            found = train_once(options, folder, threads)
            row = {
                "design": found.best_design,
                "distance_cm": found.pairs[0].score_cm if found.pairs else None,
                "restart_distances_cm": found.restart_scores_cm,
                "wall_s": found.wall_s,
            }
            print(preset, distribution, seed, row, flush=True)
            known.setdefault(preset, {}).setdefault(distribution, {})[str(seed)] = row
            write_json(path, finite(known))
    print(f"wrote {path}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
