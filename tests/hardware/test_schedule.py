"""Schedules keep the rig's interval, rate and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.rig import Channel, RigSettings, SafetySettings
from pneumorph.hardware.schedule import plan_schedule


def test_interval_rate_and_end() -> None:
    rig = RigSettings(update_interval_s=0.25, rate_kPa_per_s=100.0)
    schedule = plan_schedule(ExpertGait(), rig)
    assert np.diff(schedule.time_s[:-1]).min() >= 0.25 - 1e-9
    # The last command vents at once; all others keep the rate over an interval.
    changes = np.abs(np.diff(schedule.pressure_kPa[:-1], axis=0)).max()
    assert changes <= 100.0 * 0.25 + 1e-9
    assert not schedule.pressure_kPa[-1].any()
    assert schedule.duration_s == 20.0


def test_held_commands_are_given_when_they_change() -> None:
    """A change at 1 s is commanded at 1 s, not at the next multiple of the interval."""
    gait = HeldGait.evenly(np.array([[30.0, 0, 0], [10.0, 20, 0], [10.0, 20, 0]]), 1.0)
    schedule = plan_schedule(gait, RigSettings())
    np.testing.assert_allclose(schedule.time_s, [0.0, 1.0, 3.0])
    np.testing.assert_allclose(schedule.pressure_kPa[:2], [[30, 0, 0], [10, 20, 0]])


def test_voltage_is_affine_in_pressure() -> None:
    channel = Channel(command_volt_per_kPa=0.05, command_volt_at_zero=1.0, highest_volt=5.5)
    rig = replace(RigSettings(), channels=(channel,) * 3)
    schedule = plan_schedule(ExpertGait(amplitude_kPa=40.0), rig)
    np.testing.assert_allclose(schedule.volts, 1.0 + 0.05 * schedule.pressure_kPa)
    assert rig.zero_volts == [1.0, 1.0, 1.0]
    assert channel.sensed_kPa(1.0 + 0.04 * 33.0) == pytest.approx(33.0)


def test_a_gait_beyond_the_limits_is_refused_before_anything_moves() -> None:
    rig = replace(RigSettings(), channels=(Channel(highest_kPa=60.0),) * 3)
    with pytest.raises(ValueError, match=r"gait's command at .* s: channel 1: pressure .* beyond"):
        plan_schedule(ExpertGait(), rig)
    with pytest.raises(ValueError, match="commands 2 regulators, the rig has 3 channels"):
        plan_schedule(ExpertGait(regulator_count=2), RigSettings())


def test_rigs_that_cannot_be_safe_are_refused() -> None:
    with pytest.raises(ValueError, match="venting must be allowed"):
        Channel(command_volt_at_zero=-1.0)
    with pytest.raises(ValueError, match="expected less than the watchdog's"):
        RigSettings(sample_interval_s=0.5)
    with pytest.raises(ValueError, match=r"lowest_sensed_kPa must be below 0, got 0\.0; sensors"):
        SafetySettings(lowest_sensed_kPa=0.0)
    with pytest.raises(ValueError, match="residual_kPa must be finite, got nan"):
        SafetySettings(residual_kPa=float("nan"))
    with pytest.raises(ValueError, match="resource is empty"):
        RigSettings(driver="serial")
