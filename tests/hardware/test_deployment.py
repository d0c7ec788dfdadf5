"""However a run ends, zero is commanded; after a fault it is proven on a new connection."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.deployment import DeploymentReport, deploy
from pneumorph.hardware.deployment_log import COMMAND, DeploymentLog, LogError, read_log
from pneumorph.hardware.driver import DriverError, ForeignDeviceError
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import SAME_LOGGED_S, count_skipped, places, plan_schedule
from pneumorph.hardware.venting import sense_until_fallen
from pneumorph.physics.air import Air

RIG = RigSettings()
GAIT = ExpertGait(period_s=2.0, duration_s=2.0)


class _Clock:
    """Time that passes by being waited for."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def wait_until(self, time_s: float) -> None:
        self.time_s = max(self.time_s, time_s)


class _Wire:
    """A driver that notes what it is told; `fail` is called with what is asked of it."""

    def __init__(self, fail: Callable[[_Wire, str], None] = lambda wire, verb: None) -> None:
        self._fail = fail
        self.told: list[str] = []
        self.connections = 0
        self._rng = np.random.default_rng(0)
        self._pressure = np.zeros(3)

    def _do(self, verb: str) -> None:
        self.told.append(verb)
        self._fail(self, verb)

    def open(self) -> None:
        self.connections += 1
        self._do("open")

    def command(self, pressure_kPa: np.ndarray) -> None:
        self._do("command")
        self._pressure = pressure_kPa

    def sense(self) -> np.ndarray:
        self._do("sense")
        return self._pressure + 0.1 * self._rng.standard_normal(3)

    def vent(self) -> None:
        if self.told[-1] == "close":
            self.connections += 1
        self._do("vent")
        self._pressure = np.zeros(3)

    def confirm(self) -> None:
        self._do("confirm")

    def close(self) -> None:
        self.told.append("close")

    @property
    def obeyed(self) -> list[str]:
        """What it was told, but for the questions."""
        return [verb for verb in self.told if verb not in ("sense", "confirm")]


def _deployed(driver: _Wire, log: Path) -> DeploymentReport:
    with DeploymentLog(log, 3) as written:
        return deploy(plan_schedule(GAIT, RIG), driver, RIG, written, _Clock())


def _lost(wire: _Wire, verb: str) -> None:
    if verb == "command" and wire.told.count("command") == 3:
        raise DriverError("the wire is cut")


def test_a_good_end_vents_once(tmp_path: Path) -> None:
    wire = _Wire()
    report = _deployed(wire, tmp_path / "log.csv")
    assert (report.completed, report.vented) == (True, True)
    assert wire.obeyed[-2:] == ["vent", "close"]
    assert wire.told[-2:] == ["sense", "close"]
    assert wire.told.count("vent") == 1


def test_another_device_is_sent_nothing(tmp_path: Path) -> None:
    def foreign(wire: _Wire, verb: str) -> None:
        if verb == "open":
            raise ForeignDeviceError("it is a Keithley, and nothing was commanded")

    wire = _Wire(foreign)
    with pytest.raises(ForeignDeviceError, match="it is a Keithley"):
        _deployed(wire, tmp_path / "log.csv")
    assert wire.told == ["open", "close"]
    stopped = read_log(tmp_path / "log.csv").stopped
    assert stopped == (0.0, "it is a Keithley, and nothing was commanded")


def test_commands_that_the_rig_was_too_slow_for_are_counted(tmp_path: Path) -> None:
    """It takes 0.7 s for each, and one is due every 0.33 s."""
    clock = _Clock()

    def slow(wire: _Wire, verb: str) -> None:
        if verb == "command":
            clock.time_s += 0.7

    schedule, wire = plan_schedule(GAIT, RIG), _Wire(slow)
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(schedule, wire, RIG, log, clock)
    assert report.completed
    assert report.skipped_count == len(schedule.time_s) - wire.told.count("command") > 2
    events = read_log(tmp_path / "log.csv").events
    sent_s = np.array([time_s for time_s, event in events if event == COMMAND])
    logged = places(schedule.time_s, sent_s, SAME_LOGGED_S)
    assert count_skipped(logged) == report.skipped_count
    assert _deployed(_Wire(), tmp_path / "usual.csv").skipped_count == 0


def test_the_guardian_hears_of_a_run_that_waits_for_its_sensors(tmp_path: Path) -> None:
    """A reading takes as long as an answer may, and the next sample is as far as it may be: both
    together are longer than the watchdog waits, also while the legs empty."""
    clock, beats_s = _Clock(), list[float]()
    rig = replace(RIG, sample_interval_s=0.4, reply_timeout_s=0.2)
    held = HeldGait.evenly(np.array([[40.0, 0.0, 0.0]]), 3.0)

    class Beats:
        def beat(self) -> None:
            beats_s.append(clock.time_s)

    def slow(wire: _Wire, verb: str) -> None:
        if verb == "sense":
            clock.time_s += rig.reply_timeout_s

    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(held, rig), _Wire(slow), rig, log, clock, Beats())
    assert report.completed
    assert clock.time_s - beats_s[-1] < rig.safety.watchdog_s
    assert np.diff(beats_s).max() < rig.safety.watchdog_s


class _SleptClock(_Clock):
    """Goes on while the computer sleeps for a second, in the middle of a wait."""

    def __init__(self, wire: _Wire) -> None:
        super().__init__()
        self._wire = wire
        self.told_before: int | None = None

    def wait_until(self, time_s: float) -> None:
        super().wait_until(time_s)
        if time_s > 0.5 and self.told_before is None:
            self.time_s += 1.0
            self.told_before = len(self._wire.told)


def test_after_a_sleep_nothing_is_commanded_but_zero(tmp_path: Path) -> None:
    """The gait has gone on by a second, and nobody has looked at the sensors meanwhile."""
    wire = _Wire()
    clock = _SleptClock(wire)
    with DeploymentLog(tmp_path / "log.csv", 3) as written:
        report = deploy(plan_schedule(GAIT, RIG), wire, RIG, written, clock)
    assert not report.completed
    assert report.vented
    assert "no sample was taken for 1." in report.reason
    assert "busy or asleep" in report.reason
    assert clock.told_before is not None
    assert wire.told[clock.told_before] == "vent"
    assert "command" not in wire.told[clock.told_before :]


def test_after_a_fault_zero_is_proven_on_a_new_connection(tmp_path: Path) -> None:
    """The zero that the old connection took may have gone into a dead wire."""
    wire = _Wire(_lost)
    report = _deployed(wire, tmp_path / "log.csv")
    assert report.reason == "the wire is cut"
    assert wire.obeyed[-4:] == ["vent", "close", "vent", "close"]
    assert wire.connections == 2
    assert report.vented
    assert read_log(tmp_path / "log.csv").events[-1][1] == "vented"


@pytest.mark.parametrize("kind", [DriverError, RuntimeError])
def test_a_dead_wire_that_takes_everything_is_found_out(
    kind: type[Exception], tmp_path: Path
) -> None:
    """The old connection swallows zero without an error; the new one finds nobody, nor sensors."""

    def gone(wire: _Wire, verb: str) -> None:
        _lost(wire, verb)
        if verb in ("vent", "sense") and wire.connections == 2:
            raise kind("nobody answers")

    report = _deployed(_Wire(gone), tmp_path / "log.csv")
    assert not report.vented
    events = [text for _, text in read_log(tmp_path / "log.csv").events]
    assert events[-2:] == ["vent failed: nobody answers", "NOT VENTED: cut the supply by hand"]


def _hung(wire: _Wire, verb: str) -> None:
    """Firmware that hangs in mid-gait: the port takes every line, and nothing answers."""
    if verb in ("command", "sense", "confirm") and wire.told.count("command") >= 3:
        raise DriverError("no answer")


def test_a_zero_that_nothing_answers_is_not_taken(tmp_path: Path) -> None:
    wire = _Wire(_hung)
    report = _deployed(wire, tmp_path / "log.csv")
    assert wire.obeyed[-4:] == ["vent", "close", "vent", "close"]
    assert not report.vented
    assert report.ending == "NOT VENTED: cut the supply by hand"
    events = [text for _, text in read_log(tmp_path / "log.csv").events]
    assert events[-2:] == ["vent failed: no answer", "NOT VENTED: cut the supply by hand"]


def test_pressures_that_fall_prove_a_zero_that_nothing_answers(tmp_path: Path) -> None:
    """A supply whose answers are lost, with sensors of their own."""

    def silent(wire: _Wire, verb: str) -> None:
        _lost(wire, verb)
        if verb == "confirm":
            raise DriverError("no answer")

    report = _deployed(_Wire(silent), tmp_path / "log.csv")
    assert report.vented
    assert report.ending == "vented, and the pressure fell"
    assert read_log(tmp_path / "log.csv").events[-1][1] == "vented"


def test_a_good_end_whose_zero_nothing_answers_is_none(tmp_path: Path) -> None:
    def silent(wire: _Wire, verb: str) -> None:
        if verb in ("sense", "confirm") and "vent" in wire.told:
            raise DriverError("no answer")

    wire = _Wire(silent)
    report = _deployed(wire, tmp_path / "log.csv")
    assert wire.obeyed[-4:] == ["vent", "close", "vent", "close"]
    assert (report.completed, report.vented) == (False, False)


@pytest.mark.parametrize("kind", [DriverError, RuntimeError])
def test_venting_is_tried_again_whatever_the_driver_raises(
    kind: type[Exception], tmp_path: Path
) -> None:
    def stubborn(wire: _Wire, verb: str) -> None:
        _lost(wire, verb)
        if verb == "vent" and wire.told.count("vent") <= 2:
            raise kind("busy")

    wire = _Wire(stubborn)
    report = _deployed(wire, tmp_path / "log.csv")
    assert report.vented
    # Twice in vain, each time on a connection made anew; then taken; then proven.
    assert wire.obeyed[-8:] == ["vent", "close"] * 4


def test_an_error_of_our_own_vents_and_is_not_hidden(tmp_path: Path) -> None:
    def broken(wire: _Wire, verb: str) -> None:
        if verb == "sense" and wire.told.count("sense") == 4:
            raise IndexError("a mistake in a driver")

    wire = _Wire(broken)
    with pytest.raises(IndexError, match="a mistake in a driver") as raised:
        _deployed(wire, tmp_path / "log.csv")
    assert raised.value.__notes__ == ["The run was stopped: vented, and the pressure fell"]
    assert wire.obeyed[-4:] == ["vent", "close", "vent", "close"]
    assert "IndexError" in read_log(tmp_path / "log.csv").events[-2][1]


def test_nothing_is_sent_to_a_rig_that_cannot_be_watched(tmp_path: Path) -> None:
    wire = _Wire()
    rig = replace(RIG, air=Air(law="orifice"))
    with (
        DeploymentLog(tmp_path / "log.csv", 3) as log,
        pytest.raises(ValueError, match="chambers_mm3 is empty"),
    ):
        deploy(plan_schedule(GAIT, RIG), wire, rig, log, _Clock())
    assert wire.told == []


def test_a_sensor_that_falls_silent_after_venting_is_no_good_end(tmp_path: Path) -> None:
    """Zero was taken; whether the legs are empty, nobody knows."""

    def silent(wire: _Wire, verb: str) -> None:
        if verb == "sense" and "vent" in wire.told:
            raise DriverError("no answer")

    report = _deployed(_Wire(silent), tmp_path / "log.csv")
    assert not report.completed
    assert report.vented
    assert report.reason == "after venting nothing is sensed: no answer"
    assert report.pressure_fell == (None, None, None)
    assert report.ending.startswith("vented, but nobody sensed whether the pressure of channel 1,")


def test_a_signal_that_comes_while_venting_ends_the_run(tmp_path: Path) -> None:
    """Ctrl-C between the last command and the end: noted, told, and venting is finished."""

    def interrupt(wire: _Wire, verb: str) -> None:
        if verb == "vent" and wire.told.count("vent") == 1:
            signal.raise_signal(signal.SIGINT)

    report = _deployed(_Wire(interrupt), tmp_path / "log.csv")
    assert not report.completed
    assert report.reason == "stopped by SIGINT"
    assert report.vented
    assert report.pressure_fell == (True, True, True)


@pytest.mark.parametrize("sample", [0, 5, None])
def test_a_log_that_cannot_be_written_stops_and_vents(
    sample: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From some sample on, or from the end on: the disk is full."""
    wire = _Wire()

    def full(log: DeploymentLog, cells: list[str]) -> None:
        if "vent" in wire.told or (sample is not None and wire.told.count("sense") > sample):
            raise LogError("the log cannot be written: no space left")
        written(log, cells)

    written = DeploymentLog._write
    monkeypatch.setattr(DeploymentLog, "_write", full)
    report = _deployed(wire, tmp_path / "log.csv")
    assert not report.completed
    assert report.reason == "the log cannot be written: no space left"
    assert report.vented
    assert report.pressure_fell == (True, True, True)
    assert wire.told[-1] == "close"
    if sample is not None:
        assert wire.told[: wire.told.index("vent")].count("sense") == sample + 1


class _WrongClock(_Clock):
    """Goes on for a second, and then stands still or goes backward."""

    def __init__(self, going: float) -> None:
        super().__init__()
        self._going = going

    def wait_until(self, time_s: float) -> None:
        if self.time_s < 1.0:
            super().wait_until(time_s)
        else:
            self.time_s = max(0.5, self.time_s + self._going)


@pytest.mark.parametrize("going", [0.0, -0.1])
def test_a_clock_that_goes_wrong_vents_and_ends(going: float, tmp_path: Path) -> None:
    wire = _Wire()
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(GAIT, RIG), wire, RIG, log, _WrongClock(going))
    assert not report.completed
    assert "the clock stands still or goes backward" in report.reason
    assert report.vented
    assert wire.told[-1] == "close"


def test_a_full_disk_is_told_by_the_log_s_name(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no device that is always full")
    with pytest.raises(LogError, match=r"the log /dev/full cannot be written: .*No space left"):
        DeploymentLog("/dev/full", 3)


def test_what_the_watch_found_while_venting_is_not_forgotten() -> None:
    """One of its first two samples is a fault; all that follow are those of a leg that empties."""
    rig, found = RigSettings(), iter(["a wire is loose", None])

    class Watch:
        closing_s, highest_kPa = 1.0, np.full(3, 50.0)

        def fault(self, *_: object) -> str | None:
            self.highest_kPa = np.maximum(self.highest_kPa - 20.0, 0.0)
            return next(found, None)

    fall = sense_until_fallen(
        _Wire(), cast(Any, Watch()), rig, _Clock(), 0.0, lambda: None, lambda *_: None
    )
    assert fall.fault == "a wire is loose"
    assert fall.fell == (True, True, True)
    assert fall.problem == "a wire is loose"
