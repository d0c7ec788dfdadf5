"""From the pressure asked of a real regulator to the pressure in the simulated cavity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Positive


@dataclass(frozen=True)
class PressureMap(Checked):
    """Affine map of real to simulated pressure, p_sim = max(0, slope p_real + intercept).

    It makes the simulated leg bend as the real one does (paper, appendix A). Made without arguments
    it is the least-squares line of the published calibration.
    """

    slope: Positive = 4.0785
    """Simulated kPa per real kPa."""
    intercept_kPa: float = -20.361
    """Simulated pressure at zero real pressure [kPa], before it is cut off at zero."""

    def simulated(self, real_kPa: np.ndarray | float) -> np.ndarray:
        """Simulated pressure [kPa] of a real one [kPa], any shape."""
        return np.maximum(0.0, self.slope * np.asarray(real_kPa, dtype=float) + self.intercept_kPa)

    def real(self, simulated_kPa: np.ndarray | float) -> np.ndarray:
        """Real pressure [kPa] of a simulated one above zero [kPa], any shape; never below zero."""
        simulated = np.asarray(simulated_kPa, dtype=float)
        return np.maximum(0.0, (simulated - self.intercept_kPa) / self.slope)

    def equivalent(self, real_kPa: np.ndarray | float, other: PressureMap) -> np.ndarray:
        """Real pressure [kPa] that means under ``other`` what ``real_kPa`` means under this map.

        Pressures that this map cuts off at zero stay where they are, or just cut off under
        ``other``, whichever is less.
        """
        real = np.asarray(real_kPa, dtype=float)
        simulated = self.simulated(real)
        return np.where(simulated > 0.0, other.real(simulated), np.minimum(real, other.real(0.0)))


def rate_limit(
    regulated_kPa: np.ndarray, command_kPa: np.ndarray, rate_kPa_per_s: float, time_step_s: float
) -> np.ndarray:
    """Pressure after one step of a regulator that moves towards its command at a limited rate.

    Args:
        regulated_kPa: Pressure now [real kPa], (regulator,).
        command_kPa: Pressure asked for [real kPa], (regulator,).
        rate_kPa_per_s: Most change [kPa/s].
        time_step_s: Time step [s].
    """
    most = rate_kPa_per_s * time_step_s
    return regulated_kPa + np.clip(np.asarray(command_kPa) - regulated_kPa, -most, most)
