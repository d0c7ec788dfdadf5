"""An open-loop gait: the pressures commanded as a function of time alone."""

from __future__ import annotations

from typing import Protocol

import numpy as np

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

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], shape (regulator,)."""


def sample_commands(gait: OpenLoopGait, time_step_s: float, step_count: int) -> np.ndarray:
    """Commands held over each simulation step: the gait's at the step's beginning.

    Args:
        gait: The gait.
        time_step_s: Time step [s].
        step_count: Steps.

    Returns:
        Real pressures [kPa], shape (step, regulator).
    """
    return np.array([gait.pressure_kPa(step * time_step_s) for step in range(step_count)])
