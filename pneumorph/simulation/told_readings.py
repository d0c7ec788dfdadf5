"""Readings of robots that a simulator has from another one."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np


class ToldReadings(ABC):
    """What is read of robots after each action, each told by name."""

    @abstractmethod
    def _told(self, name: str) -> np.ndarray:
        """The reading of a name, (robot,)."""

    @property
    def forward_position_mm(self) -> np.ndarray:
        """How far forward each robot's tracked point is [mm], (robot,)."""
        return self._told("forward_position_mm")

    @property
    def left_position_mm(self) -> np.ndarray:
        """As `BatchedSimulator.left_position_mm` has it, (robot,)."""
        return self._told("left_position_mm")

    @property
    def heading_deg(self) -> np.ndarray:
        """As `BatchedSimulator.heading_deg` has it, (robot,)."""
        return self._told("heading_deg")

    @property
    def status(self) -> np.ndarray:
        """Status of each robot, (robot,) uint8."""
        return self._told("status")

    @property
    def range_ratio(self) -> np.ndarray:
        """As `BatchedSimulator.range_ratio` has it, (robot,)."""
        return self._told("range_ratio")

    @property
    def hub_load_share(self) -> np.ndarray:
        """As `BatchedSimulator.hub_load_share` has it, (robot,)."""
        return self._told("hub_load_share")

    @property
    def tilt_deg(self) -> np.ndarray:
        """As `BatchedSimulator.tilt_deg` has it, (robot,)."""
        return self._told("tilt_deg")


TOLD = tuple(name for name, value in vars(ToldReadings).items() if isinstance(value, property))
"""Names of the readings."""
