"""A gait that was learned for a task of one's own, as deployment and comparison tell of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.study import deployed_gait
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployed_robot import DeployedRobot
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.gait_source import GaitSource, find_gait


def test_both_name_the_task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def found(*asked: Any) -> GaitSource:
        return replace(find_gait(*asked), own_task="Diagonal")

    monkeypatch.setattr(deployed_gait, "find_gait", found)
    gait = ExpertGait(period_s=1.0, duration_s=1.0)
    settings = DeploymentSettings(expert=gait, trials=1, model="reduced")
    folder = RunFolder(tmp_path / "A", "deploy")
    told = deploy_gait(None, settings, RobotOptions.of("published"), folder)
    assert any("was learned for the task Diagonal" in note for note in told.notes)
    folder.save_settings({})
    folder.save_summary({"learned_for": told.learned_for})
    notes: list[str] = []
    robot = DeployedRobot.read("A", folder.path, VideoSettings(), 1.0, notes)
    assert robot.learned_for == "Diagonal"
    assert any(note.startswith("A was learned for the task Diagonal") for note in notes)
