"""Pressures of a bend test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.gait.held_gait import HeldGait


@dataclass(frozen=True)
class BendTestSettings(Checked):
    """A bend test: regulator 1 climbs a staircase while the leg is held at its root."""

    highest_kPa: Positive = 90.0
    """Last pressure [kPa]."""
    step_kPa: Positive = 10.0
    """Step between pressures [kPa]."""
    hold_s: Positive = 10.0
    """How long each pressure is held, to read the bend [s]."""
    repeats: Count = 3
    """Measurements of each pressure on the virtual rig."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step_kPa > self.highest_kPa:
            raise ValueError(
                f"step_kPa is {self.step_kPa}, expected at most highest_kPa, {self.highest_kPa}"
            )

    @property
    def pressures_kPa(self) -> np.ndarray:
        """The stairs [kPa]."""
        return np.arange(self.step_kPa, self.highest_kPa + 0.5 * self.step_kPa, self.step_kPa)

    def gait(self, regulator_count: int) -> HeldGait:
        """The staircase."""
        held = np.zeros((len(self.pressures_kPa), regulator_count))
        held[:, 0] = self.pressures_kPa
        return HeldGait.evenly(held, self.hold_s)
