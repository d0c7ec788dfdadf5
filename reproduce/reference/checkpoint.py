"""Save a full-order robot's state with the rows so far, and go on from it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import load_artefact, save_artefact
from pneumorph.fem.full_robot import FullRobotState
from pneumorph.fem.soft_hub import SoftHubState

KIND, FORMAT_VERSION = "ReferenceCheckpoint", 1


def save(path: Path, state: FullRobotState, description: dict[str, Any]) -> None:
    """Write the state of a robot on a soft hub, and JSON-serialisable notes.

    Raises:
        ValueError: The hub is rigid.
    """
    if not isinstance(state.hub, SoftHubState):
        raise ValueError("state.hub is rigid, expected a soft one as the reference has")
    arrays = {
        "hub_positions": state.hub.positions,
        "hub_velocity": state.hub.velocity,
        "regulated_kPa": state.regulated_kPa,
        "impulses": state.impulses,
    }
    for number, (x, v) in enumerate(zip(state.positions, state.velocities, strict=True)):
        arrays[f"positions_{number}"], arrays[f"velocities_{number}"] = x, v
    save_artefact(path, KIND, FORMAT_VERSION, arrays, {"description": description})


def load(path: Path) -> tuple[FullRobotState, dict[str, Any]]:
    """Read what `save` wrote."""
    arrays, header = load_artefact(path, KIND, FORMAT_VERSION)
    legs = sum(name.startswith("positions_") for name in arrays)
    state = FullRobotState(
        hub=SoftHubState(np.array(arrays["hub_positions"]), np.array(arrays["hub_velocity"])),
        positions=tuple(arrays[f"positions_{number}"] for number in range(legs)),
        velocities=tuple(arrays[f"velocities_{number}"] for number in range(legs)),
        regulated_kPa=arrays["regulated_kPa"],
        impulses=arrays["impulses"],
    )
    return state, header["description"]
