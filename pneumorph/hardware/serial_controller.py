"""A generic pressure controller on a serial port, such as a microcontroller with three valves.

A line is sent, a line comes back:

    ?                     ->  pneumorph 3                   greeting with the number of channels
    P 12.30,0.00,45.00    ->  12.10,0.00,44.20              command [kPa]; sensed [kPa]
    S                     ->  12.10,0.00,44.20              sensed [kPa]
    Z                                                       vent everything, no answer needed

Of a channel without a sensor (has_sensor = false) any number is answered; it is not looked at.
A controller's own firmware should vent when it has heard nothing for half a second.
"""

from __future__ import annotations

import numpy as np

from pneumorph.hardware.driver import DriverError, ForeignDeviceError, is_clear
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.serial_line import SerialLine, numbers

NAME = "pneumorph"
"""How a controller's greeting begins."""


class SerialController:
    """Driver of a serial controller; see `RegulatorDriver`.

    Args:
        rig: The rig.
    """

    def __init__(self, rig: RigSettings) -> None:
        self._rig = rig
        self._count = len(rig.channels)
        self._line = SerialLine(rig.resource, rig.baud_rate, rig.reply_timeout_s)

    def open(self) -> None:
        """Open the port, check who answers, and vent.

        Raises:
            ForeignDeviceError: Another device greets, twice the same.
            DriverError: No answer, or none that makes sense.
        """
        self._line.open()
        greeting, expected = self._line.greet("?"), f"{NAME} {self._count}"
        if greeting != expected:
            told = f"{self._rig.resource} greets with {greeting!r}, expected {expected!r}"
            foreign = is_clear(greeting) and not greeting.startswith(NAME)
            if foreign and self._line.ask("?") == greeting:
                self._line.close()
                raise ForeignDeviceError(
                    f"{told}; the port may be another device's, and nothing was commanded"
                )
            raise DriverError(told)
        self.vent()

    def command(self, pressure_kPa: np.ndarray) -> None:
        """Set every regulator [real kPa]."""
        self._rig.command_volts(pressure_kPa)  # the hard limits of the channels hold here too
        message = "P " + ",".join(f"{pressure:.2f}" for pressure in pressure_kPa)
        numbers(self._line.ask(message), self._count, message)

    def sense(self) -> np.ndarray:
        """Sensed pressures [real kPa], (channel,); NaN where a channel has no sensor."""
        return self._rig.of_sensors(np.array(numbers(self._line.ask("S"), self._count, "S")))

    def vent(self) -> None:
        """Command zero pressure."""
        if not self._line.is_open:
            self._line.open()
        self._line.send("Z")

    def confirm(self) -> None:
        """Ask for the sensed pressures: the controller takes line after line."""
        self.sense()

    def close(self) -> None:
        """Close the port."""
        self._line.close()
