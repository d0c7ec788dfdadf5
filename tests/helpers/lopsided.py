"""Robots that turn to a side by a law that is known."""

from __future__ import annotations

import numpy as np

from pneumorph.environment.viscous_crawler import ViscousCrawler


class Lopsided(ViscousCrawler):
    """Turns to the side whose legs are inflated: an odd function of left and right."""

    @property
    def left_position_mm(self) -> np.ndarray:
        return np.zeros(len(self._status))

    @property
    def heading_deg(self) -> np.ndarray:
        if self._pressure_kPa is None:
            return np.zeros(len(self._status))
        inflation = np.take_along_axis(self._pressure_kPa, self._regulator, axis=1)
        return (self._has_leg * inflation * [1.0, 1.0, -1.0, -1.0]).sum(axis=1) / 10.0
