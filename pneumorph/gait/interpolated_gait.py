"""A gait of pressures that are approached in straight lines, as rigs' waypoint files prescribe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import rises
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, check_commands


@dataclass(frozen=True, eq=False)
class InterpolatedGait:
    """Waypoints joined by straight lines.

    Attributes:
        time_s: Time of each waypoint, rising from 0 [s], (waypoint,).
        waypoint_kPa: Real pressures [kPa], (waypoint, regulator).
        maximum_pressure_kPa: Highest pressure that is accepted [kPa].

    Raises:
        ValueError: Times that do not rise from 0, other shapes, or a pressure out of range.
    """

    time_s: np.ndarray
    waypoint_kPa: np.ndarray
    maximum_pressure_kPa: float = HIGHEST_COMMAND_KPA

    def __post_init__(self) -> None:
        if self.waypoint_kPa.ndim != 2 or len(self.time_s) != len(self.waypoint_kPa):
            raise ValueError(
                f"waypoint_kPa has shape {self.waypoint_kPa.shape}, expected (waypoint, regulator) "
                f"with {len(self.time_s)} waypoints"
            )
        if len(self.time_s) < 2 or self.time_s[0] != 0.0 or not rises(self.time_s):
            raise ValueError(
                f"times of waypoints are {np.asarray(self.time_s).tolist()}, expected at least two "
                "finite ones that rise from 0"
            )
        check_commands(self.waypoint_kPa, self.maximum_pressure_kPa, name="pressure_kPa")

    @property
    def regulator_count(self) -> int:
        """Number of regulators it commands."""
        return int(self.waypoint_kPa.shape[1])

    @property
    def duration_s(self) -> float:
        """How long the gait lasts [s]."""
        return float(self.time_s[-1])

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        return np.array([np.interp(time_s, self.time_s, p) for p in self.waypoint_kPa.T])

    def held(self, hold_s: float) -> HeldGait:
        """The gait as commands that are each held, taken in the middle of their span."""
        count = max(1, round(self.duration_s / hold_s))
        start_s = hold_s * np.arange(count)
        end_s = np.append(start_s[1:], self.duration_s)
        held = np.array([self.pressure_kPa(time_s) for time_s in 0.5 * (start_s + end_s)])
        return HeldGait(
            start_s, held, self.duration_s, maximum_pressure_kPa=self.maximum_pressure_kPa
        )
