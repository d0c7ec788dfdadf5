"""Arrays of a full-order robot's state, to save it and to go on from it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.maxwell_group import ViscousState

_ARRAYS = ("regulated_kPa", "impulses", "contact_velocities", "pressure_work_mJ")
_NUMBERS = ("active_contacts", "contact_residual", "penetration_mm", "iterations", "substeps")


def state_to_arrays(state: FullRobotState) -> dict[str, np.ndarray]:
    """All of a state by name."""
    arrays = {name: getattr(state, name) for name in _ARRAYS}
    arrays["numbers"] = np.array([getattr(state, name) for name in _NUMBERS], dtype=float)
    for number, (x, v) in enumerate(zip(state.positions, state.velocities, strict=True)):
        arrays[f"positions_{number}"], arrays[f"velocities_{number}"] = x, v
    for number, memory in enumerate(state.memories):
        if memory is not None:
            arrays |= {f"memory_{name}_{number}": value for name, value in vars(memory).items()}
    return arrays | {f"hub_{name}": value for name, value in vars(state.hub).items()}


def state_from_arrays(robot: FullRobot, arrays: dict[str, np.ndarray]) -> FullRobotState:
    """The state that `state_to_arrays` took apart.

    Args:
        robot: The robot whose state it is.
        arrays: Arrays by name.

    Raises:
        ArtefactError: The arrays are of another robot.
    """
    initial = robot.initial_state()
    usual = state_to_arrays(initial)
    for name, value in usual.items():
        if name not in arrays or np.shape(arrays[name]) != np.shape(value):
            raise ArtefactError(
                f"{name} of the saved state must have shape {np.shape(value)}, got "
                f"{np.shape(arrays[name]) if name in arrays else 'none'}; it belongs to another "
                "robot"
            )
    hub = {name[4:]: arrays[name] for name in usual if name.startswith("hub_")}
    numbers = dict(zip(_NUMBERS, arrays["numbers"], strict=True))
    legs = range(len(robot.legs))
    return FullRobotState(
        hub=replace(cast(Any, initial.hub), **hub),  # a dataclass of arrays, as `HubMotion` says
        positions=tuple(arrays[f"positions_{leg}"] for leg in legs),
        velocities=tuple(arrays[f"velocities_{leg}"] for leg in legs),
        memories=tuple(
            None
            if memory is None
            else ViscousState(*(arrays[f"memory_{name}_{leg}"] for name in vars(memory)))
            for leg, memory in enumerate(initial.memories)
        ),
        **{name: arrays[name] for name in _ARRAYS},
        active_contacts=int(numbers["active_contacts"]),
        contact_residual=float(numbers["contact_residual"]),
        penetration_mm=float(numbers["penetration_mm"]),
        iterations=int(numbers["iterations"]),
        substeps=int(numbers["substeps"]),
    )
