"""What may be forgotten of an environment of another robot is told, and what it rewards."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import pneumorph as pm
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.registration import make_single_env
from pneumorph.environment.reward import RewardWeights
from pneumorph.study.training_options import quick_training

ANY: Any = pm
PLATE = Path(__file__).parents[2] / "examples/plate.toml"


def test_a_description_is_no_robot_yet() -> None:
    described = pm.RobotDescription.read(PLATE)
    said = re.escape("expected a RobotSpec such as paper_robot() or RobotDescription.read(file)")
    for make in (ANY.make_env, make_single_env):
        with pytest.raises(TypeError, match=f"robot is RobotDescription.*{said}"):
            make(design=described.usual_design, robot=described)


def test_of_a_robot_of_other_sites_a_design_must_be_named() -> None:
    described = pm.RobotDescription.read(PLATE)
    robot = described.spec()
    said = "design is None, .* with 8 sites, and plate has 6: expected a design, .* usual_design"
    with pytest.raises(ValueError, match=said):
        pm.make_env(num_envs=2, robot=robot)
    with pytest.raises(ValueError, match=said):
        make_single_env(robot=robot)
    made = pm.make_env(num_envs=2, design=described.usual_design, robot=robot)
    assert made.num_envs == 2


def test_a_design_that_the_rules_forbid_walks_with_a_warning() -> None:
    described = pm.RobotDescription.read(PLATE)
    robot, usual = described.spec(), described.usual_design
    said = re.escape("design b1.0.2.0.0.b1 is none that [designs] of ")
    for make in (ANY.make_env, make_single_env):
        with pytest.warns(UserWarning, match=f"{said}.*it has too few legs: 3"):
            make(design="b1.0.2.0.0.b1", robot=robot)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = pm.make_env(design=usual, robot=robot)
        pm.make_env(design="1.0.0.0.0.0.0.0")  # of the paper's robot no file says what may be
    with pytest.warns(UserWarning, match=said):
        made.reset(options={"designs": ["b1.0.2.0.0.b1"]})
    assert [str(each) for each in made.designs] == ["b1.0.2.0.0.b1"]


def test_pressures_that_the_supply_has_not_are_refused() -> None:
    """As every verb does; the regulators stayed at the supply's pressure, and nothing told."""
    paper = pm.paper_robot()
    air = replace(paper.physics.air, law="orifice", supply_kPa=60.0)
    robot = replace(paper, physics=replace(paper.physics, air=air))
    within = CrawlingTask(regulator_count=3, maximum_pressure_kPa=60.0)
    for make in (ANY.make_env, make_single_env):
        for task in (None, replace(within, maximum_pressure_kPa=70.0)):
            with pytest.raises(ValueError, match=r"asks for [79]0 kPa from a supply of 60 kPa"):
                make(robot=robot, task=task)
        make(robot=robot, task=within)


def test_a_design_of_another_length_is_told_once() -> None:
    """By the error, and not by a warning before it of what rules forbid."""
    robot = pm.RobotDescription.read(PLATE).spec()
    for make in (ANY.make_env, make_single_env):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(ValueError, match=r"design 1\.b1 has 2 locations, expected 6"):
                make(design="1.b1", robot=robot)


def test_the_reward_that_documents_name_is_that_of_trainings() -> None:
    assert quick_training().coopt.task.reward == RewardWeights(tilt=0.05)
    text = (Path(__file__).parents[2] / "docs/physics.md").read_text()
    assert "reward=RewardWeights(tilt=0.05)" in text


@pytest.mark.parametrize("robot", [None, PLATE])
def test_a_file_in_place_of_settings_of_a_robot_is_told(robot: Path | None, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"robot: expected a table of .*, got '.*plate\.toml'"):
        pm.train(tmp_path / "run", robot, changes={"robot": str(PLATE)})
