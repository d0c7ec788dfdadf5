"""One way to run any robot: full-order or reduced."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeVar

import numpy as np

from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, check_commands
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.physics.physics import Physics
from pneumorph.trajectory import Trajectory

State = TypeVar("State")


class RobotModel(Protocol[State]):
    """What full-order and reduced robots have in common."""

    @property
    def physics(self) -> Physics:
        """What acts on the robot."""

    def initial_state(self) -> State:
        """At rest in the pose that the physics start in, no pressure."""

    def rollout(
        self,
        state: State,
        commands_kPa: np.ndarray,
        record_every: int = 5,
        record_nodes: bool = True,
        description: dict[str, Any] | None = None,
        *,
        progress: bool = False,
    ) -> tuple[State, Trajectory]:
        """Follow commands from a state."""


def rollout(
    model: RobotModel[State],
    commands_kPa: np.ndarray | OpenLoopGait,
    state: State | None = None,
    settling_steps: int = 15,
    record_every: int = 5,
    record_nodes: bool = True,
    description: dict[str, Any] | None = None,
    progress: bool = False,
    highest_kPa: float = HIGHEST_COMMAND_KPA,
) -> tuple[State, Trajectory]:
    """Run a robot under commands, from a state or from the pose that the physics start in, settled.

    Args:
        model: A full-order or a reduced robot.
        commands_kPa: Real pressure asked for in every step [kPa], (step, regulator), or a gait.
        state: Where to start; None lets the robot fall and settle first.
        settling_steps: Steps at zero pressure before the start, when no state is given.
        record_every: Steps between frames.
        record_nodes: Record every node's position.
        description: What else to note in the trajectory's metadata.
        progress: Show a progress bar with the time left.
        highest_kPa: Highest command that is allowed [kPa]; a gait has a limit of its own.

    Returns:
        The state at the end, and the trajectory; that of the fall where it did not come to its end.

    Raises:
        TypeError: What should walk is no robot, or what it should walk is no gait.
        ValueError: A command is not finite, negative, or too high, or is of a regulator that the
            robot has not.
    """
    if not hasattr(model, "rollout"):
        raise TypeError(
            f"model is a {type(model).__name__}, expected a robot of a design, such as "
            "paper_robot().reduced(design) or .full(design)"
        )
    if settling_steps < 0:
        raise ValueError(f"settling_steps is {settling_steps}, expected at least 0")
    if isinstance(commands_kPa, np.ndarray | Sequence) and not isinstance(commands_kPa, str):
        commands = np.atleast_2d(np.asarray(commands_kPa, dtype=float))
    elif hasattr(commands_kPa, "pressure_kPa"):
        physics, highest_kPa = model.physics, commands_kPa.maximum_pressure_kPa
        commands = commands_of(commands_kPa, physics.time_step_s, physics.regulator_count)
    else:
        raise TypeError(
            f"commands_kPa is {commands_kPa!r:.60}, expected pressures (step, regulator) in kPa, "
            "or a gait such as ExpertGait(); read_gait of pneumorph.gait.gait_file reads a file"
        )
    check_commands(commands, highest_kPa)
    model.physics.air.check_supply(commands)
    if state is None:
        rest = np.zeros((settling_steps, commands.shape[1]))
        state, settled = model.rollout(
            model.initial_state(), rest, record_every=settling_steps or 1, record_nodes=False
        )
        if settled.status != "completed":  # once more, as it is asked to be seen
            return model.rollout(
                model.initial_state(), rest, record_every, record_nodes, description
            )
    return model.rollout(
        state, commands, record_every, record_nodes, description, progress=progress
    )
