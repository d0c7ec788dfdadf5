"""A run that is killed and resumed ends in the same bits as one that is not."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.toy_coopt import SPACE, TASK, TIME_STEP_S, make_simulator, toy_settings

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.result import result_from_dict
from pneumorph.base.settings import load_settings
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.checkpoint import NEWEST, load_checkpoint, save_checkpoint
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import _said, learn_in_folder, refuse_other_settings
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import STAGES

SETTINGS = toy_settings(round_count=6, environment_count=4)
TIMINGS = {*(f"{stage}_s" for stage in STAGES), "other_s", "learn_and_log_share", "wall_s"}


class Killed(Exception):
    """Stands for the end of the process."""


def run(folder: Path, kill_after_round: int | None = None, **options: Any) -> CooptResult:
    def progress(done: int, total: int, message: str) -> None:
        if kill_after_round is not None and done >= (
            kill_after_round * SETTINGS.timesteps_per_round
        ):
            raise Killed

    settings = options.pop("settings", SETTINGS)
    return learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, settings),
        settings,
        folder,
        time_step_s=TIME_STEP_S,
        progress=progress,
        **options,
    )


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("straight")
    return folder, run(folder)


def test_a_choice_that_stays_wide_is_told(
    straight: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    """Scores of these designs differ by centimetres, which a large enough beta tells apart."""
    schedule = replace(SETTINGS.schedule, maximum_inverse_temperature=1e-6)
    told = run(tmp_path, settings=replace(SETTINGS, schedule=schedule)).remarks
    assert any(f"some {len(SPACE)} of them are left and not 1" in note for note in told)
    assert not any("did not narrow" in note for note in straight[1].remarks)


def assert_same_run(folder: Path, summary: CooptResult, straight: tuple[Path, CooptResult]) -> None:
    expected_folder, expected = straight
    ours, theirs = (load_checkpoint(where) for where in (folder, expected_folder))
    assert ours.arrays.keys() == theirs.arrays.keys()
    for name in ours.arrays:
        np.testing.assert_array_equal(ours.arrays[name], theirs.arrays[name], err_msg=name)
    assert ours.metadata["random_state"] == theirs.metadata["random_state"]

    def timeless(values: dict[str, Any]) -> dict[str, Any]:
        return {key: value for key, value in values.items() if key not in {*TIMINGS, "remarks"}}

    assert timeless(vars(summary)) == timeless(vars(expected))
    assert [timeless(line) for line in read_metrics(folder)] == [
        timeless(line) for line in read_metrics(expected_folder)
    ]


@pytest.mark.parametrize("round_number", [1, 4])
def test_killed_and_resumed_equals_not_stopping(
    tmp_path: Path, straight: tuple[Path, CooptResult], round_number: int
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, kill_after_round=round_number)
    summary = run(tmp_path, resume=True)
    assert_same_run(tmp_path, summary, straight)
    timestep = round_number * SETTINGS.timesteps_per_round
    assert summary.remarks == (f"resumed at timestep {timestep}",)


def test_checkpoints_come_before_the_round_that_would_go_beyond_the_interval(
    tmp_path: Path,
) -> None:
    one_round = SETTINGS.timesteps_per_round
    settings = replace(SETTINGS, checkpoint_interval_timesteps=5 * one_round // 2)
    for kill_after, kept in ((2, 2), (3, 2), (4, 4)):
        with pytest.raises(Killed):
            run(tmp_path / str(kill_after), kill_after, settings=settings)
        checkpoint = load_checkpoint(tmp_path / str(kill_after))
        assert checkpoint.metadata["timestep"] == kept * one_round


def test_a_setting_added_since_had_its_default(
    tmp_path: Path, straight: tuple[Path, CooptResult]
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, kill_after_round=3)
    checkpoint = load_checkpoint(tmp_path)
    assert checkpoint.metadata["settings"].pop("expected_scores") is False
    save_checkpoint(tmp_path, checkpoint.arrays, checkpoint.metadata)
    assert_same_run(tmp_path, run(tmp_path, resume=True), straight)


def test_truncated_checkpoint_falls_back_to_the_previous_and_says_so(
    tmp_path: Path, straight: tuple[Path, CooptResult]
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, kill_after_round=4)
    newest = tmp_path / NEWEST
    newest.write_bytes(newest.read_bytes()[:-1000])
    with pytest.warns(UserWarning, match="previous checkpoint is used"):
        summary = run(tmp_path, resume=True)
    assert_same_run(tmp_path, summary, straight)
    assert "previous checkpoint is used" in summary.remarks[0]
    one_round = SETTINGS.timesteps_per_round
    assert summary.remarks[1] == (
        f"resumed at timestep {3 * one_round}: {one_round} timesteps after the last checkpoint "
        "were lost and are made again"
    )


def test_stages_account_for_the_time(straight: tuple[Path, CooptResult]) -> None:
    _, summary = straight
    stages = [getattr(summary, f"{stage}_s") for stage in STAGES]
    assert min(stages) > 0.0
    assert 0.0 <= summary.other_s < 0.5 * summary.wall_s
    assert sum(stages) + summary.other_s == pytest.approx(summary.wall_s)
    spent = (summary.learn_s + summary.log_s) / summary.wall_s
    assert summary.learn_and_log_share == pytest.approx(spent)


def test_run_folder_holds_what_was_found(straight: tuple[Path, CooptResult]) -> None:
    folder, summary = straight
    written = json.loads((folder / "summary.json").read_text())
    assert result_from_dict(CooptResult, written) == summary
    # Beside its fields stands what follows from them.
    derived = {"best_design", "best_distance_cm", "best_gait", "best_source"}
    assert written.keys() - vars(summary).keys() == derived | {"other_s", "learn_and_log_share"}
    assert written["best_source"] == written["pairs"][0]["source"]
    assert load_settings(CooptSettings, folder / "settings.json") == SETTINGS
    assert any((folder / "tensorboard").iterdir())
    assert summary.timesteps == 6 * SETTINGS.timesteps_per_round == len(read_metrics(folder)) * 64
    gait, comments = read_gait(folder / summary.best.gait)
    assert comments["design"] == summary.best.design
    assert gait.held_kPa.shape == (16, 2)
    np.testing.assert_allclose(gait.duration_s, 16 * 12 * TIME_STEP_S)
    assert summary.best.distance_cm >= summary.policy_best_distance_cm
    policy, settings, metadata = load_policy(folder / "policy.npz")
    assert settings == SETTINGS
    assert metadata["timestep"] == summary.timesteps
    assert policy.mode(np.zeros((1, 4 + SPACE.one_hot.shape[1]), np.float32)).shape == (1, 2)


def test_other_settings_are_not_resumed(straight: tuple[Path, CooptResult]) -> None:
    folder, _ = straight
    with pytest.raises(ValueError, match="holds a training run already"):
        run(folder)
    with pytest.raises(ValueError, match=r"other settings \(.*seed 0, now 7"):
        run(folder, resume=True, settings=toy_settings(6, seed=7, environment_count=4))


def test_policy_file_of_other_layers_is_refused(
    straight: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    from pneumorph.base.artefact import load_artefact, save_artefact

    arrays, metadata = load_artefact(straight[0] / "policy.npz", "Policy", 1)
    arrays["layer_1_weight"] = arrays["layer_1_weight"][:-1]
    path = save_artefact(tmp_path / "policy.npz", "Policy", 1, arrays, metadata)
    with pytest.raises(ArtefactError, match=r"layer_1_weight of shape \(63, 64\), expected"):
        load_policy(path)


def test_legs_that_robots_learn_on_may_be_rounded_otherwise(tmp_path: Path) -> None:
    """An earlier version compared them, and a training could go on on one kind of processor
    alone: they are made anew at each start, and their last bits are its."""
    kept = {"leg": "1f", "learning_leg": "a2", "learning_points": "b3"}
    run(tmp_path, provenance=kept)
    refuse_other_settings(SETTINGS, tmp_path, {"leg": "1f"})
    with pytest.raises(ValueError, match=r"trained with other settings \(leg"):
        refuse_other_settings(SETTINGS, tmp_path, {"leg": "2f"})


def test_other_physics_is_not_resumed(tmp_path: Path) -> None:
    """Refused by the names that settings and flags have."""
    then = {"friction": 1.2, "contact_sweeps": 100}
    with pytest.raises(Killed):
        run(tmp_path, kill_after_round=2, provenance={"simulation": then})
    now = {"friction": 0.5, "contact_sweeps": 50}
    with pytest.raises(
        ValueError,
        match=r"\(stepper\.contact_sweeps 100, now 50; physics\.friction 1\.2, now 0\.5\)",
    ):
        run(tmp_path, resume=True, provenance={"simulation": now})


def test_progress_tells_the_best_in_the_goals_unit() -> None:
    """A robot that turns in place has gone nowhere."""
    turning = replace(TASK, reward=replace(TASK.reward, goal="turn_left"))
    settings = replace(toy_settings(4), task=turning)
    best = SimpleNamespace(best_achieved=43.2, best_distance_cm=0.1)
    training = SimpleNamespace(settings=settings, restart=0, best=best)
    assert _said(training) == "training, best 43°"
