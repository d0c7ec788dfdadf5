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
        used = np.zeros(gait.regulator_count, dtype=bool)
        used[np.array(design.regulator_order(), dtype=int) - 1] = True
        return cls(gait, used)

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        return np.where(self.used, self.gait.pressure_kPa(time_s), 0.0)
