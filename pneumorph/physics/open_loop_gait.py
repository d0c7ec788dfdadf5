"""An open-loop gait: the pressures commanded as a function of time alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pneumorph.physics.commands import check_commands

MOST_STEPS = 1e7
"""Most time steps of a walk, a day at 0.01 s: more would fill the memory with commands."""

SAME_TIME_S = 1e-9
"""Times closer than this are the same instant: what rounding makes of sums of time steps [s]."""


class OpenLoopGait(Protocol):
    """Anything that says which pressure each regulator is commanded at a time."""

    @property
    def regulator_count(self) -> int:
        """Number of regulators it commands."""

    @property
    def duration_s(self) -> float:
        """How long the gait lasts [s]."""

    @property
    def maximum_pressure_kPa(self) -> float:
        """Highest real pressure that it may command [kPa]."""

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], shape (regulator,)."""


@dataclass(frozen=True, eq=False)
class ChangedGait:
    """What is made of another gait: as long, for as many regulators, with pressures of its own."""

    gait: OpenLoopGait

    @property
    def regulator_count(self) -> int:
        """Number of regulators it commands."""
        return self.gait.regulator_count

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return self.gait.duration_s

    @property
    def maximum_pressure_kPa(self) -> float:
        """Highest real pressure that it may command [kPa]."""
        return self.gait.maximum_pressure_kPa


def commands_of(gait: OpenLoopGait, time_step_s: float, regulator_count: int) -> np.ndarray:
    """Commands of a whole gait, held over each simulation step.

    Args:
        gait: The gait.
        time_step_s: Time step [s].
        regulator_count: Regulators of the robot; those beyond the gait's stay empty.

    Returns:
        Real pressures [kPa], (step, regulator).

    Raises:
        ValueError: As `sample_commands`, the gait is shorter than a step, or it commands more
            regulators.
    """
    if gait.regulator_count > regulator_count:
        raise ValueError(
            f"the gait commands {gait.regulator_count} regulators, expected at most the robot's "
            f"{regulator_count}"
        )
    commands = sample_commands(gait, time_step_s, step_count(gait.duration_s, time_step_s))
    return np.pad(commands, ((0, 0), (0, regulator_count - commands.shape[1])))


def step_count(duration_s: float, time_step_s: float) -> int:
    """Time steps of a walk.

    Args:
        duration_s: How long it lasts [s].
        time_step_s: Time step [s].

    Raises:
        ValueError: None fits in, or more than a computer can count.
    """
    steps = duration_s / time_step_s
    if not 0.5 < steps < MOST_STEPS:
        raise ValueError(
            f"duration_s is {duration_s:g}, expected from one time step, {time_step_s:g} s, to "
            f"{MOST_STEPS:g} of them"
        )
    return round(steps)


def sample_commands(gait: OpenLoopGait, time_step_s: float, step_count: int) -> np.ndarray:
    """Commands held over each simulation step: the gait's at the step's beginning.

    Args:
        gait: The gait.
        time_step_s: Time step [s].
        step_count: Steps.

    Returns:
        Real pressures [kPa], shape (step, regulator).

    Raises:
        ValueError: A pressure is not finite, negative, or above the gait's own limit.
    """
    commands = np.array([gait.pressure_kPa(step * time_step_s) for step in range(step_count)])
    check_commands(commands, gait.maximum_pressure_kPa)
    return commands
