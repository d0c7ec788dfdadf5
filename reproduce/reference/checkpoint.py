"""Save a full-order robot's state with the rows so far, and go on from it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pneumorph.base.artefact import load_artefact, save_artefact
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.state_file import state_from_arrays, state_to_arrays

KIND, FORMAT_VERSION = "ReferenceCheckpoint", 2


def save(path: Path, state: FullRobotState, description: dict[str, Any]) -> None:
    """Write the state of a robot, and JSON-serialisable notes."""
    header = {"description": description}
    save_artefact(path, KIND, FORMAT_VERSION, state_to_arrays(state), header)


def load(path: Path, robot: FullRobot) -> tuple[FullRobotState, dict[str, Any]]:
    """Read what `save` wrote of a robot."""
    arrays, header = load_artefact(path, KIND, FORMAT_VERSION)
    return state_from_arrays(robot, arrays), header["description"]
