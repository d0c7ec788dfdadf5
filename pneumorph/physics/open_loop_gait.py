"""An open-loop gait: the pressures commanded as a function of time alone."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pneumorph.physics.commands import check_commands

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


def commands_of(gait: OpenLoopGait, time_step_s: float, regulator_count: int) -> np.ndarray:
    """Commands of a whole gait, held over each simulation step.

    Args:
        gait: The gait.
        time_step_s: Time step [s].
        regulator_count: Regulators of the robot; those beyond the gait's stay empty.

    Returns:
        Real pressures [kPa], (step, regulator).
    """
    commands = sample_commands(gait, time_step_s, round(gait.duration_s / time_step_s))
    beyond = regulator_count - commands.shape[1]
    return np.pad(commands, ((0, 0), (0, max(beyond, 0))))


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
