"""How long readings have been outside a band: without a break, and in all with slow forgetting.

A single disturbed reading is no fault, so a reading must be outside for some time. A clock that
starts anew with each reading inside never sees a wire with a loose contact, whose every second
reading is right; a sum that forgets slowly does.
"""

from __future__ import annotations

import numpy as np

from pneumorph.physics.open_loop_gait import SAME_TIME_S

SUM_FACTOR = 2.5
"""Time outside in all that is too long, over that which is too long without a break."""

FORGETTING_FACTOR = 25.0
"""Time constant with which the sum is forgotten, over the latter too: of readings that are outside
one time in n the sum comes to 25 / n of it, so that n up to 10 is found in the end."""


class TimeOutside:
    """Times outside of each channel, sample by sample.

    Args:
        longest_s: What is too long without a break [s].
        channel_count: Channels.

    Attributes:
        unbroken_s: Since the first of the readings outside that are the last ones, on whichever
            side [s], (channel,).
        sum_s: Time outside in all, each sample for the time since the one before but no more than
            `longest_s`, forgotten exponentially [s], (channel,).
        crossed: Whether those last readings were on both sides, (channel,) bool.
        too_long: Which channels are outside now and have been for too long, (channel,) bool.
    """

    def __init__(self, longest_s: float, channel_count: int) -> None:
        self._longest_s = longest_s
        self._time_s: float | None = None
        self._began_s = np.zeros(channel_count)
        self._side = np.zeros(channel_count, dtype=int)
        self.unbroken_s = np.zeros(channel_count)
        self.sum_s = np.zeros(channel_count)
        self.crossed = np.zeros(channel_count, dtype=bool)
        self.too_long = np.zeros(channel_count, dtype=bool)

    @property
    def longest_sum_s(self) -> float:
        """What is too long in all [s]."""
        return SUM_FACTOR * self._longest_s

    def add(self, time_s: float, side: np.ndarray) -> None:
        """Add a sample.

        Args:
            time_s: When [s].
            side: 1 for channels above the band, -1 below, 0 inside, (channel,).
        """
        outside = side != 0
        still = outside & (self._side != 0)
        passed_s = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        self._began_s = np.where(still, self._began_s, time_s)
        self.crossed = still & (self.crossed | (side != self._side))
        self._side = np.array(side)
        self.unbroken_s = time_s - self._began_s
        forgetting_s = max(FORGETTING_FACTOR * self._longest_s, SAME_TIME_S)
        counted_s = min(passed_s, self._longest_s)
        self.sum_s = self.sum_s * np.exp(-passed_s / forgetting_s) + counted_s * outside
        self.too_long = outside & (
            (self.unbroken_s >= self._longest_s - SAME_TIME_S)
            | (self.sum_s >= self.longest_sum_s - SAME_TIME_S)
        )
