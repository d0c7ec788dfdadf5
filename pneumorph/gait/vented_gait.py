"""A gait that leaves regulators without a leg at the pressure around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.physics.open_loop_gait import ChangedGait, OpenLoopGait
from pneumorph.robot.design import Design


@dataclass(frozen=True, eq=False)
class VentedGait(ChangedGait):
    """A gait for a design: where no tube ends, nothing blows.

    Attributes:
        used: Whether the design has a leg at each regulator, (regulator,) bool.
    """

    used: np.ndarray

    @classmethod
    def of(cls, gait: OpenLoopGait, design: Design) -> VentedGait:
        """The gait for a design's regulators alone."""
        numbers = np.arange(1, gait.regulator_count + 1)
        return cls(gait, np.isin(numbers, design.regulator_order()))

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        return np.where(self.used, self.gait.pressure_kPa(time_s), 0.0)
