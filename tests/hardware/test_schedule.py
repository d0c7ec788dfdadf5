"""Schedules keep the rig's interval, rate and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.rig import Channel, RigSettings, SafetySettings
from pneumorph.hardware.schedule import (
    SAME_LOGGED_S,
    count_skipped,
    places,
    plan_schedule,
    skipped_note,
)
from pneumorph.hardware.watch import PressureWatch
from pneumorph.physics.air import Air


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


def test_sent_times_are_found_in_a_schedule() -> None:
    """A time that a log has rounded down is that of the command; a run gives none so early."""
    due_s = np.array([0.0, 1.0 / 3.0, 1.0, 2.0])
    sent_s = np.array([-0.1, 0.0, 0.3333, 1.9, 2.5])
    assert places(due_s, sent_s).tolist() == [-1, 0, 0, 2, 3]
    assert places(due_s, sent_s, SAME_LOGGED_S).tolist() == [-1, 0, 1, 2, 3]


def test_commands_before_one_that_was_sent_are_skipped() -> None:
    assert [count_skipped(sent) for sent in ([], [-1], [0, 1], [0, 3, 3], [4])] == [0, 0, 0, 2, 4]
    assert skipped_note({"trial_1": 0}, 6) is None
    told = skipped_note({"trial_1": 1, "trial_2": 0, "trial_3": 2}, 6)
    assert told is not None
    assert "never sent (1 in trial_1, 2 in trial_3 of 6): the rig took longer" in told


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
    slow = {"driver": "serial", "resource": "/dev/ttyACM0", "reply_timeout_s": 0.3}
    with pytest.raises(ValueError, match=r"twice reply_timeout_s are 0\.6 s, .*watchdog_s, 0\.45"):
        RigSettings(**slow)
    RigSettings(**slow, safety=SafetySettings(watchdog_s=0.7))
    with pytest.raises(ValueError, match=r"twice command_time_s and reply_timeout_s are 0\.6 s"):
        RigSettings(driver="9129b", resource="ASRL1::INSTR", command_time_s=0.2)
    supply = {"driver": "9129b", "resource": "ASRL1::INSTR"}
    with pytest.raises(
        ValueError, match=r"update_interval_s is 0\.19 s, .* command_time_s, 0\.2 s"
    ):
        RigSettings(**supply, update_interval_s=0.19)
    RigSettings(**supply, update_interval_s=0.2)
    RigSettings(**supply, update_interval_s=0.1, command_time_s=0.05)
    with pytest.raises(ValueError, match=r"must be at least -50 and below 0, got 0\.0; sensors"):
        SafetySettings(lowest_sensed_kPa=0.0)
    with pytest.raises(ValueError, match="residual_kPa must be finite, got nan"):
        SafetySettings(residual_kPa=float("nan"))
    with pytest.raises(ValueError, match="resource is empty"):
        RigSettings(driver="serial")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("residual_s", 1e9),
        ("residual_kPa", 1e9),
        ("slowest_lag_s", 1e9),
        ("watchdog_s", 1e9),
        ("stuck_s", 1e9),
        ("stuck_command_change_kPa", 1e9),
        ("lowest_sensed_kPa", -1e9),
        ("vent_attempts", 10**9),
    ],
)
def test_safety_that_watches_nothing_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must be .*at (most|least) .*, got .*; [a-z]+"):
        SafetySettings(**{name: value})


@pytest.mark.parametrize("name", ["update_interval_s", "reply_timeout_s", "command_time_s"])
def test_times_of_a_rig_have_an_end(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} must be .*at most .*, got 1000000000.0; [a-z]+"):
        replace(RigSettings(), **{name: 1e9})


def test_limits_of_commands_and_of_readings_belong_together() -> None:
    with pytest.raises(
        ValueError, match="highest_kPa of a channel is 300, expected at most safety"
    ):
        RigSettings(channels=(Channel(), Channel(highest_kPa=300.0)))
    with pytest.raises(ValueError, match=r"highest_sensed_kPa is 1e\+09, expected at most 150 kPa"):
        RigSettings(safety=SafetySettings(highest_sensed_kPa=1e9))
    stiff = Channel(highest_kPa=200.0)  # actuators of another kind
    RigSettings(channels=(stiff,), safety=SafetySettings(highest_sensed_kPa=300.0))


@pytest.mark.parametrize(
    "rig",
    [
        RigSettings(rate_kPa_per_s=1.0),
        RigSettings(air=Air(law="orifice"), chambers_mm3=(1e9,) * 3),
        RigSettings(air=Air(law="orifice", venting_mm3_per_s_kPa=(1.0,)), chambers_mm3=(3e3,) * 3),
        replace(
            RigSettings(air=Air(law="orifice"), chambers_mm3=(3e3,) * 3),
            safety=SafetySettings(slowest_air_share=1e-3),
        ),
    ],
)
def test_a_rig_so_slow_that_its_watch_is_blind_is_refused(rig: RigSettings) -> None:
    with pytest.raises(ValueError, match="takes more than 20 s to vent 100 kPa, expected less"):
        PressureWatch(rig)


def test_a_schedule_that_is_another_gait_is_refused() -> None:
    """Commands that all but stay at zero, and a pulse between two commands."""
    with pytest.raises(ValueError, match=r"channel 1 would reach .* kPa, the gait has 90 kPa"):
        plan_schedule(ExpertGait(), RigSettings(rate_kPa_per_s=1e-9))
    with pytest.raises(ValueError, match="likely cause: the interval is too long"):
        plan_schedule(ExpertGait(period_s=2.0), RigSettings(rate_kPa_per_s=15.0))
    pulse = HeldGait(np.array([0.0, 0.1, 0.2]), np.array([[0.0], [60.0], [0.0]]), 1.0)
    with pytest.raises(ValueError, match="would reach 0 kPa, the gait has 60 kPa"):
        plan_schedule(pulse, RigSettings(channels=(Channel(),)))
