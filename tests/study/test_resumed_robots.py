"""What is resumed walks with the hub and on the map that it began with."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_robot import paper_hub, paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import quick_settings
from pneumorph.physics.ground import Ground
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.study import learned_again as again
from pneumorph.study import search as searching
from pneumorph.study import training_run
from pneumorph.study.learned_again import LearnedAgain, Trained, learned_again
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.training_run import run_training
from pneumorph.study.training_worlds import TrainingWorlds

_SPACE = DesignSpace(mirror="none")  # of robots on a map, whose images are others


class _AskedError(Exception):
    """What it is compared by is known."""


def _robots(folder: Path) -> list[Callable[[], RobotSpec]]:
    """The usual one, one of another hub, and two on maps of one name."""
    usual, file = paper_robot("published"), folder / "map.npy"

    def on_map(height_mm: float) -> RobotSpec:
        np.save(file, np.full((4, 4), height_mm))
        os.utime(file, ns=(int(height_mm), int(height_mm)))
        physics = replace(usual.physics, ground=Ground(HeightMap(file)))
        return replace(usual, physics=physics)

    return [
        lambda: usual,
        lambda: replace(usual, hub=paper_hub(Masses(hub_mass_g=40.0))),
        lambda: on_map(1.0),
        lambda: on_map(2.0),
    ]


def test_a_search_and_a_training_are_of_one_hub_and_one_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[dict[str, Any]] = []

    def searched(*_: Any, description: dict[str, Any], **__: Any) -> None:
        told.append(description)
        raise _AskedError

    def refused(_: Any, __: Any, provenance: dict[str, Any]) -> None:
        told.append(provenance)
        raise _AskedError

    monkeypatch.setattr(searching, "run_search", searched)

    def walked(*_: Any) -> None:
        raise AssertionError("robots walk before settings are compared")

    monkeypatch.setattr(training_run, "refuse_other_settings", refused)
    monkeypatch.setattr(training_run, "learning_robots", walked)
    settings = replace(quick_settings(), space=_SPACE, mirror_transitions=False)
    method = SearchSettings(method="random", timesteps=32, environment_count=4, space=_SPACE)
    for make in _robots(tmp_path):
        robot = make()
        with pytest.raises(_AskedError):
            search(method, robot, RunFolder(tmp_path / "search", "search"))
        with pytest.raises(_AskedError):
            run_training(
                settings, RunFolder(tmp_path / "run", "coopt"), robot, baseline=PhaseSweepSettings()
            )
    for study in (told[::2], told[1::2]):
        usual, hub, low, high = study
        assert {"hub_mass", "map_digest"}.isdisjoint(usual)  # as earlier versions have it
        assert hub == {**usual, "hub_mass": hub["hub_mass"]}
        assert low != high
        assert {**low, "map_digest": None} == {**high, "map_digest": None}


def test_what_is_trained_on_drawn_ground_that_it_is_lifted_above_is_told_from_earlier_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot's own ground is a plane, as that of one whose worlds have it is."""
    told: list[dict[str, Any]] = []

    def asked(*given: Any, description: dict[str, Any] | None = None, **_: Any) -> None:
        told.append(given[-1] if description is None else description)
        raise _AskedError

    monkeypatch.setattr(searching, "run_search", asked)
    monkeypatch.setattr(training_run, "refuse_other_settings", asked)
    monkeypatch.setattr(again, "study_once", lambda _, __, what, *___, **____: asked(what))
    usual = paper_robot("published")
    lifted = replace(usual, physics=replace(usual.physics, start=StartPose(lift_mm=5.0)))
    settings = replace(quick_settings(), space=_SPACE, mirror_transitions=False)
    objective = Objective(worlds_per_design=2)
    method = SearchSettings(
        method="random", timesteps=64, environment_count=4, space=_SPACE, objective=objective
    )
    for drawn in ("0", "U(0, 4)"):
        worlds = TrainingWorlds(Randomisation(ground_roughness_mm=drawn))
        with pytest.raises(_AskedError):
            search(
                method,
                lifted,
                RunFolder(tmp_path / "search", "search"),
                randomisation=worlds.randomisation,
            )
        folder = RunFolder(tmp_path / "run", "coopt")
        with pytest.raises(_AskedError):
            run_training(settings, folder, lifted, baseline=PhaseSweepSettings(), worlds=worlds)
        with pytest.raises(_AskedError):
            learned_again(Trained(tmp_path, settings, worlds), lifted, [], folder)
        has_ground = drawn != "0"
        searched, trained, finetuned = told[-3:]
        assert ("lifted" in searched, "lifted" in trained) == (has_ground, has_ground)
        lift = {"lifted": "above the ground"} if has_ground else None
        assert finetuned["hub_and_map"] == lift


def test_gaits_are_learned_again_for_one_hub_one_map_and_one_stepper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folders of earlier versions, which say nothing of them, are of the usual hub."""
    found = LearnedAgain((), 0, 0.0)
    whole = again.study_once

    def once(*asked: Any, **options: Any) -> LearnedAgain:
        folder, kind, what, _ = asked
        return whole(folder, kind, what, lambda: found, **options)

    monkeypatch.setattr(again, "study_once", once)
    trained = Trained(tmp_path, quick_settings(), TrainingWorlds(Randomisation()))
    robots = _robots(tmp_path)

    def learned(robot: RobotSpec, name: str) -> LearnedAgain:
        return learned_again(trained, robot, [], RunFolder(tmp_path / name, "finetune"))

    usual, heavy = robots[0](), robots[1]()
    stepped = replace(usual, stepper=StepperSettings(linearised="start"))
    assert learned(usual, "usual") == learned(robots[2](), "map") == found
    for robot, name, why in (
        (heavy, "usual", "hub_and_map is None there"),
        (stepped, "usual", "stepper"),
        (robots[3](), "map", "hub_and_map"),
    ):
        with pytest.raises(ValueError, match=f"holds a run of other settings .{why}"):
            learned(robot, name)
    settings = tmp_path / "usual" / "settings.json"
    kept = json.loads(settings.read_text())
    for name in ("hub_and_map", "stepper", "reductions"):
        del kept[name]
    settings.write_text(json.dumps(kept))
    assert learned(usual, "usual") == found
    with pytest.raises(ValueError, match="hub_and_map is None there and"):
        learned(heavy, "usual")
