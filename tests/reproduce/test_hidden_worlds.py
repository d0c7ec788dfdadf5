"""Hidden worlds in which a robot fails are counted, and are no distance."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.driver import DriverError
from pneumorph.physics.pressure import PressureMap
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_pairs import Band
from pneumorph.study.virtual_reality import VirtualReality

HERE = Path(__file__).parent.parent.parent / "reproduce" / "robust"


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    names = ("hidden_worlds", "other_leg")
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(str(HERE))
    yield importlib.import_module("hidden_worlds")
    for name in names:
        sys.modules.pop(name, None)


def test_a_failure_is_below_the_band(script: Any) -> None:
    band = Band(1.0, 2.0, 3.0, 2.0, 0.5, 0)
    found = script.Coverage.of(band, [0.5, None, 2.0, 3.5])
    assert (found.share_within, found.share_below, found.share_above) == (0.25, 0.5, 0.25)
    assert found.failed == 1
    assert found.distances_cm == (0.5, None, 2.0, 3.5)


def test_a_hidden_robot_is_driven_as_its_regulators_lag(
    script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pressures come later by the world's time constant on average, and what was kept of another
    gait is not taken for that of this one."""
    driven = []

    def walked(gait: Path, _: Any, rig: Any, *__: Any) -> tuple[float, str]:
        driven.append((read_gait(gait)[0], rig))
        return 1.0, ""

    monkeypatch.setattr(script, "rig_distance_cm", walked)
    gait = HeldGait.evenly(np.array([[0.0, 0.0, 0.0], [60.0, 20.0, 0.0]]), 1.0)
    file = write_gait(tmp_path / "gait.csv", gait, {"design": "1.0.0.2.2.0.0.1"})
    worlds, robot = replace(measured_worlds(), regulator_lag_s="0.08"), RobotOptions.of("measured")
    band = Band(0.5, 1.0, 1.5, 1.0, 0.2, 0)
    found = script.covered(file, robot, worlds, band, 2, tmp_path / "work")
    assert found.share_within == 1.0
    assert [rig.seed for _, rig in driven] == [1000, 1001]
    for lagging, _ in driven:
        times = np.arange(0.025, 2.0, 0.05)
        passed = np.array([lagging.pressure_kPa(each) for each in times])
        missing = (np.array([60.0, 20.0]) - passed[20:, :2]).sum(axis=0) * 0.05
        # What is missing after one second is exp(-1 / 0.08) of it.
        np.testing.assert_allclose(missing, 0.08 * np.array([60.0, 20.0]), rtol=1e-5)
        assert not passed[:20].any()
    script.covered(file, robot, worlds, band, 2, tmp_path / "work")
    assert len(driven) == 2
    write_gait(file, HeldGait.evenly(np.full((2, 3), 30.0), 1.0), {"design": "1.0.0.2.2.0.0.1"})
    with pytest.raises(ValueError, match="was made with gait"):
        script.covered(file, robot, worlds, band, 2, tmp_path / "work")
    # A rig whose pressures follow at a rate lags by itself.
    worlds = Randomisation(regulator_lag_s="0.08")
    script.covered(file, RobotOptions.of("published"), worlds, band, 1, tmp_path / "rate")
    np.testing.assert_array_equal(driven[-1][0].pressure_kPa(1.0), [30.0, 30.0, 30.0])


def test_the_leg_of_a_hidden_robot_is_its_own(script: Any) -> None:
    """Whatever other reductions worlds may have: all else is drawn as it is with them."""
    worlds = measured_worlds((Path("nowhere.npz"),))
    rig = script.hidden_rig(worlds, 1003)
    drawn = script.draw_reality(rig, PressureMap()).world
    assert drawn.reduction == ""
    whole = [replace(rig, reality=worlds, seed=1000 + seed) for seed in range(8)]
    for each in whole:
        own = script.draw_reality(script.hidden_rig(worlds, each.seed), PressureMap()).world
        assert replace(script.draw_reality(each, PressureMap()).world, reduction="") == own
    assert {script.draw_reality(each, PressureMap()).world.reduction for each in whole} != {""}
    VirtualReality(RobotOptions.of("measured").spec(), rig, "reduced")


def test_what_stops_a_trial_is_kept(
    script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: Any) -> None:
        raise DriverError("pressure 2 lags by 30 kPa")

    monkeypatch.setattr(script, "deploy_gait", stopped)
    found = script.rig_distance_cm(Path("gait.csv"), None, None, None)
    assert found == (None, "pressure 2 lags by 30 kPa")


def test_a_signal_is_no_failure_of_the_robot(script: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: Any) -> None:
        raise DriverError("trial_1 was stopped after 0.33 s: stopped by SIGTERM; vented")

    monkeypatch.setattr(script, "deploy_gait", stopped)
    with pytest.raises(DriverError, match="SIGTERM"):
        script.rig_distance_cm(Path("gait.csv"), None, None, None)
