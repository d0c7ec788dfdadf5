"""BK Precision 9129B: a triple-output supply over SCPI that commands three analog regulators.

SCPI as in the manufacturer's programming manual of the 9129B. The instrument is busy for about
0.1 s after each message and may lose what comes meanwhile, so messages keep that distance.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from pneumorph.base.optional_package import optional_package
from pneumorph.hardware.driver import DriverError, ForeignDeviceError, is_clear
from pneumorph.hardware.serial_line import numbers

_CLOSE_V = 0.005
"""Outputs are set in steps of a millivolt; more is another setting [V]."""

_IDENTITY_FIELDS = 4
"""Maker, model, serial number and firmware (IEEE 488.2)."""


class Supply9129B:
    """Three output voltages.

    Args:
        resource: VISA resource name.
        visa_library: PyVISA backend, such as ``@py``.
        command_time_s: Distance between messages [s].
        reply_timeout_s: Longest wait for an answer [s].
        baud_rate: Of a serial line.
    """

    def __init__(
        self,
        resource: str,
        visa_library: str = "@py",
        command_time_s: float = 0.1,
        reply_timeout_s: float = 0.2,
        baud_rate: int = 9600,
    ) -> None:
        self._resource, self._library = resource, visa_library
        self._command_time_s, self._baud_rate = command_time_s, baud_rate
        self._timeout_ms = 1000.0 * reply_timeout_s
        self._instrument: Any = None
        self._free_at = 0.0
        self._visa = optional_package("pyvisa", "a 9129B needs PyVISA", "hardware")
        self._manager: Any = self._visa.ResourceManager(visa_library)

    def open(self, volts: Sequence[float]) -> None:
        """Connect, check the model, take remote control, set the outputs and switch them on.

        Args:
            volts: What the outputs begin with: the regulators' zero, which need not be 0 V [V].

        Raises:
            ForeignDeviceError: Another instrument tells its identity, twice the same.
            DriverError: No answer, or none that makes sense.
        """
        self._connect()
        identity = self._query("*IDN?")
        if "9129B" not in identity:
            told = (
                f"{self._resource} is {identity!r}, expected a BK Precision 9129B; the resource "
                "may be another instrument's"
            )
            whole = is_clear(identity) and len(identity.split(",")) >= _IDENTITY_FIELDS
            if whole and self._query("*IDN?") == identity:
                self.close()
                raise ForeignDeviceError(f"{told}, and nothing was commanded")
            raise DriverError(told)
        for message in ("*CLS", "SYST:REM", _set(volts), "OUTP:STAT:ALL ON"):
            self._write(message)
        self.check()

    def set_volts(self, volts: Sequence[float]) -> None:
        """Set the three outputs [V] and have it confirmed.

        Raises:
            DriverError: The supply refused, answered late, not at all, or senselessly.
        """
        self._write(_set(volts))
        self.check()

    def check(self) -> None:
        """Ask for the supply's last error.

        Raises:
            DriverError: There is one, or the answer is none of the kind ``0,'No Error'``.
        """
        answer = self._query("SYST:ERR?")
        code = answer.split(",")[0].strip()
        try:
            number = int(code)
        except ValueError:
            raise DriverError(
                f"the supply answered {answer!r} to SYST:ERR?, expected an error number; the line "
                "may be disturbed"
            ) from None
        if number != 0:
            raise DriverError(f"the supply reports error {answer}")

    def set_volts_unconfirmed(self, volts: Sequence[float]) -> None:
        """Set the outputs [V] without waiting for an answer; connects first if need be."""
        if self._instrument is None:
            self._connect()
        self._write(_set(volts))

    def confirm(self, volts: Sequence[float]) -> None:
        """Ask what the outputs are set to.

        Raises:
            DriverError: It is something else, or the supply does not answer in time or senselessly.
        """
        answer = self._query("APP:VOLT?")
        found = numbers(answer, len(volts), "APP:VOLT?")
        if any(abs(own - asked) > _CLOSE_V for own, asked in zip(found, volts, strict=True)):
            raise DriverError(
                f"the supply's outputs are set to {answer} V, expected "
                f"{', '.join(f'{volt:.3f}' for volt in volts)}: it has not taken that"
            )

    def close(self) -> None:
        """Let go of the instrument; never raises."""
        if self._instrument is not None:
            # Whatever a dying connection raises: there is nothing left to do about it.
            with suppress(Exception):
                self._instrument.close()
            self._instrument = None

    def _connect(self) -> None:
        self.close()
        try:
            self._instrument = self._manager.open_resource(
                self._resource, read_termination="\n", write_termination="\n"
            )
            self._instrument.timeout = self._timeout_ms
            if self._resource.upper().startswith("ASRL"):
                self._instrument.baud_rate = self._baud_rate
            # Whoever sent it a message before, it may be busy with that.
            self._free_at = max(self._free_at, time.monotonic() + self._command_time_s)
        except (self._visa.errors.Error, OSError, ValueError) as error:
            self._instrument = None
            raise DriverError(f"{self._resource} does not open: {error}") from error

    def _write(self, message: str) -> None:
        self._exchange(message, lambda instrument: instrument.write(message))

    def _query(self, message: str) -> str:
        def exchange(instrument: Any) -> str:
            instrument.write(message)
            return str(instrument.read()).strip()

        answer: str = self._exchange(message, exchange)
        return answer

    def _exchange(self, message: str, action: Any) -> Any:
        if self._instrument is None:
            raise DriverError(f"the supply is not connected, {message!r} was not sent")
        time.sleep(max(0.0, self._free_at - time.monotonic()))
        try:
            return action(self._instrument)
        except Exception as error:  # whatever a VISA backend lets through: the supply is lost
            raise DriverError(f"{message!r} failed: {error}") from error
        finally:
            self._free_at = time.monotonic() + self._command_time_s


def _set(volts: Sequence[float]) -> str:
    return "APP:VOLT " + ",".join(f"{volt:.3f}" for volt in volts)
