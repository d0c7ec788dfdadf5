"""Conductances that are found again in logs, and logs that cannot tell them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.faulty_rig import push

from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.air_fit import NAMES, fit_air, simulated_kPa
from pneumorph.hardware.deployment import deploy
from pneumorph.hardware.deployment_log import COMMAND, DeploymentLog, LoggedPressures, read_log
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import plan_schedule
from pneumorph.hardware.virtual_rig import VirtualRig, VirtualRigSettings, true_air
from pneumorph.physics.air import Air
from pneumorph.physics.regulators import air_regulators
from pneumorph.simulation.randomisation import Randomisation

BELIEVED = Air(law="orifice")
CHAMBERS = (7056.0, 3528.0, 0.0)
"""Two legs, one, and none."""
WORLD = Randomisation("1", "1", "1", "0", "0").draw(np.random.default_rng(0))


def square_log(
    interval_s: float = 0.05, noise_kPa: float = 0.2, seed: int = 0, low_kPa: float = 0.0
) -> LoggedPressures:
    """One regulator of two legs between two pressures, 1.5 s each, with the believed valves.

    The commands come between samples: at 0.02 s after one.
    """
    regulator = air_regulators(BELIEVED, CHAMBERS[:1])
    time_s = interval_s * np.arange(round(6.0 / interval_s) + 1)
    changes = [0.02, 1.52, 3.02, 4.52]
    pressure, now, sensed, commanded = np.zeros(1), 0.0, [], []
    command = np.zeros(1)
    for instant in sorted([*time_s, *changes]):
        pressure = regulator.after(pressure, command, instant - now)
        now = instant
        if instant in changes:
            command = np.array([80.0 if changes.index(instant) % 2 == 0 else low_kPa])
        else:
            sensed.append(pressure[0])
            commanded.append(command[0])
    noise = noise_kPa * np.random.default_rng(seed).standard_normal(len(sensed))
    return LoggedPressures(
        time_s,
        np.array(commanded)[:, None],
        (np.array(sensed) + noise)[:, None],
        tuple((each, COMMAND) for each in changes),
    )


@pytest.mark.parametrize("start", [(0.2, 4.0), (30.0, 30.0)])
def test_a_log_without_noise_gives_the_valves_back(start: tuple[float, float]) -> None:
    """To what the derivative's step and the search's tolerance leave, wherever it begins: also with
    valves so wide that no sample tells how wide."""
    log = square_log(noise_kPa=0.0)
    found = fit_air([log], BELIEVED.scaled(*start), CHAMBERS[:1])
    assert found.air.filling_mm3_per_s_kPa[0] == pytest.approx(78.0, rel=1e-4)
    assert found.air.venting_mm3_per_s_kPa[0] == pytest.approx(1100.0, rel=1e-4)
    assert found.sample_count == len(log.time_s) - 1
    np.testing.assert_allclose(
        simulated_kPa(log, 0, found.air, CHAMBERS[0]), log.sensed_kPa[:, 0], atol=0.01
    )


def test_intervals_hold_the_valves_as_often_as_they_say() -> None:
    """40 noisy logs, two numbers each: 95 %, to 3 standard errors of a binomial."""
    held = 0
    for seed in range(40):
        found = fit_air([square_log(seed=seed)], BELIEVED, CHAMBERS[:1])
        for name in NAMES:
            low, high = found.intervals[f"{name.split('_')[0]}_1_mm3_per_s_kPa"]
            held += low < getattr(BELIEVED, name)[0] < high
    assert abs(held / 80 - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / 80)


def test_the_virtual_rigs_hidden_valves_are_found_again(tmp_path: Path) -> None:
    """Two regulators with legs, each off by draws of its own; the third keeps what was believed.
    Intervals of 95 %, widened twice for four numbers of one seed."""
    settings = VirtualRigSettings(seed=2)
    truth = true_air(settings, WORLD, BELIEVED, 3)
    rig = replace(RigSettings(), air=BELIEVED, chambers_mm3=CHAMBERS, sample_interval_s=0.02)
    gait = HeldGait.evenly(np.array([[80.0, 70.0, 0.0], [0.0, 0.0, 0.0]] * 2), 1.65)
    driver = VirtualRig(push, rig, settings, 0.0, 0.01, 1, air_regulators(truth, list(CHAMBERS)))
    with DeploymentLog(tmp_path / "log.csv", 3) as log:
        assert deploy(plan_schedule(gait, rig), driver, rig, log, driver.clock).completed
    found = fit_air([read_log(tmp_path / "log.csv")], BELIEVED, CHAMBERS)
    assert len(found.intervals) == 4
    for name in NAMES:
        for channel in (0, 1):
            low, high = found.intervals[f"{name.split('_')[0]}_{channel + 1}_mm3_per_s_kPa"]
            true, reach = getattr(truth, name)[channel], 0.5 * (high - low)
            assert low - reach < true < high + reach, (name, channel)
            assert reach < 0.05 * true
        assert getattr(found.air, name)[2] == getattr(BELIEVED, name)[0]
    # Readings have a noise of 0.2 kPa and steps of 0.1, commands too.
    assert found.rms_kPa == pytest.approx(np.sqrt(0.2**2 + 0.1**2 / 12), rel=0.1)


def _held(log: LoggedPressures, until_s: float) -> LoggedPressures:
    kept = log.time_s < until_s
    return replace(
        log,
        time_s=log.time_s[kept],
        commanded_kPa=log.commanded_kPa[kept],
        sensed_kPa=log.sensed_kPa[kept],
    )


def _lower(log: LoggedPressures, by_kPa: float) -> LoggedPressures:
    return replace(log, sensed_kPa=log.sensed_kPa - by_kPa)


@pytest.mark.parametrize(
    ("log", "chambers", "message"),
    [
        (_held(square_log(), 1.4), CHAMBERS[:1], "falls by 0 kPa in all.*the log shows no venting"),
        (
            replace(square_log(), commanded_kPa=np.zeros((121, 1))),
            CHAMBERS[:1],
            "command of regulator 1 rises by 0 kPa in all.*no filling",
        ),
        # Two legs are empty after 0.26 s, and 1.5 s are a multiple of 0.5. A sensor that reads too
        # little: noise may let an empty leg look as if it still vented.
        (
            _lower(square_log(0.5, noise_kPa=0.0), 0.1),
            CHAMBERS[:1],
            "cannot tell how fast regulator 1 is at venting",
        ),
        (
            replace(square_log(), sensed_kPa=np.full((121, 1), np.nan)),
            CHAMBERS[:1],
            "regulator 1 has no sensed pressure",
        ),
        (square_log(), CHAMBERS, "the logs have 1 channels, the robot 3 regulators"),
    ],
    ids=["no venting", "no steps", "sampled too seldom", "no sensor", "another rig"],
)
def test_logs_that_cannot_tell_are_refused(
    log: LoggedPressures, chambers: tuple[float, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        fit_air([log], BELIEVED, chambers)


def test_no_log_is_refused() -> None:
    with pytest.raises(ValueError, match="logs is empty"):
        fit_air([], BELIEVED, CHAMBERS)
