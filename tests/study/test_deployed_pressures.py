"""What is told of a deployment whose pressures were converted for another calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.calibration import NOT_CALIBRATED, UsedCalibration
from pneumorph.robot.design import Design
from pneumorph.study.deployed_robot import DeployedRobot

OURS = UsedCalibration("the published line", 4.0785, -20.361)
THEIRS = UsedCalibration("runs/c/calibration.json", 3.813, -20.4, digest="abc")


def notes_of(folder: Path, theirs: UsedCalibration | None, ours: UsedCalibration) -> list[str]:
    gait = HeldGait(np.zeros(1), np.zeros((1, 3)), 1.0)
    summary: dict[str, Any] = {"verb": "deploy", "design": "1.0.0.2.2.0.0.1"}
    if theirs is not None:
        summary["calibration"] = vars(theirs)
    (folder / "summary.json").write_text(json.dumps(summary))
    (folder / "settings.json").write_text("{}")
    deployed = DeployedRobot("L", folder, gait, Design.parse(summary["design"]), ())
    return deployed.other_pressures(ours)


def test_pressures_for_another_calibration_are_told(tmp_path: Path) -> None:
    (told,) = notes_of(tmp_path, THEIRS, OURS)
    assert told.startswith(
        "L was deployed with runs/c/calibration.json (slope 3.813, intercept -20.4 kPa)"
    )
    assert "simulated with the published line (4.079, -20.36 kPa)" in told
    assert "--calibration runs/c/calibration.json" in told
    (told,) = notes_of(tmp_path, THEIRS, replace(OURS, file=NOT_CALIBRATED, slope=1.0))
    assert "and is simulated without a calibration (1, -20.36 kPa)" in told
    (told,) = notes_of(tmp_path, replace(OURS, digest="abc", modulus_factor=1.2), OURS)
    assert "(slope 4.079, intercept -20.36 kPa, modulus factor 1.2)" in told


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [
        (THEIRS, replace(THEIRS, file="elsewhere/calibration.json")),
        (
            replace(OURS, digest="abc", slope=4.8942, intercept_kPa=-24.4332, modulus_factor=1.2),
            OURS,
        ),
        (replace(OURS, digest="abc", slope=4.07852, intercept_kPa=-20.3627), OURS),
        (replace(THEIRS, digest=None), OURS),
        (None, OURS),
    ],
    ids=[
        "the same file moved",
        "a modulus scaled alike",
        "a line that is hardly another",
        "as the gait has them",
        "unknown",
    ],
)
def test_of_pressures_that_are_the_simulation_s_nothing_is_told(
    theirs: UsedCalibration | None, ours: UsedCalibration, tmp_path: Path
) -> None:
    assert notes_of(tmp_path, theirs, ours) == []


def test_of_a_folder_without_a_summary_nothing_is_told(tmp_path: Path) -> None:
    gait = HeldGait(np.zeros(1), np.zeros((1, 3)), 1.0)
    deployed = DeployedRobot("L", tmp_path, gait, Design.parse("1.0.0.2.2.0.0.1"), ())
    assert deployed.other_pressures(OURS) == []
