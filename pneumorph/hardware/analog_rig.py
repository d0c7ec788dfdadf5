"""The paper's rig: analog regulators on a 9129B supply, pressure sensors on an ADC.

The ADC is a microcontroller that answers the line ``?`` with the sensors' voltages, such as
``1.02,4.61,1.00``. Without one, sensed pressures are NaN and only the supply is watched.
"""

from __future__ import annotations

import numpy as np

from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.serial_line import SerialLine, numbers
from pneumorph.hardware.supply_9129b import Supply9129B

SUPPLY_OUTPUTS = 3


class AnalogRig:
    """Driver of the paper's rig; see `RegulatorDriver`.

    Args:
        rig: The rig; it must have three channels, one for each output of the supply.

    Raises:
        ValueError: Another number of channels.
        ModuleNotFoundError: PyVISA or pyserial is not installed.
    """

    def __init__(self, rig: RigSettings) -> None:
        if len(rig.channels) != SUPPLY_OUTPUTS:
            raise ValueError(
                f"the rig has {len(rig.channels)} channels, expected {SUPPLY_OUTPUTS}: a 9129B has "
                "that many outputs"
            )
        self._rig = rig
        self._supply = Supply9129B(
            rig.resource, rig.visa_library, rig.command_time_s, rig.reply_timeout_s, rig.baud_rate
        )
        self._adc = (
            SerialLine(rig.adc_port, rig.baud_rate, rig.reply_timeout_s) if rig.adc_port else None
        )

    def open(self) -> None:
        """Connect supply and ADC; the regulators begin at zero pressure."""
        self._supply.open(self._rig.zero_volts)
        if self._adc is not None:
            self._adc.open()
            self._adc.greet("?")
            self.sense()

    def command(self, pressure_kPa: np.ndarray) -> None:
        """Set the three regulators [real kPa]."""
        self._supply.set_volts(self._rig.command_volts(pressure_kPa))

    def sense(self) -> np.ndarray:
        """Sensed pressures [real kPa], (channel,), NaN where a channel has no sensor; connects the
        ADC first if need be."""
        if self._adc is None:
            return np.full(SUPPLY_OUTPUTS, np.nan)
        if not self._adc.is_open:
            self._adc.open()
        volts = numbers(self._adc.ask("?"), SUPPLY_OUTPUTS, "?")
        sensed = [
            channel.sensed_kPa(volt)
            for channel, volt in zip(self._rig.channels, volts, strict=True)
        ]
        return self._rig.of_sensors(np.array(sensed))

    def vent(self) -> None:
        """Command zero pressure, without waiting for an answer."""
        self._supply.set_volts_unconfirmed(self._rig.zero_volts)

    def confirm(self) -> None:
        """Ask the supply what its outputs are set to."""
        self._supply.confirm(self._rig.zero_volts)

    def close(self) -> None:
        """Let go of supply and ADC."""
        self._supply.close()
        if self._adc is not None:
            self._adc.close()
