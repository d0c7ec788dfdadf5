"""What is told of measured bends that take no part in the line."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.hardware.bend_test import MonotoneBend
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.study import fitted_line
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_calibration import CalibrationStudy, calibrate
from pneumorph.study.fitted_line import with_line

REAL_KPA = np.repeat(np.arange(10.0, 91.0, 10.0), 3)
BEND_DEG = 0.3 * (4.0785 * REAL_KPA - 20.361)


def _calibrated(
    bend_deg: np.ndarray, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[CalibrationStudy, str]:
    """The study of measured bends, and what was said."""
    curve = MonotoneBend(np.linspace(0.0, 450.0, 46), np.linspace(0.0, 135.0, 46))
    monkeypatch.setattr(fitted_line, "simulated_bend_curve", lambda *_, **__: curve)
    rows = "".join(f"{p:g},{b:.4f}\n" for p, b in zip(REAL_KPA, bend_deg, strict=True))
    (folder / "bends.csv").write_text(f"pressure_kPa,bend_deg\n{rows}")
    said = io.StringIO()
    run = RunFolder(folder / "c", "calibrate", Progress(said))
    settings = CalibrationSettings(bends=folder / "bends.csv")
    return calibrate(settings, RobotOptions.of("published"), run), said.getvalue()


def test_it_is_told_how_many_bends_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, said = _calibrated(BEND_DEG, tmp_path, monkeypatch)
    assert "left out" not in said
    assert study.found.slope == pytest.approx(4.0785, rel=1e-3)
    bend_deg = np.where(np.arange(27) == 1, -0.3, BEND_DEG)
    study, said = _calibrated(bend_deg, tmp_path, monkeypatch)
    assert "3 of 27 measured bends are left out, those up to 10 kPa" in said
    assert study.found.fit["pressure"]["point_count"] == 24


def test_a_contradicting_bend_is_refused_with_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slipped = np.where(np.arange(27) == 18, -BEND_DEG, BEND_DEG)
    with pytest.raises(ValueError, match=r"bends\.csv: row 19: the bend at 70 kPa is -79"):
        _calibrated(slipped, tmp_path, monkeypatch)


def test_of_two_pressures_there_are_no_intervals(tmp_path: Path) -> None:
    """Nor those of an earlier line; what else was measured keeps its own."""
    earlier = {"slope": (3.0, 5.0), "intercept_kPa": (-30.0, -10.0), "friction": (0.4, 0.6)}
    known = Calibration(PressureMap(), friction=0.5, intervals=earlier)
    pairs, said = tmp_path / "pairs.csv", io.StringIO()
    header = "real_pressure_kPa,simulated_pressure_kPa\n"
    run = RunFolder(tmp_path / "c", "calibrate", Progress(said))
    spec = replace(RobotOptions.of("published").spec(), calibration=known)
    pairs.write_text(f"{header}20,60\n20,62\n80,300\n80,304\n")
    fitted, _ = with_line(known, CalibrationSettings(pairs=pairs), spec, run)
    assert fitted.intervals == {"friction": (0.4, 0.6)}
    assert Calibration.load(fitted.save(tmp_path / "calibration.json")).intervals == {
        "friction": (0.4, 0.6)
    }
    assert (
        "pairs.csv: the line has no confidence intervals, expected readings at" in said.getvalue()
    )
    pairs.write_text(f"{header}60,20\n182,50\n300,80\n")  # the wrong way round
    with_line(known, CalibrationSettings(pairs=pairs), spec, run)
    assert "or see whether its columns are as they are named" in said.getvalue()
    pairs.write_text(f"{header}20,60\n50,182\n80,300\n")
    fitted, _ = with_line(known, CalibrationSettings(pairs=pairs), spec, run)
    assert set(fitted.intervals) == {"friction", "slope", "intercept_kPa"}
