"""A rig as a file: which driver, its channels with their limits, and its timing."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Count, NotNegative, Positive
from pneumorph.base.settings import load_settings
from pneumorph.physics.air import Air
from pneumorph.physics.regulators import AirRegulators, air_regulators

MOST_SENSED_KPA, MOST_OVER_LIMIT = 150.0, 1.5
"""A sensed pressure is let be up to the first [kPa], or to the second times the highest hard limit
of the channels where that is more: a limit that no pressure reaches watches nothing."""

DriverKind = Literal["9129b", "serial", "virtual"]


@dataclass(frozen=True)
class Channel(Checked):
    """One regulator with its command voltage and its pressure sensor, both affine.

    The defaults are an analog regulator that takes 0 to 10 V for 0 to 100 kPa, and a sensor that
    gives 1 to 5 V for the same.
    """

    command_volt_per_kPa: float = 0.1
    """Command voltage for one kPa [V/kPa]."""
    command_volt_at_zero: float = 0.0
    """Command voltage for zero pressure [V]."""
    lowest_volt: float = 0.0
    """Hard limit: the driver refuses a command below [V]."""
    highest_volt: float = 10.0
    """Hard limit: the driver refuses a command above [V]."""
    highest_kPa: Positive = 95.0
    """Hard limit: the driver refuses a command above [kPa]."""
    sensor_volt_per_kPa: float = 0.04
    """Sensor voltage for one kPa [V/kPa]."""
    sensor_volt_at_zero: float = 1.0
    """Sensor voltage at zero pressure [V]."""
    has_sensor: bool = True
    """Whether there is a pressure sensor; a reading of NaN is a fault where there is one, and no
    reading is looked at where there is none."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("command_volt_per_kPa", "sensor_volt_per_kPa"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} must not be zero")
        if not self.lowest_volt <= self.command_volt_at_zero <= self.highest_volt:
            raise ValueError(
                f"command_volt_at_zero is {self.command_volt_at_zero} V, expected it within the "
                f"hard limits {self.lowest_volt} to {self.highest_volt} V: venting must be allowed"
            )

    def command_volt(self, pressure_kPa: float) -> float:
        """Command voltage of a pressure [V].

        Raises:
            ValueError: The pressure or its voltage is beyond a hard limit.
        """
        if not 0.0 <= pressure_kPa <= self.highest_kPa:
            raise ValueError(
                f"pressure {pressure_kPa:g} kPa is beyond the channel's hard limits of 0 to "
                f"{self.highest_kPa:g} kPa"
            )
        volt = self.command_volt_at_zero + self.command_volt_per_kPa * pressure_kPa
        if not self.lowest_volt <= volt <= self.highest_volt:
            raise ValueError(
                f"pressure {pressure_kPa:g} kPa needs {volt:g} V, beyond the channel's hard limits "
                f"of {self.lowest_volt:g} to {self.highest_volt:g} V"
            )
        return volt

    def sensed_kPa(self, volt: float) -> float:
        """Pressure that a sensor voltage stands for [kPa]."""
        return (volt - self.sensor_volt_at_zero) / self.sensor_volt_per_kPa


@dataclass(frozen=True)
class SafetySettings(Checked):
    """When a run is stopped and vented."""

    highest_sensed_kPa: Positive = 100.0
    """A run stops if a sensed pressure is above this [kPa]."""
    lowest_sensed_kPa: Annotated[
        float, Bounds(-50.0, below=0.0, why="sensors of vented regulators read about zero")
    ] = -10.0
    """A run stops if a sensed pressure is below this [kPa]: the sensor or its wire is broken."""
    stuck_s: Annotated[
        float, Bounds(above=0.0, most=2.0, why="a stuck sensor hides a leg that fills meanwhile")
    ] = 0.4
    """A sensor is stuck if it shows exactly the same value for this long while its regulator moves
    [s]."""
    stuck_command_change_kPa: Annotated[
        float, Bounds(above=0.0, most=30.0, why="gaits that move by less would never be watched")
    ] = 5.0
    """How far every healthy regulator must have moved in that time, given its commands [kPa];
    smaller movements are not checked."""
    slowest_lag_s: Annotated[
        float,
        Bounds(above=0.0, most=2.0, why="until it has passed a few times no stuck valve is found"),
    ] = 0.25
    """Longest time constant with which a healthy regulator approaches its command, within the rig's
    `rate_kPa_per_s` [s]."""
    slowest_air_share: Annotated[float, Bounds(above=0.0, most=1.0)] = 0.6
    """Where the rig's air has a law: smallest share of its conductances that a healthy regulator
    has."""
    residual_kPa: Annotated[
        float, Bounds(above=0.0, most=20.0, why="a leg that keeps that much is not empty")
    ] = 5.0
    """How far a sensed pressure may be outside the range that a healthy regulator can have
    [kPa]."""
    residual_s: Annotated[
        float, Bounds(0.0, 1.0, why="a leg bursts or a robot falls within that time")
    ] = 0.2
    """A run stops if a sensed pressure is further outside than that for this long [s]."""
    watchdog_s: Annotated[
        float, Bounds(above=0.0, most=2.0, why="a run that hangs keeps its pressure for so long")
    ] = 0.45
    """The guardian vents if it hears nothing from the deploying process for this long [s]. If that
    process dies, it vents at once."""
    vent_attempts: Annotated[
        int, Bounds(1, 10, why="each may wait for an answer, and nobody is told meanwhile")
    ] = 3
    """Largest number of times that zero is sent until the rig accepts it."""


@dataclass(frozen=True)
class RigSettings(Checked):
    """A rig; `deploy --rig FILE` reads it from JSON or TOML."""

    driver: DriverKind = "virtual"
    """`9129b`: analog regulators on a BK Precision 9129B supply, sensors on an ADC. `serial`: a
    controller that takes lines of text on a serial port. `virtual`: a simulated rig."""
    resource: str = ""
    """VISA resource of the supply, such as ASRL/dev/ttyUSB0::INSTR, or the controller's port."""
    visa_library: str = "@py"
    """PyVISA backend; @py is pyvisa-py."""
    adc_port: str = ""
    """Serial port of the ADC with the pressure sensors (9129b only); empty for none."""
    baud_rate: Count = 9600
    """Baud rate of serial lines."""
    channels: tuple[Channel, ...] = (Channel(), Channel(), Channel())
    """The regulators, in the order in which the gait numbers them."""
    update_interval_s: Annotated[
        float, Bounds(above=0.0, most=2.0, why="a gait held for longer is another gait")
    ] = 0.33
    """Time between commands [s]; a 9129B takes twice its `command_time_s` for one and its check."""
    sample_interval_s: Annotated[
        float, Bounds(least=0.001, why="no sensor is read more often, and a log has a row for each")
    ] = 0.1
    """Time from one reading of the sensors, and its log row, to the next [s]; the guardian hears a
    beat before and after each reading."""
    reply_timeout_s: Annotated[
        float, Bounds(above=0.0, most=2.0, why="nothing is watched while an answer is waited for")
    ] = 0.2
    """Longest wait for an answer [s]; a later one counts as an error."""
    command_time_s: Annotated[
        float, Bounds(0.0, 1.0, why="zero waits for it like any other message")
    ] = 0.1
    """How long a 9129B is busy after each message [s]."""
    rate_kPa_per_s: Positive = 150.0
    """Fastest change of a command [kPa/s]. If the rig's air has no law, a healthy regulator moves
    at least this fast."""
    air: Air = field(default_factory=Air)
    """How air fills and vents the legs; without a law here, `deploy` uses that of the physics."""
    chambers_mm3: tuple[NotNegative, ...] = ()
    """Volume of each regulator's chambers without pressure [mm^3]; empty: those of the deployed
    design."""
    safety: SafetySettings = field(default_factory=SafetySettings)
    """When a run is stopped and vented."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.channels:
            raise ValueError("channels is empty, expected one channel for each regulator")
        if self.driver != "virtual" and not self.resource:
            raise ValueError(
                f"resource is empty, expected where the {self.driver} rig is connected, such as "
                "ASRL/dev/ttyUSB0::INSTR or /dev/ttyACM0"
            )
        for name in ("filling_mm3_per_s_kPa", "venting_mm3_per_s_kPa"):
            self.air.of_each(name, len(self.channels))
        if self.chambers_mm3 and len(self.chambers_mm3) != len(self.channels):
            raise ValueError(
                f"chambers_mm3 has {len(self.chambers_mm3)} numbers for {len(self.channels)} "
                "channels, expected one for each"
            )
        highest = max(channel.highest_kPa for channel in self.channels)
        sensed = self.safety.highest_sensed_kPa
        if highest > sensed:
            raise ValueError(
                f"highest_kPa of a channel is {highest:g}, expected at most "
                f"safety.highest_sensed_kPa, {sensed:g} kPa: a command that is allowed would stop "
                "the run once it is reached, or a limit was raised where the other was meant"
            )
        most = max(MOST_SENSED_KPA, MOST_OVER_LIMIT * highest)
        if sensed > most:
            raise ValueError(
                f"safety.highest_sensed_kPa is {sensed:g}, expected at most {most:g} kPa, where "
                f"no channel commands more than {highest:g} kPa: it would watch nothing"
            )
        if self.sample_interval_s >= self.safety.watchdog_s:
            raise ValueError(
                f"sample_interval_s is {self.sample_interval_s}, expected less than the watchdog's "
                f"{self.safety.watchdog_s} s: the guardian hears nothing from one reading of the "
                "sensors to the next"
            )
        self._refuse_slow_answers()
        busy_s = 2.0 * self.command_time_s
        if self.driver == "9129b" and self.update_interval_s < busy_s:
            raise ValueError(
                f"update_interval_s is {self.update_interval_s:g} s, expected at least twice "
                f"command_time_s, {busy_s:g} s: a 9129B is busy that long with a command and the "
                "question whether it took it, and commands in between would never be sent"
            )

    def _refuse_slow_answers(self) -> None:
        """Refuse a call that the guardian would take for silence: between two beats a 9129B takes a
        command and is asked about it, a serial controller takes a line and answers it."""
        calls = {
            "9129b": ("twice command_time_s and reply_timeout_s",
                      2.0 * self.command_time_s + self.reply_timeout_s),
            "serial": ("twice reply_timeout_s", 2.0 * self.reply_timeout_s),
        }  # fmt: skip
        if self.driver not in calls:
            return
        said, longest_s = calls[self.driver]
        if longest_s >= self.safety.watchdog_s:
            raise ValueError(
                f"{said} are {longest_s:g} s, expected less than safety.watchdog_s, "
                f"{self.safety.watchdog_s:g} s: the guardian would take an answer that is late for "
                "a process that is dead"
            )

    def slowest_air(self) -> AirRegulators | None:
        """The slowest regulators that are healthy; None where air has no law.

        Raises:
            ValueError: Nobody has said how large the chambers are.
        """
        if self.air.law == "rate_limit":
            return None
        if not self.chambers_mm3:
            raise ValueError(
                "chambers_mm3 is empty, expected the volume of each regulator's chambers: air "
                f"flows by the law {self.air.law!r}, and how fast depends on them"
            )
        share = self.safety.slowest_air_share
        return air_regulators(self.air.scaled(share, share), self.chambers_mm3)

    def command_volts(self, pressure_kPa: np.ndarray) -> list[float]:
        """Command voltage of each channel [V].

        Raises:
            ValueError: Another number of pressures, or one beyond a hard limit; names the channel.
        """
        if len(pressure_kPa) != len(self.channels):
            raise ValueError(
                f"pressure_kPa has {len(pressure_kPa)} numbers, the rig {len(self.channels)} "
                "channels"
            )
        volts = []
        for number, (channel, pressure) in enumerate(
            zip(self.channels, pressure_kPa, strict=True), start=1
        ):
            try:
                volts.append(channel.command_volt(float(pressure)))
            except ValueError as error:
                raise ValueError(f"channel {number}: {error}") from error
        return volts

    @property
    def has_sensor(self) -> np.ndarray:
        """Which channels have a pressure sensor, (channel,) bool; a 9129B's need an ADC."""
        connected = self.driver != "9129b" or bool(self.adc_port)
        return np.array([connected and channel.has_sensor for channel in self.channels])

    def of_sensors(self, sensed_kPa: np.ndarray) -> np.ndarray:
        """Readings of all channels, (channel,), NaN in place of what a channel without a sensor
        seems to read [kPa]: an input that nothing is connected to has any voltage."""
        return np.where(self.has_sensor, sensed_kPa, np.nan)

    @property
    def zero_volts(self) -> list[float]:
        """Command voltage of each channel for zero pressure [V]."""
        return [channel.command_volt_at_zero for channel in self.channels]


def load_rig(path: Path | str) -> RigSettings:
    """Read a rig file."""
    return load_settings(RigSettings, path)
