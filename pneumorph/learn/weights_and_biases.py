"""Metrics for Weights & Biases, where they are asked for; it never asks for anything itself."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any


def open_wandb(folder: Path, project: str, timestep: int) -> Any:
    """Open a run of Weights & Biases, whose ``log(values, step=)`` and ``finish()`` are used.

    It is online where WANDB_API_KEY is set and WANDB_MODE does not say otherwise; else it writes
    into the folder, for ``wandb sync`` to send later. A resumed training opens another run of the
    same group.

    Args:
        folder: The training folder in a run folder, whose name is the group.
        project: Name of the project.
        timestep: Timestep that training goes on from.

    Raises:
        ImportError: Weights & Biases is not installed.
    """
    try:
        import wandb
    except ImportError as error:
        raise ImportError(
            "logging to Weights & Biases needs its package: pip install 'pneumorph[wandb]'"
        ) from error
    mode: Any = os.environ.get("WANDB_MODE", "online")
    if mode == "online" and not os.environ.get("WANDB_API_KEY"):
        mode = "offline"  # online without a key it would ask for one
    folder.mkdir(parents=True, exist_ok=True)
    return wandb.init(
        project=project,
        dir=folder,
        group=folder.resolve().parent.name,
        name=f"{folder.resolve().parent.name} from {timestep}",
        mode=mode,
        settings=wandb.Settings(silent=True, console="off", disable_git=True),
    )
