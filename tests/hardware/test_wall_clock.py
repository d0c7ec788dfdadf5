"""The clock of real rigs, where the computer falls asleep in mid-gait."""

from __future__ import annotations

import time

import pytest

from pneumorph.hardware.driver import WallClock

BOOT = 7


def test_time_passes_while_the_computer_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux's monotonic clock stands still meanwhile, that of its boot does not."""
    boot_s = {BOOT: 1000.0}
    monkeypatch.setattr(time, "CLOCK_BOOTTIME", BOOT, raising=False)
    monkeypatch.setattr(time, "clock_gettime", boot_s.__getitem__, raising=False)
    monkeypatch.setattr(time, "monotonic", lambda: 50.0)
    clock = WallClock()
    assert clock.now_s() == 0.0
    boot_s[BOOT] += 3600.0
    assert clock.now_s() == 3600.0
    clock.wait_until(3599.0)  # it has passed


def test_a_platform_without_such_a_clock_has_its_monotonic_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = [50.0]
    monkeypatch.delattr(time, "CLOCK_BOOTTIME", raising=False)
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    clock = WallClock()
    now_s[0] += 2.5
    assert clock.now_s() == 2.5


def test_a_wait_is_as_long_as_asked_for() -> None:
    clock = WallClock()
    clock.wait_until(0.05)
    assert clock.now_s() >= 0.05
