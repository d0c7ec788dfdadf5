"""What a search says before anything walks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.equal_designs import lost_mirror_note
from pneumorph.environment.reward import RewardWeights
from pneumorph.learn.gait_search import GaitSearchSettings
from pneumorph.learn.genetic_algorithm import GeneticSettings
from pneumorph.learn.random_search import RandomSearchSettings
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study import search as study
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings


class _WalksError(Exception):
    """What comes next walks."""


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """What a search says until it walks."""

    def instead(*_: Any, **__: Any) -> None:
        raise _WalksError

    monkeypatch.setattr(study, "run_search", instead)

    def told_of(settings: SearchSettings, robot: RobotSpec | None = None) -> list[str]:
        folder, said = RunFolder(tmp_path, "search"), list[str]()
        monkeypatch.setattr(folder.progress, "say", said.append)
        with pytest.raises(_WalksError):
            search(settings, robot or paper_robot("published"), folder)
        return [each for each in said if not each.endswith("...")]  # stages

    return told_of


def test_a_limit_below_one_generation_is_told(told: Any) -> None:
    """Of two designs of four gaits each, of three actions."""
    task = CrawlingTask(action_count=3)
    asked = {"random_design_count": 1, "gaits": GaitSearchSettings(4), "task": task, "seed": 1,
             "environment_count": 8}  # fmt: skip
    (said,) = told(SearchSettings(timesteps=23, **asked))
    assert said == (
        "24 timesteps will be made at least, and 23 are asked for: one generation is of 8 "
        "candidates, each of 3 actions in 1 world; for fewer: --random-design-count 0 in place of "
        "1, --gaits.population, now 4, or --task.action-count"
    )
    assert told(SearchSettings(timesteps=24, **asked)) == []
    assert told(SearchSettings(**asked)) == []
    (said,) = told(SearchSettings("genetic", timesteps=5, genetic=GeneticSettings(2), task=task))
    assert said.endswith("for fewer: --genetic.population, now 2, or --task.action-count")


def test_a_mirror_that_the_start_takes_away_is_told(told: Any) -> None:
    start = StartPose(heading_deg=-30.0)
    robot = paper_robot("published", Physics(start=start))
    (said,) = told(SearchSettings("random", space=DesignSpace(mirror="none")), robot)
    assert said == lost_mirror_note(DesignSpace(mirror="none"), start)
    assert said.startswith("robots start with heading -30 and roll 0 degrees, in which they are")


def test_a_mirror_that_nobody_asked_for_is_not_lost() -> None:
    none, usual, start = DesignSpace(mirror="none"), DesignSpace(), StartPose(heading_deg=90.0)
    assert lost_mirror_note(none, start, none) is None
    assert lost_mirror_note(none, StartPose(heading_deg=180.0), usual) is None
    assert lost_mirror_note(usual, start, usual) is None
    said = lost_mirror_note(none, start, usual)
    assert said is not None
    assert said.endswith("(space.mirror is none, whatever mirror of [designs] says)")


def test_designs_without_their_mirror_images_are_refused_before_anything_walks(
    tmp_path: Path,
) -> None:
    """Once the best of all were ranked only after the whole search, which had left its files."""
    settings = SearchSettings("random", timesteps=40, space=DesignSpace(exclusions=("0 1",)))
    with pytest.raises(ValueError, match="mirror"):
        search(settings, paper_robot("published"), RunFolder(tmp_path, "search"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("method", "goal"), [("gaits", "forward"), ("random", "turn_left")])
def test_searches_that_rank_no_mirror_images_need_none(
    method: Any, goal: Any, tmp_path: Path
) -> None:
    """Nor do they learn anything of a design for its image: rough ground is as good as level."""
    task = CrawlingTask(action_count=1, action_step_count=5, reward=RewardWeights(goal=goal))
    settings = SearchSettings(
        method, timesteps=8, random_design_count=1, environment_count=4, task=task,
        space=DesignSpace(exclusions=("0 1",)), gaits=GaitSearchSettings(population=4),
        random=RandomSearchSettings(population=4), finalist_count=2,
    )  # fmt: skip
    rough = Physics(ground=Ground(rough=RoughGround(roughness_mm=1.0)))
    found = search(settings, paper_robot("published", rough), RunFolder(tmp_path, "search"))
    assert found.best_design is not None
    assert not any("mirror" in note for note in found.notes)
