"""What deployment asks of a rig: six verbs, and a clock."""

from __future__ import annotations

import time
from typing import Protocol

import numpy as np


class DriverError(OSError):
    """The rig cannot be commanded or read: lost connection, late or senseless answer."""


class ForeignDeviceError(DriverError):
    """Another device than the rig's answers. Its line is closed, and it is sent nothing more:
    nothing was commanded, so there is nothing to vent."""


def is_clear(answer: str) -> bool:
    """Whether an answer says something: printable, and not numbers alone, which may be readings."""
    return answer.isascii() and answer.isprintable() and any(map(str.isalpha, answer))


class Clock(Protocol):
    """Tells and passes time; the virtual rig has one of its own."""

    def now_s(self) -> float:
        """Time since some start [s]."""

    def wait_until(self, time_s: float) -> None:
        """Return when the time has come, at once if it has passed."""


class WallClock:
    """The clock on the wall, from now on; where the computer sleeps meanwhile, it goes on."""

    def __init__(self) -> None:
        self._start = _awake_or_asleep_s()

    def now_s(self) -> float:
        """Time since the clock was made [s]."""
        return _awake_or_asleep_s() - self._start

    def wait_until(self, time_s: float) -> None:
        """Sleep until then."""
        time.sleep(max(0.0, time_s - self.now_s()))


def _awake_or_asleep_s() -> float:
    """Time since some start [s] that passes while the computer sleeps: Linux's monotonic clock
    stands still then, and a gait would go on as if nothing had been."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


class RegulatorDriver(Protocol):
    """Pressure regulators and their sensors behind some wire.

    No call may block for longer than the rig's reply timeout.
    """

    def open(self) -> None:
        """Connect, check who answers, and command zero.

        Raises:
            ForeignDeviceError: Another device says clearly who it is.
            DriverError: Nothing answers, or nothing that makes sense.
        """

    def command(self, pressure_kPa: np.ndarray) -> None:
        """Set every regulator [real kPa], (channel,).

        Raises:
            DriverError: The rig did not take the command.
            ValueError: A pressure beyond the channel's hard limits.
        """

    def sense(self) -> np.ndarray:
        """Sensed pressures [real kPa], (channel,); NaN where a channel has no sensor.

        Raises:
            DriverError: No answer, a late one, or one that makes no sense.
        """

    def vent(self) -> None:
        """Command zero to every regulator, whatever else is wrong; connects first if need be.

        Raises:
            DriverError: Zero could not be sent.
        """

    def confirm(self) -> None:
        """Ask the rig for something that only one that took the zero before it answers.

        Raises:
            DriverError: No answer, a late one, or one that makes no sense of a vented rig.
        """

    def close(self) -> None:
        """Let go of the wire; never raises."""
