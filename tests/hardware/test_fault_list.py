"""The list of faults on the virtual rig: each is found in time, and healthy rigs raise nothing.

"Healthy" is what a regulator of the same lag has under the same commands. A fault shows only when
the pressure differs from that: a valve stuck open at 90 kPa does nothing wrong while 90 are asked.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.faulty_rig import STEP_S, Fault, FaultyRig, Sensor, Valve

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.deployment import DeploymentReport, deploy
from pneumorph.hardware.deployment_log import DeploymentLog, read_log
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import plan_schedule
from pneumorph.hardware.watch import PressureWatch
from pneumorph.physics.air import Air
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.physics.regulators import air_regulators

ROOT = Path(__file__).parents[2]
LEARNED = ROOT / "examples" / "gaits" / "learned.csv"
CHANNELS = 3
FILES = sorted(
    path
    for folder in ("examples", "reproduce")
    for path in ROOT.glob(f"{folder}/**/gaits/*")
    if read_gait(path)[0].regulator_count == CHANNELS
)
LAGS_S = (0.0, 0.05, 0.1, 0.15, 0.2)
"""From none to the slowest that randomised worlds draw; a rig's limit is 0.25 s."""

INTERMITTENT_S, SUMMED_S = 3.0, 1.0
"""Docs: one that is off every third time or more often is found within this time of the first one
that is, or once it was off for so long in all: 0.5 s outside the band, a sample that is not
complete, what is forgotten meanwhile, and again what the band needs."""

OFF_KPA, FOUND_S = 10.0, 0.75
"""Docs: a reading this far off is found within this time: 0.2 s outside the band, two samples of
0.1 s, and 0.35 s for the band to close in on the healthy pressure, when the slowest lag of 0.25 s
leaves a quarter of a step."""


def _toward(pressure_kPa: float) -> Valve:
    """A pressure that goes there whatever is commanded, within some 0.05 s."""
    kept = math.exp(-STEP_S / 0.05)
    return lambda before, healthy, since_s: pressure_kPa + (before - pressure_kPa) * kept


def _frozen() -> Sensor:
    first: list[float] = []

    def sensor(reading: float, since_s: float) -> float:
        first.append(reading)
        return first[0]

    return sensor


def _leak(lost_share: float, lag_s: float) -> Fault:
    """Air escapes through a hole at p / tau: a lagging regulator holds (1 - share) of its command,
    tau = lag (1 - share) / share."""
    tau_s = lag_s * (1.0 - lost_share) / lost_share
    return Fault(valve=lambda before, healthy, since_s: healthy * (1.0 - STEP_S / tau_s))


FAULTS: dict[str, Callable[[], Fault]] = {
    "stuck open at 90 kPa": lambda: Fault(valve=_toward(90.0)),
    "stuck where it is": lambda: Fault(valve=lambda before, healthy, since_s: before),
    "stuck closed": lambda: Fault(valve=lambda before, healthy, since_s: min(before, healthy)),
    "burst tube": lambda: Fault(valve=_toward(0.0)),
    "frozen sensor": lambda: Fault(sensor=_frozen()),
    "sensor fallen to zero": lambda: Fault(sensor=lambda reading, since_s: 0.0),
}


def _dropout(every: int, lost: int = 1) -> Fault:
    """A loose contact: of so many samples so many read zero."""
    count = 0

    def sensor(reading: float, since_s: float) -> float:
        nonlocal count
        count += 1
        return 0.0 if count % every < lost else reading

    return Fault(sensor=sensor)


def _random_dropout(share: float) -> Fault:
    rng = np.random.default_rng(1)
    return Fault(sensor=lambda reading, since_s: 0.0 if rng.random() < share else reading)


def _oscillation(size_kPa: float, frequency_Hz: float) -> Fault:
    return Fault(
        sensor=lambda r, since_s: r + size_kPa * math.sin(2.0 * math.pi * frequency_Hz * since_s)
    )


def _chatter(pressure_kPa: float, half_s: float) -> Fault:
    """A valve that lets go of its pressure for half of the time."""
    away = _toward(pressure_kPa)

    def valve(before: float, healthy: float, since_s: float) -> float:
        return away(before, healthy, since_s) if int(since_s / half_s) % 2 == 0 else healthy

    return Fault(valve=valve)


INTERMITTENT: dict[str, Callable[[], Fault]] = {
    "every second reading lost": lambda: _dropout(2),
    "every third reading lost": lambda: _dropout(3),
    "two of three readings lost": lambda: _dropout(3, 2),
    "readings lost at random": lambda: _random_dropout(0.4),
    "oscillation above and below": lambda: _oscillation(12.0, 2.5),
    "oscillation that beats with the samples": lambda: _oscillation(15.0, 4.1),
    "valve chatters towards zero": lambda: _chatter(0.0, 0.1),
    "valve chatters towards 90 kPa": lambda: _chatter(90.0, 0.2),
}


def _run(
    gait: OpenLoopGait, driver: FaultyRig, folder: Path, rig: RigSettings | None = None
) -> DeploymentReport:
    rig = rig or RigSettings()
    with DeploymentLog(folder / "log.csv", 3) as log:
        return deploy(plan_schedule(gait, rig), driver, rig, log, driver.clock)


def _before_the_end(driver: FaultyRig, report: DeploymentReport) -> list[tuple[float, float]]:
    """Residuals up to the stop; after it the pressures are watched falling."""
    return [each for each in driver.residuals if each[0] <= report.ended_s + 1e-9]


def _longest_off_s(residuals: list[tuple[float, float]]) -> float:
    """Longest time that the reading was `OFF_KPA` off without a break, counted from the last
    sample before [s]."""
    longest, good_s = 0.0, 0.0
    for time_s, residual in residuals:
        if abs(residual) < OFF_KPA:
            good_s = time_s
        longest = max(longest, time_s - good_s)
    return longest


def _summed_off_s(residuals: list[tuple[float, float]]) -> float:
    """Time that the reading was `OFF_KPA` off in all, each sample for that since the last [s]."""
    pairs = itertools.pairwise(residuals)
    return sum(after - before for (before, _), (after, off) in pairs if abs(off) >= OFF_KPA)


@pytest.mark.parametrize("name", INTERMITTENT)
@pytest.mark.parametrize("law", ["rate", "air"])
def test_what_comes_and_goes_is_found_in_time(name: str, law: str, tmp_path: Path) -> None:
    """No two samples in a row need be outside on the same side."""
    learned, _ = read_gait(LEARNED)
    for gait in (ExpertGait(duration_s=14.0), learned):
        for at_s in (0.4, 2.1, 5.2):
            fault = INTERMITTENT[name]()
            if law == "air":
                driver = _air_driver(fault, at_s)
            else:
                driver = FaultyRig(fault, at_s=at_s, lag_s=0.1, seed=1)
            report = _run(gait, driver, tmp_path, driver.settings)
            assert not report.completed
            assert report.reason.startswith("channel 1 ")
            off = [time_s for time_s, residual in driver.residuals if abs(residual) >= OFF_KPA]
            assert report.ended_s - off[0] < INTERMITTENT_S
            assert _summed_off_s(_before_the_end(driver, report)) < SUMMED_S


def test_a_reading_that_is_lost_one_time_in_five(tmp_path: Path) -> None:
    """Slower: what is forgotten meanwhile is more."""
    driver = FaultyRig(_dropout(5), at_s=0.4, lag_s=0.1, seed=1)
    report = _run(ExpertGait(duration_s=14.0), driver, tmp_path)
    assert not report.completed
    assert "again and again, for 0.5" in report.reason
    assert "a wire has a loose contact" in report.reason
    assert report.ended_s < 0.4 + 6.0


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("lag_s", [0.05, 0.2])
def test_what_breaks_is_found_in_time(name: str, lag_s: float, tmp_path: Path) -> None:
    learned, _ = read_gait(LEARNED)
    for gait in (ExpertGait(duration_s=10.0), learned):
        for at_s in (0.4, 2.1, 3.7, 5.2):
            driver = FaultyRig(FAULTS[name](), channel=0, at_s=at_s, lag_s=lag_s, seed=1)
            report = _run(gait, driver, tmp_path)
            assert not report.completed
            assert report.vented
            assert report.ended_s > at_s
            assert report.reason.startswith("channel 1 ")
            assert _longest_off_s(_before_the_end(driver, report)) < FOUND_S


AIR_RIG = RigSettings(air=Air(law="orifice"), chambers_mm3=(3528.0, 7056.0, 3528.0))
"""One leg, two, and one."""


def _air_driver(fault: Fault, at_s: float = 0.0, share: float = 1.0, seed: int = 1) -> FaultyRig:
    air = air_regulators(AIR_RIG.air.scaled(share, share), AIR_RIG.chambers_mm3)
    return FaultyRig(fault, 0, at_s, 0.0, seed, AIR_RIG, air)


@pytest.mark.parametrize("name", FAULTS)
def test_what_breaks_where_air_flows_is_found_in_time(name: str, tmp_path: Path) -> None:
    """As above, but the band closes as late as the slowest valve fills one leg: 1.45 s from 0 to
    90 kPa with 0.6 of the conductance."""
    for at_s in (0.4, 2.1, 3.7, 5.2):
        driver = _air_driver(FAULTS[name](), at_s)
        report = _run(ExpertGait(duration_s=12.0), driver, tmp_path, AIR_RIG)
        assert not report.completed
        assert report.vented
        assert report.ended_s > at_s
        assert report.reason.startswith("channel 1 ")
        assert _longest_off_s(_before_the_end(driver, report)) < FOUND_S + 1.45


HELD = HeldGait(np.array([0.0, 1.0]), np.full((2, 3), 60.0), 3.0)
"""Inflated to its end, so that the last command alone vents."""

AFTER_THE_END: dict[str, Valve] = {
    "stuck where it is": lambda before, healthy, since_s: before,
    "stuck open at 90 kPa": _toward(90.0),
    "vents to 20 kPa only": lambda before, healthy, since_s: max(healthy, 20.0),
    "vents ten times too slowly": lambda before, healthy, since_s: before * (1.0 - STEP_S / 2.5),
}


@pytest.mark.parametrize("name", AFTER_THE_END)
@pytest.mark.parametrize("law", ["rate", "air"])
def test_a_valve_that_sticks_at_the_last_command_is_found(
    name: str, law: str, tmp_path: Path
) -> None:
    """Zero is taken, and the leg stays inflated: the run is none that ended well."""
    fault = Fault(valve=AFTER_THE_END[name])
    driver = _air_driver(fault, 3.0) if law == "air" else FaultyRig(fault, at_s=3.0, seed=1)
    report = _run(HELD, driver, tmp_path, driver.settings)
    assert not report.completed
    assert report.vented
    assert report.pressure_fell == (False, True, True)
    assert report.ended_s == pytest.approx(3.0)
    assert "s after zero was commanded" in report.reason
    assert "channel 1 still senses" in report.reason
    assert "did NOT fall: CUT THE AIR by hand" in report.ending
    log = read_log(tmp_path / "log.csv")
    assert "NOT EMPTY" in log.events[-1][1]
    assert len(log.time_s) == report.sample_count
    # It was looked at for as long as the slowest healthy regulator vents from 100 kPa.
    assert log.time_s[-1] - 3.0 < PressureWatch(driver.settings).closing_s + 0.5
    assert log.sensed_kPa[-1, 0] > 6.0


def test_healthy_valves_raise_nothing(tmp_path: Path) -> None:
    """From 0.7 of the conductance that is believed, the least that the virtual rig draws, on."""
    for number, share in enumerate((0.7, 0.85, 1.0, 1.3, 3.0)):
        for gait in (ExpertGait(phase_deg=60.0 * number), read_gait(FILES[number])[0]):
            driver = _air_driver(Fault(), share=share, seed=number)
            report = _run(gait, driver, tmp_path, AIR_RIG)
            assert report.completed, (share, report.reason)
            assert report.pressure_fell == (True, True, True)


@pytest.mark.parametrize("reading", [math.nan, math.inf, -math.inf])
def test_senseless_readings_stop_at_the_next_sample(reading: float, tmp_path: Path) -> None:
    fault = Fault(sensor=lambda usual, since_s: reading)
    report = _run(ExpertGait(duration_s=4.0), FaultyRig(fault, 1, at_s=2.03), tmp_path)
    assert "channel 2 " in report.reason
    assert "is no pressure" in report.reason
    # A sample is due every 0.1 s, and the rig's time goes in steps.
    assert report.ended_s - 2.03 < 0.1 + STEP_S


class _Confused(FaultyRig):
    """A controller that answers with a channel's neighbour, or with what was some samples ago."""

    def __init__(self, other: bool, late: int) -> None:
        super().__init__(Fault(), lag_s=0.05, seed=1)
        self._other, self._late = other, late
        self._answers: list[np.ndarray] = []

    def sense(self) -> np.ndarray:
        self._answers.append(super().sense())
        answer = self._answers[max(0, len(self._answers) - 1 - self._late)]
        return np.roll(answer, 1) if self._other else answer


@pytest.mark.parametrize(("other", "late"), [(True, 0), (False, 5), (False, 20)])
def test_answers_of_another_channel_or_of_earlier_are_found(
    other: bool, late: int, tmp_path: Path
) -> None:
    """Five samples are 0.4 s: more than the slowest healthy regulator lags."""
    report = _run(ExpertGait(phase_deg=60.0, duration_s=8.0), _Confused(other, late), tmp_path)
    assert not report.completed
    assert report.vented
    assert report.ended_s < 4.0


def test_a_reading_of_the_wrong_sign_is_found(tmp_path: Path) -> None:
    fault = Fault(sensor=lambda reading, since_s: -reading)
    report = _run(ExpertGait(), FaultyRig(fault, at_s=0.0, seed=1), tmp_path)
    assert not report.completed
    assert report.ended_s < 1.5


@pytest.mark.parametrize("kPa_per_s", [0.5, 2.0, -0.5, -2.0])
def test_a_drifting_sensor_is_found_by_its_offset(kPa_per_s: float, tmp_path: Path) -> None:
    """Not before the 5 kPa that a reading may be off, less noise; at the gait's next extreme."""
    fault = Fault(sensor=lambda reading, since_s: reading + kPa_per_s * since_s)
    report = _run(ExpertGait(), FaultyRig(fault, at_s=1.0), tmp_path)
    assert not report.completed
    offset = abs(kPa_per_s) * (report.ended_s - 1.0)
    assert 4.0 < offset < 12.0


@pytest.mark.parametrize("offset_kPa", [8.0, -8.0])
def test_a_sensor_that_is_off_by_8_kPa(offset_kPa: float, tmp_path: Path) -> None:
    fault = Fault(sensor=lambda reading, since_s: reading + offset_kPa)
    report = _run(ExpertGait(), FaultyRig(fault, at_s=0.5), tmp_path)
    assert not report.completed
    assert report.ended_s - 0.5 < 3.0


@pytest.mark.parametrize("lag_s", [0.05, 0.15])
def test_a_leak_is_found_from_11_percent_on(lag_s: float, tmp_path: Path) -> None:
    """10 of 90 kPa are missing at the gait's first crest, 2 s after its start."""
    report = _run(ExpertGait(), FaultyRig(_leak(0.11, lag_s), lag_s=lag_s), tmp_path)
    assert not report.completed
    assert "it leaks" in report.reason
    assert report.ended_s < 3.5


def test_healthy_rigs_raise_nothing_over_every_gait_that_ships(tmp_path: Path) -> None:
    """Noise, quantised commands, lags of every kind, and a leak of 3 % (2.7 of 90 kPa)."""
    gaits: list[OpenLoopGait] = [ExpertGait(phase_deg=float(p)) for p in range(0, 181, 20)]
    gaits += [read_gait(path)[0] for path in FILES]
    assert len(gaits) > 30
    for number, gait in enumerate(gaits):
        lag_s = LAGS_S[number % len(LAGS_S)]
        fault = Fault() if lag_s == 0.0 else _leak(0.03, lag_s)
        driver = FaultyRig(fault, lag_s=lag_s, seed=number)
        report = _run(gait, driver, tmp_path)
        assert report.completed, (number, report.reason)
        # The longest gaits end with all they were asked for, so the watch saw all of it.
        assert driver.residuals[-1][0] >= gait.duration_s - 1e-9
        assert report.pressure_fell == (True, True, True)
    assert np.isfinite(driver.residuals).all()
