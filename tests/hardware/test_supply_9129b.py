"""The 9129B's driver against an instrument simulated by pyvisa-sim: its slowness, its errors."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.hardware.driver import DriverError, ForeignDeviceError
from pneumorph.hardware.supply_9129b import Supply9129B

pytest.importorskip("pyvisa_sim")
LIBRARY = f"{Path(__file__).with_name('bk_9129b.yaml')}@sim"
BUSY_S = 0.1
ZERO_VOLTS = (0.0, 0.0, 0.0)


class _BusyInstrument:
    """Lets pyvisa-sim's device lose what reaches it within 0.1 s of the message before."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from pyvisa_sim.devices import Device

        self.times: list[float] = []
        self.lost: list[bytes] = []
        whole = Device.write

        def write(device: Any, data: bytes) -> None:
            # pyvisa-sim passes a message in one piece or byte by byte; its end is the newline.
            pending = bytes(device._input_buffer) + data
            if not pending.endswith(b"\n"):
                whole(device, data)
                return
            now = time.monotonic()
            # Clocks and sleeps are exact to a millisecond.
            if self.times and now - self.times[-1] < BUSY_S - 1e-3:
                self.lost.append(pending)
                device._input_buffer.clear()
                return
            self.times.append(now)
            whole(device, data)

        monkeypatch.setattr(Device, "write", write)


@pytest.fixture
def busy(monkeypatch: pytest.MonkeyPatch) -> _BusyInstrument:
    return _BusyInstrument(monkeypatch)


@pytest.fixture
def supply() -> Iterator[Supply9129B]:
    opened = Supply9129B("ASRL1::INSTR", LIBRARY, command_time_s=BUSY_S)
    opened.open(ZERO_VOLTS)
    yield opened
    opened.close()


def test_commands_arrive_at_a_slow_instrument(busy: _BusyInstrument) -> None:
    """Nothing is lost although the instrument is deaf for 0.1 s after each message."""
    supply = Supply9129B("ASRL1::INSTR", LIBRARY, command_time_s=BUSY_S)
    supply.open(ZERO_VOLTS)
    for volts in ([1.0, 2.0, 3.0], [9.0, 0.5, 0.25], [4.5, 4.5, 4.5]):
        supply.set_volts(volts)
    assert supply._query("APP:VOLT?") == "4.500,4.500,4.500"
    supply.close()
    assert busy.lost == []
    assert np.diff(busy.times).min() >= BUSY_S - 1e-3


def test_a_driver_in_a_hurry_would_lose_commands(busy: _BusyInstrument) -> None:
    """The instrument of the test above does punish haste."""
    hasty = Supply9129B("ASRL1::INSTR", LIBRARY, command_time_s=0.0, reply_timeout_s=0.1)
    with pytest.raises(DriverError):
        hasty.open(ZERO_VOLTS)
    assert busy.lost


def test_an_error_of_the_supply_is_raised(supply: Supply9129B) -> None:
    supply._write("APP:VOLTAGE:NONSENSE")
    with pytest.raises(DriverError, match="reports error 110,'No input command to parse'"):
        supply.check()
    supply.check()  # the queue is empty again


def test_another_instrument_is_refused() -> None:
    other = Supply9129B("ASRL2::INSTR", LIBRARY, command_time_s=0.0)
    with pytest.raises(DriverError, match="is 'Some Other, 1234', expected a BK Precision 9129B"):
        other.open(ZERO_VOLTS)


def test_an_instrument_that_says_clearly_that_it_is_another_is_let_go() -> None:
    other = Supply9129B("ASRL3::INSTR", LIBRARY, command_time_s=0.0)
    with pytest.raises(ForeignDeviceError, match=r"is 'KEITHLEY .* and nothing was commanded"):
        other.open(ZERO_VOLTS)
    with pytest.raises(DriverError, match="is not connected"):
        other.check()


@pytest.mark.parametrize(
    "answers",
    [
        ["B&K Preci\x07,91", "B&K Preci\x07,91"],
        ["1.02,4.61,1.00,0", "1.02,4.61,1.00,0"],
        ["B&K, 9l29B, 1, 1.05", "B&K, 9129B, 1, 1.05"],
    ],
    ids=["garbled", "numbers alone", "another the second time"],
)
def test_an_answer_that_says_nothing_clearly_may_be_the_supply_s(
    answers: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stays connected, to be vented."""
    left = list(answers)
    monkeypatch.setattr(Supply9129B, "_query", lambda *_: left.pop(0))
    supply = Supply9129B("ASRL1::INSTR", LIBRARY, command_time_s=0.0)
    with pytest.raises(DriverError, match="expected a BK Precision 9129B") as raised:
        supply.open(ZERO_VOLTS)
    assert not isinstance(raised.value, ForeignDeviceError)
    supply.set_volts_unconfirmed(ZERO_VOLTS)
    supply.close()


def test_nothing_at_the_resource() -> None:
    pytest.importorskip("pyvisa_py")
    absent = Supply9129B("TCPIP::127.0.0.1::1::SOCKET", "@py", command_time_s=0.0)
    with pytest.raises(DriverError, match=r"\*IDN\?.*refused"):
        absent.open(ZERO_VOLTS)


def test_zero_connects_by_itself() -> None:
    """What the guardian does: nothing is open yet, and zero is all that matters."""
    supply = Supply9129B("ASRL1::INSTR", LIBRARY, command_time_s=0.0)
    supply.set_volts_unconfirmed([0.0, 0.0, 0.0])
    assert supply._query("APP:VOLT?") == "0.000,0.000,0.000"
    supply.close()
