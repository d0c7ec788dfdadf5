"""Verbs say which of a robot's legs their calibration was not measured on."""

from __future__ import annotations

from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.calibration_check import bent_leg
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.study.baseline import baseline


def test_an_experts_sweep_says_which_legs_were_not_measured(tmp_path: Path) -> None:
    spec = RobotDescription.read(Path(__file__).parents[2] / "examples/plate.toml").spec()
    source = {"pressure": {"bent": bent_leg(spec.modules[0])}}
    measured = spec.calibrated(Calibration(PressureMap(1.1, 0.0), source=source))
    gait = ExpertGait(period_s=1.0, duration_s=1.0, regulator_count=4)
    sweep = PhaseSweepSettings("b1.0.2.2.0.b1", 0.0, 0.0, gait=gait)
    found = baseline(measured, sweep, RunFolder(tmp_path, "baseline"))
    (note,) = measured.calibration_notes
    assert found.notes[0] == note
    assert "pressures were measured of" in note
