"""The serial controller's driver against a controller at the other end of a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import select
import termios
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.hardware.analog_rig import AnalogRig
from pneumorph.hardware.driver import DriverError, ForeignDeviceError
from pneumorph.hardware.rig import Channel, RigSettings
from pneumorph.hardware.serial_controller import SerialController
from pneumorph.hardware.serial_line import SerialLine
from pneumorph.hardware.watch import PressureWatch

pytest.importorskip("serial")


class _Controller:
    """Firmware: follows commands at once and senses what it was told."""

    def __init__(self, greeting: str = "pneumorph 3", deaf_s: float = 0.0) -> None:
        self._hears_from = time.monotonic() + deaf_s
        self._end, self._other = pty.openpty()
        self.port = os.ttyname(self._other)
        self.received: list[str] = []
        self.greeting = greeting
        self.pressure = "0.00,0.00,0.00"
        self.fault = ""
        self.vented = threading.Event()
        self._pulled = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Pull the cable: the port's other end is gone when this returns."""
        self._pulled.set()
        self._thread.join()

    def _serve(self) -> None:
        received = b""
        while not self._pulled.is_set():
            if not select.select([self._end], [], [], 0.02)[0]:
                continue
            received += os.read(self._end, 1024)
            while b"\n" in received:
                line, received = received.split(b"\n", 1)
                self._obey(line.decode())
        os.close(self._end)
        os.close(self._other)

    def _obey(self, line: str) -> None:
        if time.monotonic() < self._hears_from:
            return
        self.received.append(line)
        if line.startswith("P "):
            self.pressure = line[2:]
        if line == "Z":
            self.pressure = "0.00,0.00,0.00"
            self.vented.set()
            return
        if self.fault == "silent":
            return
        answer = self.greeting if line == "?" else self.pressure
        os.write(self._end, (("1.0,oops" if self.fault == "garbage" else answer) + "\n").encode())


@pytest.fixture
def controller() -> _Controller:
    return _Controller()


def _driver(controller: _Controller) -> SerialController:
    return SerialController(RigSettings(driver="serial", resource=controller.port))


def test_commands_and_readings(controller: _Controller) -> None:
    driver = _driver(controller)
    driver.open()
    assert controller.vented.wait(1.0)
    driver.command(np.array([12.5, 0.0, 45.0]))
    assert controller.pressure == "12.50,0.00,45.00"
    np.testing.assert_array_equal(driver.sense(), [12.5, 0.0, 45.0])
    controller.vented.clear()
    driver.vent()
    assert controller.vented.wait(1.0)
    driver.close()


ONE_IS_BLIND = (Channel(), Channel(has_sensor=False), Channel())


def test_what_a_channel_without_a_sensor_answers_is_not_looked_at(controller: _Controller) -> None:
    """Nothing is connected to its input, which has any voltage."""
    rig = RigSettings(driver="serial", resource=controller.port, channels=ONE_IS_BLIND)
    driver = SerialController(rig)
    driver.open()
    commanded = np.array([12.5, 30.0, 45.0])
    driver.command(commanded)
    assert controller.pressure == "12.50,30.00,45.00"
    watch = PressureWatch(rig)
    for number, absurd in enumerate(("9999.00", "-273.00", "inf", "nan")):
        controller.pressure = f"12.5{number},{absurd},45.0{number}"
        sensed = driver.sense()
        np.testing.assert_array_equal(sensed, [12.5 + 0.01 * number, np.nan, 45 + 0.01 * number])
        assert watch.fault(0.1 * number, commanded, sensed) is None
    driver.confirm()
    # The same number of a channel with a sensor is a fault.
    controller.pressure = "12.50,0.00,9999.00"
    assert "channel 3 senses 9999.0 kPa" in (watch.fault(0.4, commanded, driver.sense()) or "")
    driver.close()


def test_a_voltage_without_a_sensor_is_no_pressure(controller: _Controller) -> None:
    """The ADC of the paper's rig answers "?" with three voltages, of 10, some and 45 kPa."""
    pytest.importorskip("pyvisa_py")
    controller.greeting = "1.40,9.99,2.80"
    rig = RigSettings(
        driver="9129b", resource="TCPIP::x", adc_port=controller.port, channels=ONE_IS_BLIND
    )
    driver = AnalogRig(rig)
    np.testing.assert_allclose(driver.sense(), [10.0, np.nan, 45.0], rtol=1e-12)
    driver.close()
    assert np.isnan(AnalogRig(replace(rig, adc_port="")).sense()).all()


def test_a_board_that_its_port_s_opening_resets_is_waited_for() -> None:
    controller = _Controller(deaf_s=0.7)
    driver = _driver(controller)
    driver.open()
    assert controller.vented.wait(1.0)
    driver.close()


def test_who_opens_the_port_next_resets_no_board(controller: _Controller) -> None:
    """Its control lines stay up when it is closed, or when the process dies."""
    line = SerialLine(controller.port, 9600, 0.2)
    line.open()
    assert not termios.tcgetattr(line._line.fileno())[2] & termios.HUPCL
    line.close()


def test_a_controller_that_hangs_confirms_nothing(controller: _Controller) -> None:
    driver = _driver(controller)
    driver.open()
    driver.vent()
    driver.confirm()
    controller.fault = "silent"
    driver.vent()
    with pytest.raises(DriverError, match="did not answer 'S'"):
        driver.confirm()
    driver.close()


def test_a_closed_port_is_given_back(controller: _Controller) -> None:
    """Nothing more goes out on it, and closing it again is no mistake."""
    line = SerialLine(controller.port, 9600, 0.2)
    line.open()
    port = line._line
    line.close()
    assert not port.is_open
    with pytest.raises(DriverError, match="is not open, 'V' was not sent"):
        line.send("V")
    line.close()


def test_a_closed_port_is_opened_to_vent(controller: _Controller) -> None:
    driver = _driver(controller)
    driver.open()
    driver.close()
    controller.vented.clear()
    driver.vent()
    assert controller.vented.wait(1.0)
    driver.close()


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("silent", "did not answer 'S' within 0.2 s"),
        ("garbage", "the answer to 'S' is '1.0,oops', expected 3 numbers"),
    ],
)
def test_bad_answers_are_errors_and_venting_still_works(
    fault: str, message: str, controller: _Controller
) -> None:
    driver = _driver(controller)
    driver.open()
    controller.fault = fault
    with pytest.raises(DriverError, match=message):
        driver.sense()
    controller.vented.clear()
    driver.vent()
    assert controller.vented.wait(1.0)


def test_hard_limits_are_refused_by_the_driver(controller: _Controller) -> None:
    driver = _driver(controller)
    driver.open()
    with pytest.raises(ValueError, match="channel 3: pressure 96 kPa is beyond the channel's hard"):
        driver.command(np.array([0.0, 0.0, 96.0]))
    driver.sense()  # answered after whatever was sent before
    assert not any(line.startswith("P") for line in controller.received)
    driver.close()


@pytest.mark.parametrize("ask", ["sense", "command", "vent"])
def test_a_pulled_cable_is_a_lost_connection(ask: str, controller: _Controller) -> None:
    """Whatever pyserial raises then: termios.error is no OSError."""
    driver = _driver(controller)
    driver.open()
    controller.unplug()
    arguments = [np.zeros(3)] if ask == "command" else []
    with pytest.raises(DriverError, match=r"was not sent|is lost|did not answer"):
        getattr(driver, ask)(*arguments)
    driver.close()


def test_a_stranger_is_refused() -> None:
    driver = _driver(_Controller("Marlin 2.1"))
    with pytest.raises(DriverError, match=r"greets with 'Marlin 2\.1', expected 'pneumorph 3'"):
        driver.open()


def test_a_stranger_that_says_who_it_is_is_sent_nothing_more() -> None:
    stranger = _Controller("Marlin 2.1")
    driver = _driver(stranger)
    with pytest.raises(ForeignDeviceError, match="another device's, and nothing was commanded"):
        driver.open()
    with pytest.raises(DriverError, match="is not open"):
        driver.sense()
    assert stranger.received == ["?", "?"]


@pytest.mark.parametrize("greeting", ["pneumorph 2", "0.00,0.00,0.00", "pne\x07morph 3"])
def test_an_answer_that_may_be_a_controller_s_keeps_the_line(greeting: str) -> None:
    """It is open, to be vented."""
    controller = _Controller(greeting)
    driver = _driver(controller)
    with pytest.raises(DriverError, match="expected 'pneumorph 3'") as raised:
        driver.open()
    assert not isinstance(raised.value, ForeignDeviceError)
    driver.vent()
    assert controller.vented.wait(1.0)
    driver.close()


def test_no_such_port() -> None:
    driver = SerialController(RigSettings(driver="serial", resource="/dev/none"))
    with pytest.raises(DriverError, match="serial port /dev/none does not open"):
        driver.open()
