"""Checkpoints that a kill at any moment cannot spoil: the newest and the one before it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, save_artefact

KIND = "CooptCheckpoint"
VERSION = 1
NEWEST = "checkpoint.npz"
PREVIOUS = "checkpoint.previous.npz"
DAMAGED = "checkpoint.damaged.npz"


@dataclass(frozen=True)
class Checkpoint:
    """What was read back.

    Attributes:
        arrays: Arrays by name.
        metadata: JSON values.
        remark: What had to be said about reading it, or None.
    """

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
        return Checkpoint(*load_artefact(folder / NEWEST, KIND, VERSION), remark=None)
    except (ArtefactError, FileNotFoundError) as error:
        reason = str(error)
    try:
        arrays, metadata = load_artefact(folder / PREVIOUS, KIND, VERSION)
    except FileNotFoundError:
        raise ArtefactError(f"{reason}; and there is no previous checkpoint") from None
    except ArtefactError as error:
        raise ArtefactError(f"{reason}; and the previous checkpoint fails too: {error}") from error
    if (folder / NEWEST).exists():
        # Set aside, or the next save would make it the previous one and lose the only whole one.
        os.replace(folder / NEWEST, folder / DAMAGED)
    remark = f"the previous checkpoint is used, because the newest one fails: {reason}"
    warnings.warn(remark, stacklevel=2)
    return Checkpoint(arrays, metadata, remark)
