"""Learning that begins from nothing several times: the beginning with the best pair is kept.

What a training finds is a matter of the gaits that it comes upon first, so that trainings of
different seeds end far apart, and longer ones do so as well. Of several short ones the best is less
a matter of chance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import ArtefactError, save_artefact
from pneumorph.learn.checkpoint import KIND, VERSION, read_checkpoint
from pneumorph.learn.training import Training

BEST_RESTART = "checkpoint.best_restart.npz"


def keep_if_best(training: Training, folder: Path, metadata: Mapping[str, Any]) -> None:
    """At the end of a beginning, evaluate its policy, and keep what was learned if its best pair
    scores higher than those of the beginnings before; the pairs compete in any case, and later
    beginnings that learn from this one know what they scored.

    Args:
        training: At the last round of one of its beginnings.
        folder: Receives ``checkpoint.best_restart.npz``.
        metadata: As in a checkpoint.
    """
    evaluated = training.evaluate()
    before = training.restart_scores_cm[: training.restart]
    score = evaluated[0].score_cm if evaluated else None
    if training.pooling_follows:
        training.pool.note(evaluated)
    training.restart_scores_cm = [*before, score]
    if not before or _key(score) > max(map(_key, before)):
        save_artefact(folder / BEST_RESTART, KIND, VERSION, training.arrays(), metadata)


def check_kept(training: Training, folder: Path) -> None:
    """Refuse a folder that has lost the best of the beginnings that have ended.

    Raises:
        ArtefactError: It is missing or damaged.
    """
    kept = folder / BEST_RESTART
    if not 0 < len(training.restart_scores_cm) < training.settings.restarts:
        return
    if not kept.exists():
        raise ArtefactError(
            f"{kept} is missing, expected the best of the {len(training.restart_scores_cm)} "
            "beginnings that have ended; copy the whole folder of a training"
        )
    read_checkpoint(kept)


def go_on_with_best(training: Training, folder: Path) -> None:
    """Take over what the beginning learned that was kept.

    Raises:
        FileNotFoundError: None was.
        ArtefactError: It is damaged.
    """
    training.go_on_as(read_checkpoint(folder / BEST_RESTART))


def _key(score_cm: float | None) -> float:
    return -math.inf if score_cm is None else score_cm
