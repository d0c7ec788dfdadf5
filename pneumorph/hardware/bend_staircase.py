"""Pressures of a bend test."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA

_SAME_STAIR = 1e-9
"""The highest pressure is on the grid of steps if it is within this share of a step."""


@dataclass(frozen=True)
class BendTestSettings(Checked):
    """A bend test: one leg is held at its root, and the pressure of regulator 1 rises in steps."""

    highest_kPa: Positive = 90.0
    """Highest pressure of the staircase [kPa]."""
    step_kPa: Positive = 10.0
    """Pressure step [kPa]; the last is smaller where the highest pressure is no multiple of it."""
    hold_s: Positive = 10.0
    """How long each pressure is held, so that the bend can be read [s]."""
    repeats: Count = 3
    """Number of readings at each pressure on the virtual rig."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step_kPa > self.highest_kPa:
            raise ValueError(
                f"step_kPa is {self.step_kPa}, expected at most highest_kPa, {self.highest_kPa}"
            )

    @classmethod
    def as_many_steps(cls, highest_kPa: float) -> dict[str, float]:
        """Settings of a staircase to another pressure [kPa], in as many steps as usual."""
        step_kPa = highest_kPa / HIGHEST_COMMAND_KPA * cls.step_kPa
        return {"highest_kPa": highest_kPa, "step_kPa": step_kPa}

    @property
    def pressures_kPa(self) -> np.ndarray:
        """The stairs [kPa], none above the highest, which is the last."""
        count = math.ceil(self.highest_kPa / self.step_kPa - _SAME_STAIR)
        return np.append(self.step_kPa * np.arange(1, count), self.highest_kPa)

    def gait(self, regulator_count: int) -> HeldGait:
        """The staircase."""
        held = np.zeros((len(self.pressures_kPa), regulator_count))
        held[:, 0] = self.pressures_kPa
        return HeldGait.evenly(held, self.hold_s)
