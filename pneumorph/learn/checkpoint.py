"""Checkpoints that a kill at any moment cannot spoil: the newest and the one before it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.base.result import result_from_dict

KIND = "CooptCheckpoint"
VERSION = 1
NEWEST = "checkpoint.npz"
PREVIOUS = "checkpoint.previous.npz"
DAMAGED = "checkpoint.damaged.npz"


@dataclass(frozen=True)
class CheckpointMetadata:
    """What must stand beside the arrays, for a training to go on.

    Attributes:
        timestep: Actions of all robots so far.
        update_count: Updates of the learner so far.
        failure_count: Episodes so far whose simulation failed.
        seconds: Time that each stage took [s].
        random_state: State of the generator that draws designs and batches, as JSON.
        settings: Those of the training.
        provenance: What the run was begun with.
        wall_s: Time spent so far [s].
        remarks: What had to be said so far.
        round_level: State of `RoundLevel`; None in checkpoints of earlier versions.
        restart: How many beginnings from nothing were before; 0 in those of earlier versions.
        restart_scores_cm: What the best pair of each that has ended scored [cm].
        found: Index of each design that beginnings found, and what it scored [cm], where later
            beginnings learn from that.
        evaluation_timesteps: Actions so far of walks that rank gaits; None where a version that
            did not count them began.
    """

    timestep: int
    update_count: int
    failure_count: int
    seconds: dict[str, float]
    random_state: str
    settings: dict[str, Any]
    provenance: dict[str, Any]
    wall_s: float
    remarks: tuple[str, ...]
    round_level: dict[str, Any] | None = None
    restart: int = 0
    restart_scores_cm: tuple[float | None, ...] = ()
    found: tuple[tuple[int, float], ...] = ()
    evaluation_timesteps: int | None = None


@dataclass(frozen=True)
class Checkpoint:
    """What was read back.

    Attributes:
        path: The file.
        arrays: Arrays by name.
        metadata: JSON values, of which `CheckpointMetadata` says which there are.
        remark: What had to be said about reading it, or None.
    """

    path: Path
    arrays: dict[str, np.ndarray]
    metadata: dict[str, Any]
    remark: str | None


def save_checkpoint(
    folder: Path | str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]
) -> Path:
    """Write the newest checkpoint; what was the newest becomes the previous one.

    The new file is complete on disk before anything is renamed, so at every moment at least one of
    the two is whole.
    """
    folder = Path(folder)
    newest = folder / NEWEST
    complete = save_artefact(folder / f"{NEWEST}.new", KIND, VERSION, arrays, metadata)
    if newest.exists():
        os.replace(newest, folder / PREVIOUS)
    os.replace(complete, newest)
    return newest


def has_checkpoint(folder: Path | str) -> bool:
    """Whether a folder holds a checkpoint, whole or not."""
    return any((Path(folder) / name).exists() for name in (NEWEST, PREVIOUS))


def load_checkpoint(folder: Path | str) -> Checkpoint:
    """Read the newest whole checkpoint of a folder.

    A newest one that is missing or damaged is replaced by the previous one, with a warning; a
    damaged one is kept beside it under another name.

    Raises:
        FileNotFoundError: The folder holds no checkpoint.
        ArtefactError: None of its checkpoints can be read.
    """
    folder = Path(folder)
    if not has_checkpoint(folder):
        raise FileNotFoundError(
            f"{folder} holds no checkpoint ({NEWEST}), expected the folder of a training run"
        )
    try:
        return read_checkpoint(folder / NEWEST)
    except (ArtefactError, FileNotFoundError) as error:
        reason = str(error)
    try:
        previous = read_checkpoint(folder / PREVIOUS)
    except FileNotFoundError:
        raise ArtefactError(f"{reason}; and there is no previous checkpoint") from None
    except ArtefactError as error:
        raise ArtefactError(f"{reason}; and the previous checkpoint fails too: {error}") from error
    if (folder / NEWEST).exists():
        # Set aside, or the next save would make it the previous one and lose the only whole one.
        os.replace(folder / NEWEST, folder / DAMAGED)
    remark = f"the previous checkpoint is used, because the newest one fails: {reason}"
    warnings.warn(remark, stacklevel=2)
    return replace(previous, remark=remark)


def peek_checkpoint(folder: Path | str) -> Checkpoint | None:
    """The newest whole checkpoint of a folder that another process may be writing into: nothing is
    set aside. None where there is none; `load_checkpoint` says why."""
    for name in (NEWEST, PREVIOUS):
        with suppress(ArtefactError, FileNotFoundError):
            return read_checkpoint(Path(folder) / name)
    return None


def read_checkpoint(path: Path) -> Checkpoint:
    """Read one file, the newest checkpoint or the previous one.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It is truncated, or its metadata lack a field or have one of another type.
    """
    arrays, metadata = load_artefact(path, KIND, VERSION)
    with reading(path, KIND):
        result_from_dict(CheckpointMetadata, metadata)
    return Checkpoint(path, arrays, metadata, remark=None)
