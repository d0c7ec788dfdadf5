"""Results of studies are saved and read back equal, and refused by file and field if damaged."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.result import load_result, result_to_dict, save_result
from pneumorph.exchange.conversion import ConvertedFile
from pneumorph.fabrication.fabricated_robot import FabricatedRobot
from pneumorph.fabrication.fabricated_solid import FabricatedSolid
from pneumorph.fabrication.parts_list import Part
from pneumorph.fabrication.tube_plan import TubeRun
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.study.deployment_result import DeployedGait, TrialOutcome
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import FittedCalibration
from pneumorph.study.made_mesh import MadeMesh
from pneumorph.study.transfer import ComparedRobot, DistanceRatio, Transfer

LINE = UsedCalibration("the published line", 4.0785, -20.361)
ROBOT = ComparedRobot(
    "B", "1.0.0.2", 8.0, (7.5, 8.5), 8.0, 0.7, 1.0, (4.0, 4.0), (3.9, 4.1), 0.1, 0.2, 0.3, None,
    0.05, DistanceRatio(1.0, None), "runs/B", "simulated_B.npz",
)  # fmt: skip
RESULTS = [
    MadeMesh("mesh.npz", 4, 1, 2.5, {"cavity": 2}, {"attachment": 3}, 0, "ab", 0.1, None),
    ConvertedFile("csv", 0.1, gait="gait.csv", duration_s=2.0, regulator_count=3),
    FabricatedRobot(
        "1.0.0.2", 2, 43.0, 43.1, 0.2, {"core": 0.0}, True, 51.0, 55.0, 46.5,
        {"hub": FabricatedSolid("hub.step", "hub.stl", 9.0, 8.9, 12, None)},
        (Part(1, "leg", 2, "each", 43.0, None),), (TubeRun(0, 22.5, 1, 90.0),), 3.0, None,
    ),
    DeployedGait(
        "gait.csv", "virtual", {"channels": [1, 2]}, 4.0, 400, "published", LINE,
        trials=(TrialOutcome(True, "completed", 4.0, True, 0.0, 0.01, 80, "trial_1", 7.5),),
    ),
    FittedCalibration(
        "calibration.json", "ab", 4.1, -20.0, None, 0.1, None, {"slope": (4.0, 4.2)},
        {"pressure": {"r_squared": 0.99}}, "published", 1.0,
    ),
    Transfer("reduced", 1.0, 8.0, None, 8.0, 1.0, 4.0, (ROBOT,), "published", LINE, 2.0),
]  # fmt: skip


@pytest.mark.parametrize("result", RESULTS, ids=lambda result: type(result).__name__)
def test_a_result_is_read_back_equal(result: Any, tmp_path: Path) -> None:
    assert load_result(type(result), save_result(tmp_path / "r.json", result)) == result


@pytest.mark.parametrize("result", RESULTS, ids=lambda result: type(result).__name__)
def test_a_damaged_summary_is_refused_by_file_and_field(result: Any, tmp_path: Path) -> None:
    lost = fields(result)[0].name
    content = {"verb": "simulate", **result_to_dict(result)}
    del content[lost]
    (tmp_path / "summary.json").write_text(json.dumps(content))
    (tmp_path / "settings.json").write_text("{}")
    with pytest.raises(ArtefactError, match=rf"summary\.json.*{lost}"):
        FinishedRun.read(tmp_path).result(type(result))
