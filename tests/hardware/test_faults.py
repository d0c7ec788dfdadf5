"""Whatever breaks in mid-gait, the regulators are commanded to zero within half a second.

The supply is a server on a socket that speaks SCPI and fails as told; the driver, the deployment
and the guardian are those of a real rig. Half a second counts from the first sign of the fault that
reaches this side: for a supply that falls silent, from the question it leaves unanswered.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.scpi_instrument import ScpiInstrument

from pneumorph.base.settings import save_settings
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.analog_rig import AnalogRig
from pneumorph.hardware.deployment import NOT_VENTED, DeploymentReport, deploy
from pneumorph.hardware.deployment_log import DeploymentLog, read_log
from pneumorph.hardware.driver import DriverError, WallClock
from pneumorph.hardware.guardian import Guardian, vent
from pneumorph.hardware.rig import Channel, RigSettings, SafetySettings
from pneumorph.hardware.schedule import plan_schedule

pytest.importorskip("pyvisa_py")
pytestmark = pytest.mark.alone

LIMIT_S = 0.5
GAIT = ExpertGait(period_s=2.0, duration_s=8.0)


@pytest.fixture
def supply() -> Iterator[ScpiInstrument]:
    instrument = ScpiInstrument(busy_s=0.04)  # clocks and sockets are exact to a few milliseconds
    yield instrument
    instrument.close()


def _rig(supply: ScpiInstrument) -> RigSettings:
    return RigSettings(driver="9129b", resource=supply.resource, command_time_s=0.05)


class _SensedRig(AnalogRig):
    """The rig with sensors that follow the commands, until they are told otherwise."""

    def __init__(self, rig: RigSettings) -> None:
        super().__init__(rig)
        self._commanded = np.zeros(3)
        self._rng = np.random.default_rng(0)
        self.stuck_at: float | None = None
        self.overpressure = False
        self.sign_at: float | None = None

    def command(self, pressure_kPa: np.ndarray) -> None:
        super().command(pressure_kPa)
        self._commanded = pressure_kPa

    def vent(self) -> None:
        super().vent()
        self._commanded = np.zeros(3)

    def sense(self) -> np.ndarray:
        sensed = self._commanded + 0.2 * self._rng.standard_normal(3)
        if self.stuck_at is not None:
            sensed[0] = 12.3
        if self.overpressure:
            self.sign_at = self.sign_at or time.monotonic()
            sensed[1] = 120.0
        return sensed


def _run(
    supply: ScpiInstrument, log: Path, fault: str, driver: AnalogRig | None = None
) -> tuple[DeploymentReport, float]:
    """Deploy, break something after 1.5 s, and return the report and when it broke."""
    rig = _rig(supply)
    broken: list[float] = []
    timer = threading.Timer(1.5, lambda: broken.append(supply.fail(fault)))
    timer.start()
    with DeploymentLog(log, 3) as written:
        report = deploy(
            plan_schedule(GAIT, rig), driver or AnalogRig(rig), rig, written, WallClock()
        )
    timer.join()
    return report, broken[0]


@pytest.mark.parametrize(
    ("fault", "reason"),
    [("late", "SYST:ERR"), ("silent", "SYST:ERR"), ("garbage", "expected an error number")],
)
def test_supply_answers_late_not_at_all_or_garbage(
    fault: str, reason: str, supply: ScpiInstrument, tmp_path: Path
) -> None:
    report, broken = _run(supply, tmp_path / "log.csv", fault)
    assert not report.completed
    assert reason in report.reason
    assert not report.vented  # as far as anybody knows: nothing answers, and nothing is sensed
    # The first sign is the next command's unanswered check: at most one update interval later.
    first_sign = broken + RigSettings().update_interval_s
    zeroed = supply.zeroed_after(broken)
    assert zeroed is not None
    assert broken + zeroed - first_sign < LIMIT_S
    _assert_log_is_complete(tmp_path / "log.csv", report, NOT_VENTED)


class _Beats:
    """When a guardian was told that the process lives."""

    def __init__(self) -> None:
        self.at_s: list[float] = []

    def beat(self) -> None:
        self.at_s.append(time.monotonic())


def test_a_late_answer_does_not_look_like_a_dead_process(
    supply: ScpiInstrument, tmp_path: Path
) -> None:
    """By the usual times, of which a 9129B needs most: the guardian would kill its own run."""
    rig = RigSettings(driver="9129b", resource=supply.resource)
    beats, driver = _Beats(), _SensedRig(rig)
    timer = threading.Timer(1.5, lambda: supply.fail("late"))
    timer.start()
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(GAIT, rig), driver, rig, log, WallClock(), beats)
    timer.join()
    assert "SYST:ERR" in report.reason
    assert np.diff(beats.at_s).max() < rig.safety.watchdog_s
    assert len(beats.at_s) > 10


def test_a_zero_right_after_another_s_message_arrives(supply: ScpiInstrument) -> None:
    """As of the guardian, a moment after the deploying process sent its last one and died."""
    rig = _rig(supply)
    driver = AnalogRig(rig)
    driver.open()
    driver.command(np.full(3, 50.0))
    assert vent(AnalogRig(rig), 1, confirmed=True) == []
    assert not any(supply.last_volts())


def test_a_zero_that_the_supply_has_not_taken_is_sent_again(supply: ScpiInstrument) -> None:
    driver = AnalogRig(_rig(supply))
    driver.open()
    driver.command(np.full(3, 50.0))
    with pytest.raises(DriverError, match=r"outputs are set to 5\.000,5\.000,5\.000 V, expected 0"):
        driver.confirm()
    supply.fail("silent")
    with pytest.raises(DriverError, match=r"'APP:VOLT\?' failed"):
        vent(driver, 2, confirmed=True)
    supply.fail("")
    assert vent(driver, 2, confirmed=True) == []


def test_cable_pulled_and_plugged_in_again(supply: ScpiInstrument, tmp_path: Path) -> None:
    """The connection drops; venting connects anew and is taken."""
    report, broken = _run(supply, tmp_path / "log.csv", "cut")
    assert not report.completed
    zeroed = supply.zeroed_after(broken)
    assert zeroed is not None
    assert zeroed < RigSettings().update_interval_s + LIMIT_S
    assert report.vented
    _assert_log_is_complete(tmp_path / "log.csv", report)


def test_cable_pulled_for_good(supply: ScpiInstrument, tmp_path: Path) -> None:
    """Nothing can be commanded any more: the log says so, and the run does not hang."""
    rig, driver = _rig(supply), AnalogRig(_rig(supply))
    threading.Timer(1.0, lambda: (supply.close(), supply.fail("cut"))).start()
    start = time.monotonic()
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(GAIT, rig), driver, rig, log, WallClock())
    assert time.monotonic() - start < 1.0 + rig.update_interval_s + 3 * LIMIT_S
    assert not report.vented
    assert "NOT VENTED" in read_log(tmp_path / "log.csv").events[-1][1]


def test_sensor_stuck(supply: ScpiInstrument, tmp_path: Path) -> None:
    driver = _SensedRig(_rig(supply))
    driver.stuck_at = 0.0  # from the beginning: the first sign is the command's first move
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(GAIT, _rig(supply)), driver, _rig(supply), log, WallClock())
    assert "channel 1 has sensed 12.30 kPa" in report.reason
    assert report.vented
    safety = SafetySettings()
    commands = [(t, v) for t, v in supply.volts if any(v)]
    # Stuck can be told once the command has moved by the limit and the window has passed.
    moved = next(t for t, v in commands if v[0] / 0.1 >= safety.stuck_command_change_kPa)
    zeroed = supply.zeroed_after(moved)
    assert zeroed is not None
    assert zeroed - safety.stuck_s < LIMIT_S
    _assert_log_is_complete(tmp_path / "log.csv", report)


def test_pressure_above_the_limit(supply: ScpiInstrument, tmp_path: Path) -> None:
    driver = _SensedRig(_rig(supply))
    threading.Timer(1.5, lambda: setattr(driver, "overpressure", True)).start()
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        report = deploy(plan_schedule(GAIT, _rig(supply)), driver, _rig(supply), log, WallClock())
    assert "channel 2 senses 120.0 kPa, above the limit of 100 kPa" in report.reason
    assert driver.sign_at is not None
    zeroed = supply.zeroed_after(driver.sign_at)
    assert zeroed is not None
    assert zeroed < LIMIT_S
    log_read = read_log(tmp_path / "log.csv")
    assert log_read.sensed_kPa[-1, 1] == 120.0  # the sample that stopped the run is in the log


@pytest.mark.parametrize("how", ["SIGKILL", "SIGSTOP", "SIGINT"])
def test_process_killed_stopped_or_interrupted(
    how: str, supply: ScpiInstrument, tmp_path: Path
) -> None:
    """Killed: the guardian sees the pipe close. Stopped: it misses the beats. Ctrl-C: no need."""
    rig_file = save_settings(tmp_path / "rig.json", _rig(supply))
    run = tmp_path / "run"
    arguments = f"deploy --rig {rig_file} --trials 1 --expert.period-s 2 --out {run}"
    process = subprocess.Popen(
        [sys.executable, "-c", "from pneumorph.cli import main; main()", *arguments.split()],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    _wait_for(lambda: any(any(v) for _, v in supply.volts), 180.0)  # a busy machine imports slowly
    time.sleep(0.7)
    assert any(supply.last_volts())
    os.kill(process.pid, getattr(signal, how))
    killed = time.monotonic()
    _wait_for(lambda: supply.zeroed_after(killed) is not None, 5.0)
    zeroed = supply.zeroed_after(killed)
    assert zeroed is not None
    # A stopped process is told from a slow one only after the watchdog's time.
    allowed = LIMIT_S + (SafetySettings().watchdog_s if how == "SIGSTOP" else 0.0)
    assert zeroed < allowed
    status = process.wait(10.0)
    assert status != 0
    log = read_log(run / "trial_1" / "log.csv")
    # Complete up to that moment: every command the supply took is in the log.
    assert _commands(run / "trial_1" / "log.csv") >= _volts_before(supply, killed)
    assert log.time_s[-1] > 0.5
    record = run / "trial_1" / "guardian.json"
    if how == "SIGINT":
        assert not record.exists()
        assert "stopped by SIGINT" in log.events[-2][1]
    else:
        _wait_for(record.exists, 5.0)
        assert json.loads(record.read_text())["vented"]


def test_regulators_whose_zero_is_not_0_volts_begin_and_end_at_theirs(
    supply: ScpiInstrument, tmp_path: Path
) -> None:
    """A reversed one inflates fully at 0 V, which is beyond its hard limits besides."""
    reversed_ = Channel(-0.08, 9.0, lowest_volt=1.0)
    rig = replace(_rig(supply), channels=(reversed_,) * 3)
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        gait = ExpertGait(period_s=2.0, duration_s=1.0)
        report = deploy(plan_schedule(gait, rig), AnalogRig(rig), rig, log, WallClock())
    assert report.completed
    volts = np.array([v for _, v in supply.volts])
    np.testing.assert_array_equal(volts[[0, -1]], 9.0)
    assert volts.min() >= 1.0


def test_hard_limits_are_refused_by_the_driver(supply: ScpiInstrument) -> None:
    rig = _rig(supply)
    driver = AnalogRig(rig)
    driver.open()
    with pytest.raises(ValueError, match="channel 2: pressure 96 kPa is beyond"):
        driver.command(np.array([0.0, 96.0, 0.0]))
    narrow = replace(rig, channels=(Channel(highest_volt=5.0),) * 3)
    with pytest.raises(ValueError, match="needs 6 V, beyond the channel's hard limits of 0 to 5 V"):
        narrow.command_volts(np.array([60.0, 0.0, 0.0]))
    driver.close()
    assert not any(any(v) for _, v in supply.volts)


def _assert_log_is_complete(path: Path, report: DeploymentReport, end: str = "vented") -> None:
    log = read_log(path)
    assert len(log.time_s) == report.sample_count
    assert log.events[0][1] == "start"
    assert any(text.startswith("stopped: ") for _, text in log.events)
    assert log.events[-1][1] == end


def _commands(path: Path) -> int:
    return sum(line.endswith(",command") for line in path.read_text().splitlines())


def _volts_before(supply: ScpiInstrument, moment: float) -> int:
    # The first message is the opening's zero, which is no command of the gait.
    return sum(t < moment for t, _ in supply.volts) - 1


def _wait_for(condition: object, limit_s: float) -> None:
    end = time.monotonic() + limit_s
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def test_a_guardian_is_gone_when_it_was_dismissed(
    supply: ScpiInstrument, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its end is waited for, so that it is no zombie and holds no port when the next run begins."""
    made: list[subprocess.Popen[bytes]] = []

    class Noted(subprocess.Popen[bytes]):
        def __init__(self, *arguments: Any, **named: Any) -> None:
            super().__init__(*arguments, **named)
            made.append(self)

    monkeypatch.setattr(subprocess, "Popen", Noted)
    guardian = Guardian(_rig(supply), tmp_path / "guardian.json")
    guardian.beat()
    guardian.dismiss(vented=True)
    (process,) = made
    assert process.returncode == 0
    assert not (tmp_path / "guardian.json").exists()
