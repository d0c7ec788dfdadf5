"""The files of what the beginnings of a training saw, for a stopped one to go on with."""

from __future__ import annotations

from pathlib import Path

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.learn.checkpoint import Checkpoint
from pneumorph.learn.training import Training

KIND = "CooptTransitions"
VERSION = 1


def keep_transitions(training: Training, folder: Path) -> None:
    """Keep what the present beginning saw, if a later one is to learn from it.

    Args:
        training: At the last round of one of its beginnings.
        folder: Receives ``transitions.N.npz``, N from 1.
    """
    if training.pooling_follows:
        arrays = training.learned.buffer.arrays()
        number = training.restart + 1
        save_artefact(_file(folder, number), KIND, VERSION, arrays, _told(training, number))


def recall_transitions(training: Training, folder: Path, checkpoint: Checkpoint) -> None:
    """Give a training what its beginnings before a checkpoint saw, if one is to learn from that.

    Args:
        training: That will go on from the checkpoint.
        folder: Where `keep_transitions` kept it.
        checkpoint: The checkpoint.

    Raises:
        ArtefactError: Some of it is missing or damaged.
    """
    settings, metadata = training.settings, checkpoint.metadata
    if not settings.pooled_restarts or metadata["timestep"] >= settings.training_timesteps:
        return
    for number in range(1, metadata.get("restart", 0) + 1):
        file = _file(folder, number)
        if not file.exists():
            raise ArtefactError(
                f"{file} is missing, expected what beginning {number} of the training saw: "
                "later ones learn from it; copy the whole folder of a training"
            )
        arrays, told = load_artefact(file, KIND, VERSION)
        with reading(file, KIND):
            for name, expected in _told(training, number).items():
                if told[name] != expected:
                    raise ValueError(f"{name} is {told[name]!r:.40}, expected {expected}")
            training.learned.buffer.check(arrays)
            training.pool.add(arrays)


def forget_transitions(folder: Path) -> None:
    """Remove what was kept: no beginning is left to learn from it."""
    for file in folder.glob(_file(Path(), "*").name):
        file.unlink()


def _told(training: Training, number: int) -> dict[str, int]:
    """What tells the transitions of a beginning from those of others."""
    return {"beginning": number, "seed": training.settings.seed}


def _file(folder: Path, number: int | str) -> Path:
    return folder / f"transitions.{number}.npz"
