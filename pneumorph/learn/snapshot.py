"""What can be known of a training from its folder, finished or still being written."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import ArtefactError, read_json, reading
from pneumorph.base.result import result_from_dict
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.checkpoint import KIND, NEWEST, PREVIOUS, read_checkpoint
from pneumorph.learn.coopt_result import SUMMARY_FILE, CooptResult
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.metrics import DRAWN, METRICS_FILE, read_metrics
from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design


@dataclass(frozen=True, eq=False)
class TrainingSnapshot:
    """A training at one moment.

    Attributes:
        metrics: A dictionary for each round so far.
        pairs: The best pairs of the result, or else of the newest checkpoint, the highest score
            first; empty before there are any, which robots in drawn worlds have at the end alone.
        pairs_timestep: Timestep of the newest checkpoint; None before the first.
        timesteps: Timesteps when the training is finished.
        last_round_s_ago: Time since the last round was written [s]; None before the first.
    """

    metrics: list[dict[str, Any]]
    pairs: list[DesignGaitPair]
    pairs_timestep: int | None
    timesteps: int
    last_round_s_ago: float | None

    @property
    def timestep(self) -> int:
        """Timestep of the last round; 0 before the first."""
        return int(self.metrics[-1]["timestep"]) if self.metrics else 0

    @property
    def is_finished(self) -> bool:
        """Whether the last round has been made."""
        return self.timestep >= self.timesteps


def training_snapshot(folder: Path | str, settings: CooptSettings) -> TrainingSnapshot:
    """Read the folder of a training without changing it.

    Args:
        folder: The folder that `learn_in_folder` writes; it need not exist yet.
        settings: The training's settings.

    Raises:
        ArtefactError: None of its checkpoints can be read.
    """
    folder = Path(folder)
    pairs, timestep = _pairs(folder, settings)
    file = folder / METRICS_FILE
    found = TrainingSnapshot(
        metrics=read_metrics(folder, DRAWN),
        pairs=pairs,
        pairs_timestep=timestep,
        timesteps=settings.training_timesteps,
        last_round_s_ago=time.time() - file.stat().st_mtime if file.exists() else None,
    )
    result = folder / SUMMARY_FILE
    if found.is_finished and result.is_file():
        return replace(found, pairs=_found(folder, settings))
    return found


def _found(folder: Path, settings: CooptSettings) -> list[DesignGaitPair]:
    """Return the pairs of a finished training."""
    file = folder / SUMMARY_FILE
    with reading(file, "training"):
        found = result_from_dict(CooptResult, read_json(file, "JSON"))
    return [
        DesignGaitPair(
            settings.space.index(Design.parse(pair.design)),
            read_gait(folder / pair.gait)[0].held_kPa,
            pair.distance_cm,
            pair.score_cm,
            pair.source,
            pair.timestep,
            pair.distance_cm if pair.achieved is None else pair.achieved,
        )
        for pair in found.pairs
        if (folder / pair.gait).is_file()
    ]


def _pairs(folder: Path, settings: CooptSettings) -> tuple[list[DesignGaitPair], int | None]:
    """Return the pairs of the newest readable checkpoint, and its timestep."""
    failure = None
    for name in (NEWEST, PREVIOUS):
        try:
            checkpoint = read_checkpoint(folder / name)
        except FileNotFoundError:
            continue  # none yet, or this very moment the newest becomes the previous
        except ArtefactError as error:
            failure = error
            continue
        best = BestPairs(settings.space, settings.kept_pair_count, settings.is_symmetric)
        held = checkpoint.arrays.items()
        with reading(checkpoint.path, KIND):
            best.restore({key.removeprefix("best/"): v for key, v in held if "best/" in key})
        return best.pairs, checkpoint.metadata["timestep"]
    if failure is not None:
        raise failure
    return [], None
