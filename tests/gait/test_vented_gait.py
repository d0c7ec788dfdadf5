"""Regulators without a leg are vented, whatever a gait says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.vented_gait import VentedGait
from pneumorph.robot.design import Design
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_settings import DeploymentSettings

LEARNED = Path(__file__).parents[2] / "examples/gaits/learned.csv"


def test_pressures_of_a_designs_regulators_stay() -> None:
    held = HeldGait.evenly(np.full((4, 3), 50.0))
    gait = VentedGait.of(held, Design.parse("0.2.0.2+3"))
    assert (gait.regulator_count, gait.duration_s) == (3, 4.0)
    assert gait.pressure_kPa(1.5).tolist() == [0.0, 50.0, 50.0]


def test_a_deployment_blows_through_no_outlet_without_a_leg(tmp_path: Path) -> None:
    gait, comments = read_gait(LEARNED)
    assert comments["design"] == "0.0.0.1.1.2.0.0"
    assert gait.held_kPa[:, 2].max() > 80.0  # what its policy said of a regulator without a leg
    settings = DeploymentSettings(dry_run=True)
    deploy_gait(LEARNED, settings, RobotOptions.of("published"), RunFolder(tmp_path, "deploy"))
    planned, _ = read_gait(tmp_path / "schedule.csv", 0.0, np.inf)
    assert planned.held_kPa[:, 2].max() == 0.0
    assert planned.held_kPa[:, 0].max() == pytest.approx(gait.held_kPa[:, 0].max(), abs=1.0)
