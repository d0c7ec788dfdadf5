"""How regulated pressures move towards their commands: at a rate, or as air flows.

Under one command a regulator's valve stands open until the pressure is there, so each regulator has
one curve along which its pressure rises and one along which it falls. A step goes along the curve
and stops at the command: nothing is integrated, no step is too long, and no pressure passes its
command. Numbers in brackets are equations of docs/physics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from pneumorph.physics.air import ATMOSPHERE_KPA, Air, orifice_flow
from pneumorph.physics.pressure import rate_limit

CELL_COUNT = 256
"""Cells of equal pressure between zero and the supply."""


class Regulators(Protocol):
    """What a step asks of the regulators of a robot."""

    def after(
        self, regulated_kPa: np.ndarray, command_kPa: np.ndarray, time_s: float
    ) -> np.ndarray:
        """Pressures after some time of one command [real kPa], (regulator,)."""


@dataclass(frozen=True)
class RateLimited:
    """Regulators that move at a rate, (33)."""

    rate_kPa_per_s: float
    """Most change [kPa/s]."""

    def after(
        self, regulated_kPa: np.ndarray, command_kPa: np.ndarray, time_s: float
    ) -> np.ndarray:
        """Pressures after some time of one command [real kPa], (regulator,)."""
        return rate_limit(regulated_kPa, command_kPa, self.rate_kPa_per_s, time_s)


@dataclass(frozen=True, eq=False)
class AirRegulators:
    """Regulators that fill and vent, (41): in each cell of pressure at rates of its own.

    The time through a cell is that of (40); within it the pressure goes straight.
    """

    cell_kPa: float
    """Width of a cell; the first begins at zero, and nothing rises beyond the last."""
    rising_kPa_per_s: np.ndarray
    """(regulator, cell)"""
    falling_kPa_per_s: np.ndarray
    """(regulator, cell)"""

    def after(
        self, regulated_kPa: np.ndarray, command_kPa: np.ndarray, time_s: float
    ) -> np.ndarray:
        """Pressures after some time of one command [real kPa], (regulator,)."""
        pairs = zip(np.asarray(regulated_kPa), np.asarray(command_kPa), strict=True)
        return np.array(
            [
                self._risen(float(p), float(c), self.rising_kPa_per_s[number], time_s)
                if c > p
                else self._fallen(float(p), float(c), self.falling_kPa_per_s[number], time_s)
                for number, (p, c) in enumerate(pairs)
            ]
        )

    def _risen(self, p: float, command: float, rates: np.ndarray, left_s: float) -> float:
        for cell in range(max(int(p / self.cell_kPa), 0), len(rates)):
            end = min((cell + 1) * self.cell_kPa, command)
            rate = float(rates[cell])
            if end - p > rate * left_s:
                return p + rate * left_s
            left_s -= max(end - p, 0.0) / rate  # rounding may have put p behind the cell's end
            p = max(p, end)
            if p >= command:
                break
        return p

    def _fallen(self, p: float, command: float, rates: np.ndarray, left_s: float) -> float:
        for cell in range(min(int(p / self.cell_kPa), len(rates) - 1), -1, -1):
            end = max(cell * self.cell_kPa, command)
            rate = float(rates[cell])
            if p - end > rate * left_s:
                return p - rate * left_s
            left_s -= max(p - end, 0.0) / rate
            p = min(p, end)
            if p <= command:
                break
        return p


def air_regulators(air: Air, chamber_mm3: Sequence[float] | np.ndarray) -> AirRegulators:
    """Regulators that fill and vent tubes and chambers.

    Args:
        air: Supply, conductances and volumes.
        chamber_mm3: Volume of all chambers of each regulator without pressure [mm^3].

    Raises:
        ValueError: Another number of conductances than of regulators.
    """
    filling = air.of_each("filling_mm3_per_s_kPa", len(chamber_mm3))
    venting = air.of_each("venting_mm3_per_s_kPa", len(chamber_mm3))
    unit = replace(air, filling_mm3_per_s_kPa=(1.0,), venting_mm3_per_s_kPa=(1.0,))
    times = [_cell_times(unit, float(chamber)) for chamber in chamber_mm3]
    cell_kPa = air.supply_kPa / CELL_COUNT
    return AirRegulators(
        cell_kPa,
        np.array([c * cell_kPa / rise for c, (rise, _) in zip(filling, times, strict=True)]),
        np.array([c * cell_kPa / fall for c, (_, fall) in zip(venting, times, strict=True)]),
    )


@lru_cache(maxsize=256)
def _cell_times(air: Air, chamber_mm3: float) -> tuple[np.ndarray, np.ndarray]:
    """Times to rise and to fall through each cell with conductance 1 [s mm^3/(s kPa)], (40).

    A flow ends as the root of what is left of the difference of pressures. With that root for the
    variable the integrand is smooth.
    """
    ends = np.linspace(0.0, air.supply_kPa, CELL_COUNT + 1)
    supply = np.array(air.supply_kPa + ATMOSPHERE_KPA)

    def rising(root: np.ndarray) -> np.ndarray:
        p = air.supply_kPa - root**2
        flow = orifice_flow(supply, p + ATMOSPHERE_KPA, 1.0, air.critical_ratio)
        return 2.0 * root * air.capacity_mm3(p, chamber_mm3) / flow

    def falling(root: np.ndarray) -> np.ndarray:
        p = root**2
        flow = orifice_flow(p + ATMOSPHERE_KPA, np.array(ATMOSPHERE_KPA), 1.0, air.critical_ratio)
        return 2.0 * root * air.capacity_mm3(p, chamber_mm3) / flow

    left = np.sqrt(air.supply_kPa - ends)
    return _integrals(rising, left[1:], left[:-1]), _integrals(
        falling, np.sqrt(ends[:-1]), np.sqrt(ends[1:])
    )


def _integrals(
    function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Integrals over intervals by Gauss's rule of five points, (interval,)."""
    points, weights = np.polynomial.legendre.leggauss(5)
    half = 0.5 * (high - low)
    integrals: np.ndarray = half * (
        function(0.5 * (high + low)[:, None] + half[:, None] * points) @ weights
    )
    return integrals
