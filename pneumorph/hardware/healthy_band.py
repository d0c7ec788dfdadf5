"""The pressures that healthy regulators can have, given what they were commanded.

How fast a regulator is, nobody knows exactly; that it is no slower than a limit, its owner knows.
A first-order lag within a rate, dp/dt = clip((c - p) / lag, -rate, rate), depends monotonically on
the command c and on where it starts, so that every regulator with a lag from zero to the slowest
lies between two curves: one that jumps to the command when the command leads out of the band, and
one that follows it as slowly as is allowed when it leads back in. Where air flows through valves
the rate is what the slowest healthy valve lets through at that pressure; all else is the same.
"""

from __future__ import annotations

import math

import numpy as np

from pneumorph.physics.regulators import AirRegulators

LONGEST_PART_S = 0.01
"""Times between samples are gone through in parts of at most this [s]: in each the slower of lag
and air decides, as it does from instant to instant."""

CLOSING_STEP_S = 0.05
"""And the time to vent is known to this [s]."""


class HealthyBand:
    """Lowest and highest pressure of each healthy regulator, advanced from sample to sample.

    Args:
        rate_kPa_per_s: A healthy regulator moves at least this fast while it is far away [kPa/s].
        slowest_lag_s: Longest time constant of a healthy regulator [s].
        air: The slowest regulators that fill and vent as air flows; None where the rate tells.

    Attributes:
        lowest_kPa: Lowest pressure at the last sample [kPa], (channel,).
        highest_kPa: Highest pressure then [kPa], (channel,).
    """

    def __init__(
        self, rate_kPa_per_s: float, slowest_lag_s: float, air: AirRegulators | None = None
    ) -> None:
        self._rate_kPa_per_s, self._lag_s, self._air = rate_kPa_per_s, slowest_lag_s, air
        self._time_s: float | None = None
        self._command_kPa: np.ndarray = np.zeros(0)
        self.lowest_kPa: np.ndarray = np.zeros(0)
        self.highest_kPa: np.ndarray = np.zeros(0)

    def advance(self, time_s: float, command_kPa: np.ndarray, sensed_kPa: np.ndarray) -> None:
        """Go on to the next sample.

        Args:
            time_s: When it was taken [s].
            command_kPa: What holds now, given at some time since the last sample [kPa], (channel,).
            sensed_kPa: What was sensed [kPa], (channel,); the first sample alone is looked at, for
                a regulator may be venting still when it begins. NaN stands for zero.
        """
        command = np.array(command_kPa, dtype=float)
        if self._time_s is None:
            self.lowest_kPa = np.zeros_like(command)
            self.highest_kPa = np.fmax(np.fmax(sensed_kPa, command), 0.0)
        else:
            passed_s = time_s - self._time_s
            # The command changed somewhere in between: the band holds for every moment.
            above = np.maximum(self._command_kPa, command)
            below = np.minimum(self._command_kPa, command)
            if self._air is None:
                self.highest_kPa = above + self._remaining(self.highest_kPa - above, passed_s)
                self.lowest_kPa = below - self._remaining(below - self.lowest_kPa, passed_s)
            else:
                falling, rising = (
                    np.maximum(self.highest_kPa, above),
                    np.minimum(self.lowest_kPa, below),
                )
                self.highest_kPa = self._flowed(self._air, falling, above, passed_s)
                self.lowest_kPa = self._flowed(self._air, rising, below, passed_s)
        self._time_s, self._command_kPa = time_s, command

    def closing_s(self, start_kPa: np.ndarray, end_kPa: float, limit_s: float) -> float:
        """How long the slowest regulators take to vent [s]; infinite beyond the limit.

        Args:
            start_kPa: Where they begin [kPa], (channel,).
            end_kPa: They are as good as empty here [kPa].
            limit_s: It is not followed for longer [s].
        """
        band = HealthyBand(self._rate_kPa_per_s, self._lag_s, self._air)
        zero = np.zeros_like(start_kPa)
        band.advance(0.0, zero, start_kPa)
        for number in range(1, math.ceil(limit_s / CLOSING_STEP_S) + 1):
            band.advance(number * CLOSING_STEP_S, zero, zero)
            if band.highest_kPa.max() <= end_kPa:
                return number * CLOSING_STEP_S
        return math.inf

    def _flowed(
        self, air: AirRegulators, pressure: np.ndarray, command: np.ndarray, passed_s: float
    ) -> np.ndarray:
        """Where the slowest regulator comes to: no nearer than its lag and its air let it."""
        count = math.ceil(passed_s / LONGEST_PART_S)
        for _ in range(count):
            part_s = passed_s / count
            lagging = command + (pressure - command) * math.exp(-part_s / self._lag_s)
            pressure = air.after(pressure, lagging, part_s)
        return pressure

    def _remaining(self, distance_kPa: np.ndarray, passed_s: float) -> np.ndarray:
        """Distance to the command that the slowest regulator still has; none where it had none.

        It goes at the rate until the lag makes it slower, and then exponentially.
        """
        rate, lag = self._rate_kPa_per_s, self._lag_s
        distance = np.maximum(distance_kPa, 0.0)
        ramp_s = np.maximum(distance / rate - lag, 0.0)
        decayed = np.minimum(distance, rate * lag) * np.exp(
            -np.maximum(passed_s - ramp_s, 0.0) / lag
        )
        remaining: np.ndarray = np.where(passed_s < ramp_s, distance - rate * passed_s, decayed)
        return remaining
