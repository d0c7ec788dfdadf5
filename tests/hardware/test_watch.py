"""The band of healthy pressures against closed forms, and what the watch makes of readings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.hardware.healthy_band import HealthyBand
from pneumorph.hardware.rig import Channel, RigSettings, SafetySettings
from pneumorph.hardware.virtual_rig import VirtualRegulators
from pneumorph.hardware.watch import PressureWatch
from pneumorph.physics.air import Air
from pneumorph.physics.regulators import RateLimited, air_regulators

RIG = RigSettings(channels=(Channel(),))


def _first_fault(
    commanded: np.ndarray, sensed: np.ndarray, rig: RigSettings = RIG, step_s: float = 0.1
) -> tuple[float, str] | None:
    """When the watch first complains, a sample each step, and of what."""
    watch = PressureWatch(rig)
    for number, (command, reading) in enumerate(zip(commanded, sensed, strict=True)):
        found = watch.fault(step_s * number, np.array([command]), np.array([reading]))
        if found:
            return step_s * number, found
    return None


def test_the_slowest_regulator_is_a_ramp_and_then_an_exponential() -> None:
    """From 0 to 100 at 100 kPa/s until a lag of 0.2 s is slower, 20 kPa before the end."""
    band = HealthyBand(100.0, 0.2)
    start = np.zeros(1)
    band.advance(0.0, start, start)
    band.advance(0.0, np.array([100.0]), start)
    for time_s in (0.3, 0.8, 0.9, 1.4):
        band.advance(time_s, np.array([100.0]), start)
        slowest = 100.0 * time_s if time_s <= 0.8 else 100.0 - 20.0 * np.exp(-(time_s - 0.8) / 0.2)
        assert band.lowest_kPa[0] == pytest.approx(slowest, rel=1e-12)
        assert band.highest_kPa[0] == 100.0
    band.advance(1.4, start, start)  # and back: the lowest jumps, the highest follows slowly
    band.advance(1.9, start, start)
    assert band.lowest_kPa[0] == 0.0
    assert band.highest_kPa[0] == pytest.approx(50.0, rel=1e-12)


def _commanded_at_random(
    regulator: VirtualRegulators, band: HealthyBand, rounds: int, most: int, step_s: float
) -> Iterator[float]:
    """Give a regulator and its band commands at random instants between samples of random distance,
    up to so many steps apart; the pressure at each sample [kPa]."""
    rng = np.random.default_rng(0)
    band.advance(0.0, np.zeros(1), np.zeros(1))
    step = 0
    for _ in range(rounds):
        given, sampled = np.sort(rng.integers(0, most, 2))
        for number in range(sampled):
            if number == given:
                regulator.target_kPa = rng.uniform(0.0, 90.0, 1)
            regulator.step()
        step += sampled
        if given == sampled:
            regulator.target_kPa = rng.uniform(0.0, 90.0, 1)
        band.advance(step_s * step, regulator.target_kPa, regulator.pressure_kPa)
        yield float(regulator.pressure_kPa[0])


@pytest.mark.parametrize("lag_s", [0.0, 0.05, 0.2, 0.25])
def test_every_healthy_regulator_stays_inside(lag_s: float) -> None:
    """Commands at random instants between samples of random distance, lags up to the slowest.

    Steps of 1 ms against the continuous band: (c - p) (1 - exp(-h / lag)) falls below the rate's
    150 h a little sooner than (c - p) h / lag does, where p is 150 h / 2 = 0.075 kPa further away.
    """
    regulator = VirtualRegulators(1, RateLimited(150.0), lag_s, 1e-3)
    band = HealthyBand(150.0, 0.25)
    for pressure in _commanded_at_random(regulator, band, 100, 400, 1e-3):
        assert band.lowest_kPa[0] - 0.1 <= pressure <= band.highest_kPa[0] + 0.1


CHAMBERS = (7056.0,)
"""Two of the paper's legs."""
AIR_RIG = replace(RIG, air=Air(law="orifice"), chambers_mm3=CHAMBERS)


@pytest.mark.parametrize("share", [0.6, 1.0, 5.0])
@pytest.mark.parametrize("lag_s", [0.0, 0.25])
def test_every_healthy_valve_stays_inside(share: float, lag_s: float) -> None:
    """Valves from the slowest that is healthy on, behind lags up to the slowest.

    The band goes in parts of 10 ms in which the slower of lag and air decides, the regulators in
    steps of 5 ms: where the two change over, as much as either goes in a part may be between
    them, 0.01 / 0.25 of the 10 kPa from which a lag of 0.25 s is the slower.
    """
    air = AIR_RIG.air
    regulator = VirtualRegulators(
        1, air_regulators(air.scaled(share, share), CHAMBERS), lag_s, 5e-3
    )
    band = HealthyBand(150.0, 0.25, AIR_RIG.slowest_air())
    width = []
    for pressure in _commanded_at_random(regulator, band, 60, 200, 5e-3):
        assert band.lowest_kPa[0] - 0.4 <= pressure <= band.highest_kPa[0] + 0.4
        width.append(band.highest_kPa[0] - band.lowest_kPa[0])
    assert np.median(width) < 45.0  # it says something: commands are 45 kPa apart, half of them


def test_the_watch_waits_for_air_and_no_longer() -> None:
    """A step to 60 kPa of a healthy rig, sampled each 0.1 s, is slower than 150 kPa/s: the watch
    that knows of the air lets it be, and finds a valve stuck at 20 kPa when the slowest healthy one
    is 5 kPa beyond that and 0.2 s have gone."""
    times = 0.1 * np.arange(60)
    commanded = np.full(60, 60.0)
    healthy, slowest = (
        np.array([each.after(np.zeros(1), np.array([60.0]), t)[0] for t in times])
        for each in (air_regulators(AIR_RIG.air, CHAMBERS), AIR_RIG.slowest_air())
    )
    assert _first_fault(commanded, healthy, AIR_RIG) is None
    rate_alone = _first_fault(commanded, healthy, RIG)
    assert rate_alone is not None
    assert "below what a healthy regulator has" in rate_alone[1]
    found = _first_fault(commanded, np.minimum(healthy, 20.0), AIR_RIG)
    assert found is not None
    reached = times[np.argmax(slowest > 25.0)]
    assert reached + 0.2 - 1e-9 <= found[0] < reached + 0.2 + 2 * 0.1
    trembling = healthy[-1] + 0.1 * (-1.0) ** np.arange(20)  # else the sensor would seem stuck
    vented = np.concatenate([healthy, trembling])
    stuck_open = _first_fault(np.concatenate([commanded, np.zeros(20)]), vented, AIR_RIG)
    assert stuck_open is not None
    assert 6.2 - 1e-9 <= stuck_open[0] < 7.0


def test_a_rig_without_channels_is_refused() -> None:
    """Nothing would be commanded and nothing watched."""
    with pytest.raises(ValueError, match="channels is empty, expected one channel for each"):
        RigSettings(channels=())


def test_a_watch_that_does_not_know_the_chambers_is_refused() -> None:
    with pytest.raises(ValueError, match="chambers_mm3 is empty, expected the volume of each"):
        PressureWatch(replace(AIR_RIG, chambers_mm3=()))
    with pytest.raises(ValueError, match="chambers_mm3 has 2 numbers for 1 channels"):
        replace(AIR_RIG, chambers_mm3=(1.0, 2.0))
    with pytest.raises(ValueError, match="has 2 numbers for 1 regulators"):
        replace(AIR_RIG, air=Air(filling_mm3_per_s_kPa=(1.0, 2.0)))


def test_a_valve_stuck_open_under_command_zero() -> None:
    """90 kPa may still be venting at the first sample; 85 kPa are left after 0.03 s at 150 kPa/s,
    so the second sample is outside and the fourth has been for 0.2 s."""
    found = _first_fault(np.zeros(50), np.full(50, 90.0))
    assert found is not None
    assert found[0] == pytest.approx(0.3)
    assert "channel 1 senses 90.0 kPa, above what a healthy regulator has" in found[1]
    assert "cut the air" in found[1]


def test_a_regulator_that_vents_when_the_run_begins_is_healthy() -> None:
    """The trial before ended inflated: 80 kPa vent at the slowest rate."""
    time_s = 0.1 * np.arange(30)
    ramp_s = 80.0 / 150.0 - 0.25
    slowest = np.where(
        time_s < ramp_s, 80.0 - 150.0 * time_s, 37.5 * np.exp(-(time_s - ramp_s) / 0.25)
    )
    assert _first_fault(np.zeros(30), slowest) is None
    assert _first_fault(np.zeros(30), np.zeros(30)) is None


def test_a_burst_tube_while_the_command_cycles() -> None:
    """About zero with noise, so no reading is the same twice."""
    noise = 0.2 * np.random.default_rng(0).standard_normal(60)
    cycle = 45.0 - 45.0 * np.cos(2.0 * np.pi * 0.1 * np.arange(60) / 4.0)
    found = _first_fault(cycle, noise)
    assert found is not None
    # The command passes 20 kPa at 0.62 s; the slowest lag and the rate know it 0.3 s later.
    assert found[0] < 1.2
    assert "below what a healthy regulator has" in found[1]
    assert "burst" in found[1]


@pytest.mark.parametrize("reading", [np.nan, np.inf, -np.inf])
def test_a_reading_that_is_no_number_stops_at_once(reading: float) -> None:
    sensed = np.full(10, 20.0)
    sensed[4] = reading
    found = _first_fault(np.full(10, 20.0), sensed)
    assert found is not None
    assert found[0] == pytest.approx(0.4)
    assert "which is no pressure: its sensor, wire or converter is broken" in found[1]


def test_channels_without_a_sensor_are_not_watched() -> None:
    bare = replace(RIG, channels=(Channel(has_sensor=False),))
    ramp, nothing = np.linspace(0.0, 80.0, 30), np.full(30, np.nan)
    assert _first_fault(ramp, nothing, bare) is None
    found = _first_fault(ramp, np.full(30, np.inf), bare)
    assert found is not None  # a reading that is there is looked at
    supply = RigSettings(driver="9129b", resource="TCPIP::x")
    assert not supply.has_sensor.any()
    assert replace(supply, adc_port="/dev/ttyACM0").has_sensor.all()


def test_limits_of_the_reading_itself() -> None:
    ramp = np.linspace(0.0, 40.0, 10)
    for reading, text in ((100.1, "above the limit of 100 kPa"), (-10.1, "below -10 kPa")):
        found = _first_fault(ramp, np.where(np.arange(10) == 5, reading, ramp))
        assert found is not None
        assert found[0] == pytest.approx(0.5)
        assert text in found[1]


def test_stuck_is_told_from_still() -> None:
    ramp = np.linspace(0.0, 40.0, 10)
    found = _first_fault(ramp, np.full(10, 7.0))
    assert found is not None
    assert "is stuck" in found[1]
    # A sensor may stand still while the command does, or lag behind while it moves.
    assert _first_fault(np.full(10, 20.0), np.full(10, 20.0)) is None
    assert _first_fault(ramp, 0.5 * ramp) is None


def test_a_stuck_sensor_is_found_though_the_command_comes_back() -> None:
    """0, 40 and 0 kPa again within the window: the ends of it are the same."""
    command = np.array([0.0, 40.0, 40.0, 0.0, 0.0, 0.0])
    found = _first_fault(command, np.full(6, 3.0))
    assert found is not None
    assert found[0] == pytest.approx(0.4)
    assert "is stuck" in found[1]


def test_a_single_disturbed_reading_is_no_fault() -> None:
    sensed = np.full(20, 20.0) + 0.01 * np.arange(20)
    sensed[[5, 6, 12]] = 60.0
    sensed[15] = 0.0
    assert _first_fault(np.full(20, 20.0), sensed) is None
    slow = replace(RIG, safety=SafetySettings(residual_s=0.0))
    assert _first_fault(np.full(20, 20.0), sensed, slow) is not None


@pytest.mark.parametrize("later_s", [0.0, -0.1, -5.0, float("nan")])
def test_a_clock_that_stands_still_or_goes_backward_stops_at_once(later_s: float) -> None:
    """Else the band would widen, and no time would pass in which anything could be too long."""
    watch = PressureWatch(RIG)
    assert watch.fault(10.0, np.zeros(1), np.zeros(1)) is None
    found = watch.fault(10.0 + later_s, np.zeros(1), np.full(1, 60.0))
    assert found is not None
    assert "the clock stands still or goes backward" in found


def test_samples_that_come_late_stop_the_run() -> None:
    watch = PressureWatch(RIG)
    for time_s in (0.0, 0.8, 1.6):
        assert watch.fault(time_s, np.zeros(1), np.zeros(1)) is None
    found = watch.fault(2.6, np.zeros(1), np.zeros(1))
    assert found is not None
    assert "no sample was taken for 1.00 s, expected one within 0.9 s" in found


def test_it_is_told_before_a_command_that_the_last_sample_is_too_old() -> None:
    """Asking changes nothing: the sample that is taken then is late as well."""
    watch = PressureWatch(RIG)
    assert watch.late(5.0) is None  # there was none yet
    assert watch.fault(5.0, np.zeros(1), np.zeros(1)) is None
    assert watch.late(5.89) is None
    told = "no sample was taken for 0.91 s, expected one within 0.9 s"
    for _ in range(2):
        assert told in (watch.late(5.91) or "")
    assert told in (watch.fault(5.91, np.zeros(1), np.zeros(1)) or "")
    assert watch.late(5.92) is None
