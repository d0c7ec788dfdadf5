"""The expert's gait of the paper's baseline: two sine waves, one later than the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked, NotNegative
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, RegulatorCount
from pneumorph.physics.open_loop_gait import SAME_TIME_S

Duration = Annotated[float, Bounds(least=SAME_TIME_S)]


@dataclass(frozen=True)
class ExpertGait(Checked):
    """Regulator 1 follows ``A - A cos(2 pi t / T)``; regulator 2 the same, later by the phase.

    Regulator 2 stays at zero before its wave begins, further regulators always. Amplitude and
    period are the paper's (section IV); the command interval is the authors' controller's.
    """

    phase_deg: NotNegative = 110.0
    """Delay of regulator 2 behind regulator 1, as degrees of a period."""
    amplitude_kPa: NotNegative = 45.0
    """Amplitude A [kPa]; pressures go from 0 to 2 A."""
    period_s: Duration = 4.0
    """Period T of the wave [s]."""
    command_interval_s: NotNegative = 0.33
    """Time between commands [s]; each is held until the next. 0 follows the wave continuously."""
    duration_s: Duration = 20.0
    """Length of the gait [s]."""
    regulator_count: Annotated[
        RegulatorCount, Bounds(least=2, why="one wave each for fore and hind legs")
    ] = 3
    """Number of regulators of the rig."""
    maximum_pressure_kPa: NotNegative = HIGHEST_COMMAND_KPA
    """Highest pressure that it may command [kPa]. A rig's own limits hold as well."""

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], shape (regulator,)."""
        if self.command_interval_s > 0.0:
            updates = math.floor((time_s + SAME_TIME_S) / self.command_interval_s)
            time_s = updates * self.command_interval_s
        pressure = np.zeros(self.regulator_count)
        delay_s = self.phase_deg / 360.0 * self.period_s
        pressure[:2] = self._wave(time_s), self._wave(time_s - delay_s)
        return pressure

    def _wave(self, time_s: float) -> float:
        if time_s <= 0.0:
            return 0.0
        return self.amplitude_kPa * (1.0 - math.cos(2.0 * math.pi * time_s / self.period_s))
