"""A task of one's own: what it rewards, and a run of it that verbs take."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import own_task
import pytest
from gymnasium.spaces import Box
from helpers.published_plate import published_plate

import pneumorph as pm
from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.environment.goal import FORWARD
from pneumorph.environment.registration import make_env
from pneumorph.environment.training_environment import TrainingEnvironment
from pneumorph.learn.settings import CooptSettings
from pneumorph.report.explorer.scored_designs import scored_by_training
from pneumorph.study import training_run
from pneumorph.study.certified_candidates import own_task_notes
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import PRESETS, train_as_asked

TASK = {"action_count": 4, "action_step_count": 100}  # as long as a period of the expert
TINY = {
    "coopt": {
        "environment_count": 4,
        "total_timesteps": 32,
        "learning_start_timestep": 16,
        "updates": 1,
        "evaluated_design_count": 2,
        "kept_pair_count": 2,
        "task": TASK,
        "sac": {"hidden_sizes": [16, 16], "batch_size": 8},
        "schedule": {"decay_start_timestep": 16, "decay_end_timestep": 32},
    },
    "baseline": {"first_phase_deg": 60, "last_phase_deg": 60, "gait": {"duration_s": 4}},
}


class Tall(pm.TaskWrapper):
    """Observes one number, which has no place for the design."""

    single_observation_space = Box(0.0, 1.0, (1,), np.float32)  # type: ignore[assignment]


class Stepping(Tall):
    """Might reward anything."""

    def step(self, actions: np.ndarray) -> tuple[Any, ...]:  # type: ignore[override]
        return super().step(actions)


class Shapeless(pm.TaskWrapper):
    """Its term has one amount, whatever the robots do."""

    terms = (pm.RewardTerm("nothing", "cm", 1.0, lambda motion: np.float64(0.0)),)


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plate's file."""
    path = tmp_path_factory.mktemp("plate") / "plate.toml"
    path.write_text(published_plate())
    return path


@pytest.fixture(scope="module")
def trained(plate: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the plate, made from Python."""
    out = tmp_path_factory.mktemp("straight") / "run"
    own_task.main(["--robot", str(plate), "--out", str(out)], **TINY)
    return out


def test_turning_costs_what_it_says() -> None:
    """The same commands with and without the task: rewards differ by a tenth of what the robot
    turns, and the turns add up to its heading. A robot with two legs on one side turns."""
    task = pm.CrawlingTask(**TASK)
    robot = pm.paper_robot("published")
    usual, own = (make_env(design="1.1.2.0.0.0.0.0", robot=robot, task=task) for _ in range(2))
    wrapped: TrainingEnvironment = own_task.Straight(own)
    actions = [np.full((1, 3), value, np.float32) for value in (0.8, -0.5, 0.9)]
    usual.reset()
    wrapped.reset()
    turned_deg, began_deg = [], []
    for action in actions:
        plain, straight = usual.step(action), wrapped.step(action)
        turned_deg.append(float(usual.motion.moved.turn_deg[0]))
        began_deg.append(float(usual.motion.before.heading_deg[0]))  # it turns as it settles, too
        cost_cm = 0.1 * abs(turned_deg[-1])
        assert plain[1] - straight[1] == pytest.approx(cost_cm, abs=1e-12)
        assert straight[4]["turning_cm"] == pytest.approx(-cost_cm, abs=1e-12)
        np.testing.assert_array_equal(plain[0], straight[0])
    now_deg = usual.simulator.heading_deg[0]
    assert now_deg == pytest.approx(began_deg[0] + sum(turned_deg), abs=1e-9)
    assert abs(sum(turned_deg)) > 0.1  # it turned


def test_a_run_from_python_is_a_run_of_coopt(
    plate: Path, trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = json.loads((trained / "summary.json").read_text())
    assert summary["verb"] == "coopt"
    assert summary["own_task"] == "Straight"
    told = "reward of Straight (distance less 0.1 x turning (degrees))"
    assert summary["ranked_by"] == told
    assert any(pair["score_cm"] < pair["distance_cm"] for pair in summary["pairs"])
    # A finished run is read, and is of one task alone.
    again = own_task.main(["--robot", str(plate), "--out", str(trained)], **TINY)
    assert [pair.design for pair in again.pairs] == [pair["design"] for pair in summary["pairs"]]
    with pytest.raises(ValueError, match="own_task Straight, expected None"):
        pm.train(trained, plate, changes=TINY)
    monkeypatch.setattr(own_task.Straight, "terms", (replace(own_task.TURNING, cm_per_unit=-0.5),))
    with pytest.raises(ValueError, match=r"Straight asks for .* less 0.5 x turning \(degrees\)"):
        own_task.main(["--robot", str(plate), "--out", str(trained)], **TINY)
    monkeypatch.setattr(own_task.Straight, "terms", ())
    with pytest.raises(ValueError, match="Straight asks for reward of Straight;"):
        own_task.main(["--robot", str(plate), "--out", str(trained)], **TINY)


def test_a_forgotten_task_is_told_before_any_setting(
    plate: Path, trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a finished training, of one that was stopped, and of one that goes on by `coopt`."""
    said = (
        "holds a training with own_task Straight, expected None: it was trained on the task "
        "Straight, and the package's task is asked for; pass that task to pm.train, "
        "own_task=Straight, since no file of the run holds it, or choose another folder"
    )
    other: dict[str, Any] = {**TINY, "coopt": {**TINY["coopt"], "seed": 7}}
    with pytest.raises(ValueError, match=re.escape(said)):
        pm.train(trained, plate, changes=other)
    shown = shutil.copytree(trained, tmp_path / "demo")
    summary = json.loads((shown / "summary.json").read_text())
    (shown / "summary.json").write_text(json.dumps({**summary, "verb": "demo"}))
    with pytest.raises(ValueError, match=re.escape(said)):
        pm.train(shown, plate, changes=other)
    stopped = shutil.copytree(trained, tmp_path / "run")
    (stopped / "summary.json").unlink()
    with pytest.raises(ValueError, match=re.escape(said)):
        pm.train(stopped, plate, changes=other)

    def walks(*_: Any) -> None:
        raise AssertionError("robots walk before settings are compared")

    monkeypatch.setattr(training_run, "learning_robots", walks)
    asked = layered(PRESETS["quick"](), [{"robot": {"described": str(plate)}}, other])
    for folder in (trained, stopped):
        with pytest.raises(ValueError, match=re.escape(said)):
            train_as_asked(replace(asked, resume=True), RunFolder(folder, "coopt"))
    crooked = type("Crooked", (own_task.Straight,), {})
    with pytest.raises(ValueError, match="on the task Straight, and Crooked is asked for"):
        pm.train(trained, plate, changes=TINY, own_task=crooked)


def test_a_run_of_another_leg_is_not_read_as_one_of_this(
    plate: Path, trained: Path, tmp_path: Path
) -> None:
    """What ships may have changed since it was made."""
    copy = shutil.copytree(trained, tmp_path / "run")
    summary = json.loads((copy / "summary.json").read_text())
    summary["leg"]["mode_count"] += 8
    (copy / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(ValueError, match="training on another reduction of its legs"):
        own_task.main(["--robot", str(plate), "--out", str(copy)], **TINY)


@pytest.mark.parametrize(
    "arguments",
    [
        "evaluate {run} --pair-count 1",
        "analyse {run}",
        "certify {run} --pair-count 1 --world-count 4 --tuning-world-count 1",
        "explore {run}",
        "report {run} --figure-files",
        "watch {run} --once",
        "replay {run}/best_trajectory.npz",
    ],
)
def test_verbs_take_it(trained: Path, arguments: str, tmp_path: Path) -> None:
    copy = shutil.copytree(trained, tmp_path / "run")
    asked = arguments.format(run=copy).split()
    if asked[0] not in ("report", "watch", "explore"):  # which write into the run
        asked += ["--out", str(tmp_path / "out")]
    assert run(asked) == 0


def test_verbs_say_that_they_do_not_rank_by_it(trained: Path, tmp_path: Path) -> None:
    told = "ranked by distance: Straight, the task that was learned, is in no file of the run"
    for verb, asked in (("evaluate", "--pair-count 1"), ("certify", "--world-count 6")):
        out = tmp_path / verb
        assert run([verb, str(trained), *asked.split(), "--out", str(out)]) == 0
        assert told in json.loads((out / "summary.json").read_text())["notes"]
    # A certificate keeps the order of a training that ranked over worlds.
    (kept,) = own_task_notes("Straight", FORWARD, trained=True)
    assert kept == "ranked as in the training, by the reward of Straight; told is distance"
    page = tmp_path / "page"
    assert run(["report", str(trained), "--figure-files", "--out", str(page)]) == 0
    written = (page / "page.html").read_text()
    assert "<th>score (cm)</th>" in written
    assert "A robot learned the task Straight" in written
    assert "The task Straight is no setting" in written
    assert "What is grey is the reward of Straight in cm" in written
    assert "coopt --settings" not in written


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (3, "own_task is 3, expected a function or a class"),
        (lambda environment: None, "returns None, expected a TrainingEnvironment"),
        (Tall, "observations of shape .1,., expected a state and then"),
        (Shapeless, r"the term 'nothing' has amounts of shape \(\), expected \(4,\)"),
    ],
)
def test_what_is_no_task_is_refused_before_anything_walks(
    wrong: Any, message: str, plate: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    with pytest.raises(ValueError, match=message):
        pm.train(out, plate, changes=TINY, own_task=wrong)
    assert not list(out.glob("*.npz"))


def test_designs_that_count_as_one_have_the_same_goal_whatever_is_added_to_its_reward(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Terms add to the usual reward; what a `step` of one's own rewards is not known here."""
    robot = Path(__file__).parents[2] / "examples/two_chambers.toml"  # its same has a turn by 90
    with pytest.raises(ValueError, match="goal 'forward' tells them apart"):
        pm.train(tmp_path / "added", robot, changes=TINY, own_task=own_task.Straight)
    with pytest.raises(ValueError, match="has observations of shape"):
        pm.train(tmp_path / "own", robot, changes=TINY, own_task=Stepping)
    assert "Stepping is taken to reward designs alike that count as one" in capsys.readouterr().err


def test_that_mirror_images_are_taken_to_be_rewarded_alike_is_told(
    plate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match="has observations of shape"):
        pm.train(tmp_path / "run", plate, changes=TINY, own_task=Tall)
    assert "Tall is taken to reward a robot and its mirror image alike" in capsys.readouterr().err


class ToTheLeft(pm.TaskWrapper):
    """Forward, and to the left."""

    terms = (
        pm.RewardTerm("left", "mm", 0.1, lambda motion: motion.moved.left_mm, depends_on_side=True),
    )


def test_scores_of_a_task_that_rewards_a_side_count_for_the_design_alone(
    plate: Path, trained: Path, tmp_path: Path
) -> None:
    """Also where verbs read them."""
    out = tmp_path / "left"
    found = pm.train(out, plate, changes=TINY, own_task=ToTheLeft)
    assert found.ranked_by == "reward of ToTheLeft (distance plus 0.1 x left (mm))"
    for folder, symmetric in ((trained, True), (out, False)):
        kept = FinishedRun.read(folder)
        settings = kept.structured("coopt", CooptSettings)
        assert settings.mirror_transitions
        assert settings.mirrored_scores == symmetric
        scores = scored_by_training(kept).score_cm
        walked = np.flatnonzero(np.isfinite(scores))
        images = settings.space.images(walked)[0]
        assert np.isfinite(scores[images]).all() == symmetric
    for verb in ("explore", "report --figure-files", "watch --once"):
        asked = verb.split()
        assert run([asked[0], str(out), *asked[1:]]) == 0
