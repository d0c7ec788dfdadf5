"""Robots that turn in place by a law that is known."""

from __future__ import annotations

import numpy as np

from pneumorph.environment.viscous_crawler import ViscousCrawler


class Turner(ViscousCrawler):
    """Turns by 300 degrees a second over all borders of the angle, and drifts to the left."""

    steps = 0

    def reset(self, active: np.ndarray | None = None) -> None:
        super().reset(active)
        self.steps = 0

    def advance(self, command_kPa, step_count, active=None) -> None:
        super().advance(command_kPa, step_count, active)
        self.steps += step_count

    @property
    def forward_position_mm(self) -> np.ndarray:
        return np.full(len(self._status), 2.0 * self.steps)

    @property
    def left_position_mm(self) -> np.ndarray:
        return np.full(len(self._status), 3.0 * self.steps)

    @property
    def heading_deg(self) -> np.ndarray:
        return np.full(len(self._status), (3.0 * self.steps + 180.0) % 360.0 - 180.0)
