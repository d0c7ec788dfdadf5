"""A training whose robot, designs and baseline do not go together ends before anything walks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.settings import quick_settings
from pneumorph.physics.air import Air
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_run import run_training

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"


def test_designs_of_another_robot_are_refused_before_the_baseline(tmp_path: Path) -> None:
    spec = RobotDescription.read(PLATE).spec()
    asked = layered(TrainingOptions(), [{"robot": {"described": str(PLATE)}}])
    for settings, baseline, why in (
        (quick_settings(), PhaseSweepSettings(), "8 locations and the robot 6 sites"),
        (asked.coopt, PhaseSweepSettings(), "design 1.0.0.2.2.0.0.1 has 8 locations"),
        (asked.coopt, replace(asked.baseline, design="1.0.4.0.4.0"), "to regulator 4"),
    ):
        with pytest.raises(ValueError, match=why):
            run_training(
                settings,
                RunFolder(tmp_path / "run", "coopt"),
                spec,
                baseline=replace(baseline, gait=replace(baseline.gait, regulator_count=3)),
            )
        assert not list(tmp_path.rglob("*.npz"))


def test_a_supply_below_the_tasks_pressures_is_refused_before_the_baseline(tmp_path: Path) -> None:
    spec = RobotDescription.read(PLATE).spec()
    low = replace(spec, physics=replace(spec.physics, air=Air("orifice", supply_kPa=6.0)))
    asked = layered(TrainingOptions(), [{"robot": {"described": str(PLATE)}}])
    with pytest.raises(ValueError, match="asks for 90 kPa from a supply of 6 kPa"):
        run_training(
            asked.coopt, RunFolder(tmp_path / "run", "coopt"), low, baseline=asked.baseline
        )
    assert not list(tmp_path.rglob("*.npz"))


@pytest.mark.parametrize("mirror", [True, False])
def test_mirror_images_of_legs_whose_sides_are_apart_are_told_of(
    mirror: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before anything walks, here by a training that is refused after that."""
    spec = RobotDescription.read(PLATE).spec()
    asked = layered(TrainingOptions(), [{"robot": {"described": str(PLATE)}}])
    for module in spec.modules:
        report = {**module.reduced.metadata["report"], "symmetric_mode_count": 0}
        monkeypatch.setitem(module.reduced.metadata, "report", report)
    space = asked.coopt.space if mirror else replace(asked.coopt.space, mirror="none")
    settings = replace(asked.coopt, space=space, mirror_transitions=mirror)
    folder, said = RunFolder(tmp_path / "run", "coopt"), []
    monkeypatch.setattr(folder.progress, "say", said.append)
    gait = replace(asked.baseline.gait, regulator_count=3)
    baseline = replace(asked.baseline, design="1.0.4.0.4.0", gait=gait)
    with pytest.raises(ValueError, match="to regulator 4"):
        run_training(settings, folder, spec, baseline=baseline)
    assert any("do not treat left and right alike" in note for note in said) == mirror


def test_a_file_brings_designs_regulators_and_baseline() -> None:
    """Just below the layer that names it: flags beside it win."""
    asked = layered(TrainingOptions(), [{"robot": {"described": str(PLATE)}}])
    assert asked.coopt.space == RobotDescription.read(PLATE).space
    assert asked.coopt.task.regulator_count == asked.robot.physics.regulator_count == 4
    assert asked.baseline.design == "b1.0.2.2.0.b1"
    assert asked.baseline.gait.regulator_count == 4
    changed = {"robot": {"described": str(PLATE)}, "coopt": {"space": {"maximum_legs": 5}}}
    fewer = layered(TrainingOptions(), [changed]).coopt.space
    assert fewer == replace(asked.coopt.space, maximum_legs=5)
