"""Finite elements of an evaluation are walked once; what was recorded before is shown no longer."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.boxes import box_robot
from helpers.run_folders import write_run

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run as run_verb
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.objective import Objective
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study import evaluation
from pneumorph.study.evaluation import EvaluationSettings, _one_by_one, evaluate
from pneumorph.study.finished_run import Pair
from pneumorph.study.search_options import SearchOptions
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.training_options import TrainingOptions
from pneumorph.trajectory import Trajectory

GAIT = HeldGait.evenly(np.array([[20.0, 0.0], [5.0, 30.0]]), 0.04)
PAIRS = [Pair(Design.parse(each), "", GAIT, None, None) for each in ("1.2", "2.1")]
TASK = CrawlingTask(settling_step_count=2)


def _walk(spec: Any, folder: Path, pairs: Sequence[Pair] = PAIRS) -> list[float | None]:
    found = _one_by_one(spec, pairs, TASK, "full", RunFolder(folder, "evaluate"))
    return [each.distance_cm for each in found]


@pytest.fixture
def walked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Designs that walk."""
    told: list[str] = []
    whole = evaluation.recorded_walk

    def counted(spec: Any, design: Design, *asked: Any, **settings: Any) -> Trajectory:
        told.append(str(design))
        return whole(spec, design, *asked, **settings)

    monkeypatch.setattr(evaluation, "recorded_walk", counted)
    return told


def test_pairs_that_walked_as_finite_elements_are_read_after_a_stop(
    tmp_path: Path, walked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, counted = box_robot(), evaluation.recorded_walk

    def stopped(robot: Any, design: Design, *asked: Any, **settings: Any) -> Trajectory:
        if str(design) == "2.1":
            raise KeyboardInterrupt
        return counted(robot, design, *asked, **settings)

    with monkeypatch.context() as patch:
        patch.setattr(evaluation, "recorded_walk", stopped)
        with pytest.raises(KeyboardInterrupt):
            _walk(spec, tmp_path)
    found = _walk(spec, tmp_path)
    assert walked == ["1.2", "2.1"]
    assert _walk(spec, tmp_path) == found
    assert _walk(spec, tmp_path, PAIRS[::-1]) == found[::-1]
    assert walked == ["1.2", "2.1"]
    first = Trajectory.load(tmp_path / "trajectory_full_L1.npz")
    assert first.metadata["design"] == "2.1"  # as they are asked for now
    # Another robot walks, and so does the same one behind other commands.
    _walk(replace(spec, physics=replace(spec.physics, friction=0.3)), tmp_path)
    other = replace(PAIRS[0], gait=HeldGait.evenly(GAIT.held_kPa + 1.0, 0.04))
    _walk(spec, tmp_path, [other])
    assert walked[2:] == ["1.2", "2.1", "1.2"]


def test_a_walk_that_cannot_be_saved_keeps_its_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def recorded(*asked: Any, **settings: Any) -> Trajectory:
        assert settings["keep_checkpoint"]
        checkpoint = asked[4]
        checkpoint.write_bytes(b"the way so far")
        return whole(*asked[:4], tmp_path / "other.npz", **settings)

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    whole = evaluation.recorded_walk
    monkeypatch.setattr(evaluation, "recorded_walk", recorded)
    with monkeypatch.context() as patch:
        patch.setattr(Trajectory, "save", full)
        with pytest.raises(OSError, match="no space left"):
            _walk(box_robot(), tmp_path, PAIRS[:1])
    (kept,) = tmp_path.rglob("*_on_its_way.npz")
    assert kept.read_bytes() == b"the way so far"
    _walk(box_robot(), tmp_path, PAIRS[:1])
    assert not kept.exists()


def test_what_an_earlier_evaluation_recorded_is_removed(tmp_path: Path) -> None:
    """Its own files alone, of reduced robots; finite elements took hours, and are put aside.
    Nothing where the evaluation is refused."""
    options = replace(TrainingOptions(), robot=RobotOptions.of("published"))
    task = replace(options.coopt.task, action_count=2)
    asked = replace(options, coopt=replace(options.coopt, task=task))
    run = write_run(tmp_path / "run", "coopt", asked)
    folder = RunFolder(tmp_path / "evaluation", "evaluate")
    evaluate(run, EvaluationSettings(record=True), folder=folder)
    old = [folder / name for name in ("trajectory_reduced_L9.npz", "replay.html")]
    others = [folder / name for name in ("trajectory_of_mine.npz", "notes.html")]
    full = folder / "trajectory_full_L2.npz"
    for file in (*old, *others, full):
        file.write_text("")
    strong = replace(asked.robot.spec().physics.air, law="orifice", supply_kPa=1.0)
    weak = replace(asked.robot.spec(), physics=replace(asked.robot.spec().physics, air=strong))
    with pytest.raises(ValueError, match="supply"):
        evaluate(run, robot=weak, folder=folder)
    assert all(file.exists() for file in (*old, folder / "trajectory_reduced_L1.npz"))
    evaluate(run, folder=folder)
    assert not any(file.exists() for file in (*old, folder / "trajectory_reduced_L1.npz"))
    assert all(file.exists() for file in others)
    assert not full.exists()
    assert (folder / "earlier" / full.name).exists()


def test_pairs_of_a_search_over_worlds_need_not_repeat_its_means(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once physics, leg or machine were said to differ; worlds are drawn from the search's own."""
    asked = SearchOptions(
        search=SearchSettings(
            "random", task=CrawlingTask(action_count=2), objective=Objective(worlds_per_design=4)
        ),
        robot=RobotOptions.of("published", threads=1),
        randomisation=Randomisation(friction="0.4", mass_factor="1.1"),
    )
    run = write_run(tmp_path / "run", "search", asked)
    notes = " ".join(evaluate(run, folder=RunFolder(tmp_path / "alone", "evaluate")).notes)
    assert "the run reported distances in worlds drawn at random" in notes
    assert "machine differ" not in notes
    out = tmp_path / "in_worlds"
    assert run_verb(f"evaluate {run} --randomize --world-count 2 --out {out}".split()) == 0
    assert "leg, physics and worlds of" in capsys.readouterr().err
    drawn = json.loads((out / "summary.json").read_text())["robustness"]["distributions"]
    assert (drawn["friction"], drawn["mass_factor"]) == ("0.4", "1.1")
