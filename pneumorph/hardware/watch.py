"""Signs in the sensed pressures that a run must stop."""

from __future__ import annotations

from collections import deque

import numpy as np

from pneumorph.hardware.healthy_band import HealthyBand
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.time_outside import TimeOutside
from pneumorph.physics.open_loop_gait import SAME_TIME_S

EMPTY_KPA = 1.0
"""A leg is as good as empty at this pressure [kPa]."""

LONGEST_CLOSING_S = 20.0
"""A watch that knows nothing for longer after a command is none [s]."""

LONGEST_GAP = 2.0
"""Samples further apart than so many times the watchdog's time stop the run: what happened in
between, nobody knows."""


class PressureWatch:
    """Looks at every sample; `fault` says what is wrong, or nothing.

    A reading is compared with its limits and with what a healthy regulator can have
    (`HealthyBand`): one that stays outside, or is outside again and again (`TimeOutside`), or that
    does not move where every healthy regulator must have moved, is a fault. One that is no finite
    number is a fault at once, and so is a sample whose time is not later than the last, or much
    later.

    Args:
        rig: Its channels, its rate or air, and its `SafetySettings`.

    Attributes:
        closing_s: Time in which the slowest healthy regulator vents from the highest pressure [s].

    Raises:
        ValueError: As `RigSettings.slowest_air`; or the slowest regulators that count as healthy
            are so slow that nothing would be found.
    """

    def __init__(self, rig: RigSettings) -> None:
        self._safety = rig.safety
        self._has_sensor = rig.has_sensor
        self._band = HealthyBand(rig.rate_kPa_per_s, rig.safety.slowest_lag_s, rig.slowest_air())
        self._time_s: float | None = None
        self.closing_s = self._closing_s()
        self._time_outside = TimeOutside(rig.safety.residual_s, len(rig.channels))
        self._history: deque[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = deque()

    @property
    def highest_kPa(self) -> np.ndarray:
        """Highest pressure of a healthy regulator at the last sample [kPa], (channel,)."""
        return self._band.highest_kPa

    def fault(self, time_s: float, commanded: np.ndarray, sensed: np.ndarray) -> str | None:
        """Add a sample and return the reason to stop, or None.

        Args:
            time_s: When [s].
            commanded: Pressures commanded before the sample [kPa], (channel,).
            sensed: Sensed pressures [kPa], (channel,); NaN is a fault where there is a sensor.
        """
        blind = self._blind(time_s)
        if blind is not None:
            return blind
        self._band.advance(time_s, commanded, sensed)
        return (
            self._senseless(sensed)
            or self._stuck(time_s, sensed)
            or self._outside(time_s, commanded, sensed)
        )

    def late(self, time_s: float) -> str | None:
        """Why nothing more may be commanded at a time [s], or None: too long ago is the last sample
        to know what happened in between."""
        longest_s = LONGEST_GAP * self._safety.watchdog_s
        if self._time_s is None or not time_s - self._time_s > longest_s:
            return None
        return (
            f"no sample was taken for {time_s - self._time_s:.2f} s, expected one within "
            f"{longest_s:g} s: the sensors answer late, or the computer was busy or asleep"
        )

    def _closing_s(self) -> float:
        highest = np.full(len(self._has_sensor), self._safety.highest_sensed_kPa)
        closing_s = self._band.closing_s(highest, EMPTY_KPA, LONGEST_CLOSING_S)
        if closing_s > LONGEST_CLOSING_S:
            raise ValueError(
                f"the slowest regulator that counts as healthy takes more than "
                f"{LONGEST_CLOSING_S:g} s to vent {self._safety.highest_sensed_kPa:g} kPa, "
                "expected less: until then the watch could find no valve that is stuck; likely "
                "cause: rate_kPa_per_s or the air's conductances are too small, chambers_mm3 too "
                "large, or safety.slowest_lag_s or safety.slowest_air_share allow too much"
            )
        return closing_s

    def _blind(self, time_s: float) -> str | None:
        """Find a clock that does not go on, or goes on without samples: all else is told by it."""
        before_s = self._time_s
        if before_s is not None and not time_s > before_s:
            return (
                f"the time of a sample is {time_s:.4f} s after {before_s:.4f} s, expected a later "
                "one: the clock stands still or goes backward, and nothing can be watched by it"
            )
        late = self.late(time_s)
        self._time_s = time_s
        return late

    def _senseless(self, sensed: np.ndarray) -> str | None:
        safety = self._safety
        for channel, pressure in enumerate(sensed):
            if np.isnan(pressure) and not self._has_sensor[channel]:
                continue
            said = f"channel {channel + 1} senses {pressure:.1f} kPa"
            if not np.isfinite(pressure):
                return f"{said}, which is no pressure: its sensor, wire or converter is broken"
            if not pressure <= safety.highest_sensed_kPa:
                return f"{said}, above the limit of {safety.highest_sensed_kPa:g} kPa"
            if not pressure >= safety.lowest_sensed_kPa:
                return (
                    f"{said}, below {safety.lowest_sensed_kPa:g} kPa: its sensor or wire is broken"
                )
        return None

    def _stuck(self, time_s: float, sensed: np.ndarray) -> str | None:
        """Find a reading that stood still while every healthy regulator moved."""
        band, safety = self._band, self._safety
        self._history.append((time_s, np.array(sensed), band.lowest_kPa, band.highest_kPa))
        # Keep one sample older than the window: it spans the whole of it.
        while (
            len(self._history) > 1 and time_s - self._history[1][0] >= safety.stuck_s - SAME_TIME_S
        ):
            self._history.popleft()
        passed_s = time_s - self._history[0][0]
        if passed_s < safety.stuck_s - SAME_TIME_S:
            return None
        _, values, lowest, highest = zip(*self._history, strict=True)
        still = np.all(np.array(values) == values[0], axis=0)  # NaN is never equal
        moved = np.max(lowest, axis=0) - np.min(highest, axis=0)
        for channel in np.flatnonzero(still & (moved >= safety.stuck_command_change_kPa)):
            return (
                f"channel {channel + 1} has sensed {sensed[channel]:.2f} kPa for {passed_s:.2f} s, "
                f"in which its regulator must have moved by {moved[channel]:.1f} kPa: its sensor "
                "is stuck"
            )
        return None

    def _outside(self, time_s: float, commanded: np.ndarray, sensed: np.ndarray) -> str | None:
        """Find a reading that is outside what a healthy regulator can have for too long."""
        band, safety, times = self._band, self._safety, self._time_outside
        side = np.where(sensed > band.highest_kPa + safety.residual_kPa, 1, 0)
        side = np.where(sensed < band.lowest_kPa - safety.residual_kPa, -1, side)
        times.add(time_s, side)
        for channel in np.flatnonzero(times.too_long):
            unbroken = times.unbroken_s[channel] >= safety.residual_s - SAME_TIME_S
            if unbroken:
                how_long = f"for {times.unbroken_s[channel]:.2f} s"
            else:
                how_long = f"again and again, for {times.sum_s[channel]:.2f} s in all"
            above = side[channel] > 0
            if times.crossed[channel] or not unbroken:
                cause = "a wire has a loose contact, or its valve chatters"
            elif above:
                cause = "its valve is stuck open, so that venting may not help: cut the air"
            else:
                cause = "a tube is off or burst, it leaks, or its valve is stuck closed"
            return (
                f"channel {channel + 1} senses {sensed[channel]:.1f} kPa, "
                f"{'above' if above else 'below'} what a healthy regulator has that is "
                f"commanded {commanded[channel]:.1f} kPa, {band.lowest_kPa[channel]:.1f} to "
                f"{band.highest_kPa[channel]:.1f} kPa, by more than {safety.residual_kPa:g} kPa "
                f"{how_long}: {cause}; or its sensor is off, or it is slower than "
                "safety.slowest_lag_s or safety.slowest_air_share allow"
            )
        return None
