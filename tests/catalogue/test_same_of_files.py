"""Turns and mirrors of a robot's file: how they may be written, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import GoalName
from pneumorph.environment.reward import RewardWeights
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.settings import quick_settings
from pneumorph.physics.physics import Physics
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_run import run_training

Edited = Callable[[str, str], Path]


@pytest.mark.parametrize(
    ("written", "same"),
    [
        ('"180"', ("180",)),
        ("180", ("180",)),
        ("180.0", ("180",)),
        ("[180]", ("180",)),
        ('"mirror"', ("mirror",)),
        ('["mirror", 180]', ("mirror", "180")),
    ],
)
def test_one_may_stand_alone_and_turns_may_be_numbers(
    edited: Edited, written: str, same: tuple[str, ...]
) -> None:
    read = RobotDescription.read(edited("minimum_legs = 4", f"minimum_legs = 4\nsame = {written}"))
    assert read.designs.same == same
    expected = {"mirror": "mirror", "180": "3 4 5 0 1 2"}
    assert read.space.symmetries == tuple(expected[each] for each in same)


@pytest.mark.parametrize("written", ["true", "[true]", "{ turn = 180 }", '"72 degrees"'])
def test_what_is_neither_is_refused(edited: Edited, written: str) -> None:
    path = edited("minimum_legs = 4", f"minimum_legs = 4\nsame = {written}")
    with pytest.raises(ArtefactError, match=r"edited\.toml: .*designs\.same.*expected"):
        RobotDescription.read(path)


def test_rules_that_a_turn_breaks_name_it_as_the_file_does(edited: Edited) -> None:
    path = edited(
        "minimum_legs = 4", 'minimum_legs = 4\nmirror = false\nexclusions = ["0 1"]\nsame = ["180"]'
    )
    with pytest.raises(ArtefactError, match="the symmetry '180' takes locations 0 and 1"):
        RobotDescription.read(path)


def test_a_site_that_is_elsewhere_and_turned_is_told_at_once(edited: Edited) -> None:
    path = edited(
        "position_mm = [0, -46, 36]\nyaw_deg = -90", "position_mm = [5, -46, 36]\nyaw_deg = -75"
    )
    with pytest.raises(ArtefactError, match=r"site is 4, 5 mm away and turned by 15 degrees\)"):
        RobotDescription.read(path)


@pytest.mark.parametrize(
    ("slope_deg", "goal", "said"),
    [
        (3.0, "turn_left", r"under '90' \(which takes .*\), a turn about z, .* floor has a slope"),
        (
            0.0,
            "forward",
            r"goal 'forward' tells them apart, .* leave '90' \(.*\) out of designs.same",
        ),
    ],
)
def test_a_floor_or_a_goal_that_is_another_when_turned_is_refused_by_the_turn(
    slope_deg: float, goal: GoalName, said: str, tmp_path: Path
) -> None:
    """By trainings and searches, which learn of one design from another."""
    spec = paper_robot("published", Physics(floor_slope_deg=slope_deg))
    space = DesignSpace(mirror="none", symmetries=("2 3 4 5 6 7 0 1",))
    task = CrawlingTask(reward=RewardWeights(goal=goal))
    asked = SearchSettings(space=space, task=task)
    with pytest.raises(ValueError, match=said):
        search(asked, spec, study_folder(tmp_path / "search", "search"))
    settings = replace(quick_settings(), space=space, task=task, mirror_transitions=False)
    folder = study_folder(tmp_path / "coopt", "coopt")
    with pytest.raises(ValueError, match=said):
        run_training(settings, folder, spec, baseline=PhaseSweepSettings())
