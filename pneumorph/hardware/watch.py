"""Signs in the sensed pressures that a run must stop."""

from __future__ import annotations

from collections import deque

import numpy as np

from pneumorph.hardware.rig import SafetySettings


class PressureWatch:
    """Looks at every sample; `fault` says what is wrong, or nothing.

    Args:
        safety: The limits.
    """

    def __init__(self, safety: SafetySettings) -> None:
        self._safety = safety
        self._history: deque[tuple[float, np.ndarray, np.ndarray]] = deque()

    def fault(self, time_s: float, commanded: np.ndarray, sensed: np.ndarray) -> str | None:
        """Add a sample and return the reason to stop, or None.

        Args:
            time_s: When [s].
            commanded: Pressures commanded before the sample [kPa], (channel,).
            sensed: Sensed pressures [kPa], (channel,); NaN takes no part.
        """
        safety = self._safety
        for channel, pressure in enumerate(sensed, start=1):
            if pressure > safety.highest_sensed_kPa:
                return (
                    f"channel {channel} senses {pressure:.1f} kPa, above the limit of "
                    f"{safety.highest_sensed_kPa:g} kPa"
                )
            if pressure < safety.lowest_sensed_kPa:
                return (
                    f"channel {channel} senses {pressure:.1f} kPa, below "
                    f"{safety.lowest_sensed_kPa:g} kPa: its sensor or wire is broken"
                )
        self._history.append((time_s, np.array(commanded), np.array(sensed)))
        # Keep one sample older than the window: it spans the whole of it.
        while len(self._history) > 1 and time_s - self._history[1][0] >= safety.stuck_s:
            self._history.popleft()
        return self._stuck(time_s)

    def _stuck(self, time_s: float) -> str | None:
        first_time, first_command, _ = self._history[0]
        if time_s - first_time < self._safety.stuck_s:
            return None
        values = np.array([sensed for _, _, sensed in self._history])
        still = np.all(values == values[0], axis=0)  # NaN is never equal
        moved = np.abs(self._history[-1][1] - first_command)
        for channel in np.flatnonzero(still & (moved >= self._safety.stuck_command_change_kPa)):
            return (
                f"channel {channel + 1} has sensed {values[0, channel]:.2f} kPa for "
                f"{time_s - first_time:.2f} s while its command moved by {moved[channel]:.1f} kPa: "
                "its sensor is stuck"
            )
        return None
