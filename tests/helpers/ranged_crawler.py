"""Robots that know how far their legs have been by a law that is known."""

from __future__ import annotations

import numpy as np

from pneumorph.environment.viscous_crawler import ViscousCrawler


class RangedCrawler(ViscousCrawler):
    """A leg is twice beyond its snapshots while all regulators are at rest, half as far when
    pressed."""

    _ratio = np.zeros(0)

    def reset(self, active: np.ndarray | None = None) -> None:
        super().reset(active)
        self.forget_range(active)

    def advance(self, command_kPa, step_count, active=None) -> None:
        super().advance(command_kPa, step_count, active)
        now = np.where(np.any(command_kPa > 0.0, axis=1), 0.5, 2.0)
        moving = np.ones(len(now), bool) if active is None else active
        self._ratio = np.where(moving, np.maximum(self._ratio, now), self._ratio)

    @property
    def range_ratio(self) -> np.ndarray:
        return self._ratio

    def forget_range(self, active: np.ndarray | None = None) -> None:
        if len(self._ratio) != len(self._status) or active is None:
            self._ratio = np.zeros(len(self._status))
        self._ratio = np.where(True if active is None else active, 0.0, self._ratio)
