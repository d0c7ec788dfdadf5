"""Learning that begins from nothing several times keeps the beginning with the best pair."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from helpers.toy_coopt import make_simulator, toy_settings

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.settings import CooptSettings, FinetuningSettings
from pneumorph.learn.training import STAGES, Training

ONE = toy_settings(round_count=4, environment_count=4)
SETTINGS = replace(ONE, restarts=3)
TIMES = {*(f"{stage}_s" for stage in STAGES), "wall_s", "finetuning_wall_s", "remarks"}


class Killed(Exception):
    """Stands for the end of the process."""


def run(
    folder: Path,
    settings: CooptSettings = SETTINGS,
    kill_after_round: int | None = None,
    **options: Any,
) -> CooptResult:
    def progress(done: int, total: int, message: str) -> None:
        assert done <= total
        if kill_after_round is not None and done >= kill_after_round * ONE.timesteps_per_round:
            raise Killed

    factory = crawling(viscous_crawler_robot, make_simulator, settings)
    return learn_in_folder(factory, settings, folder, progress=progress, **options)


def timeless(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name not in TIMES}


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("restarts")
    return folder, run(folder)


@pytest.fixture(scope="module")
def beginnings() -> list[tuple[float, dict[str, np.ndarray]]]:
    """Score of the best evaluated pair of each beginning, and what it had learned."""
    training = Training(crawling(viscous_crawler_robot, make_simulator, SETTINGS), SETTINGS)
    found = []
    for number in range(3):
        if number:
            training.begin_again()
        while not training.is_restart_over:
            training.run_round()
        found.append((training.evaluate()[0].score_cm, training.state.arrays()))
    return found


def test_the_best_beginning_is_kept(
    straight: tuple[Path, CooptResult], beginnings: list[tuple[float, dict[str, np.ndarray]]]
) -> None:
    folder, summary = straight
    scores = [score for score, _ in beginnings]
    assert len({round(score, 6) for score in scores}) == 3
    _, learned = max(beginnings, key=lambda each: each[0])
    checkpoint = load_checkpoint(folder)
    for name, value in learned.items():
        np.testing.assert_array_equal(checkpoint.arrays[f"sac/{name}"], value, err_msg=name)
    assert summary.restart_scores_cm == tuple(scores)
    assert summary.best is not None
    assert summary.best.score_cm >= max(scores)
    policy, _, metadata = load_policy(folder / "policy.npz")
    assert metadata["timestep"] == summary.timesteps == 12 * ONE.timesteps_per_round
    # The policy is what a learner's state begins with.
    for number, leaf in enumerate(jax.tree.leaves(policy)):
        np.testing.assert_array_equal(np.asarray(leaf), learned[str(number)])


def test_the_first_beginning_is_a_training_without_others(
    straight: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    run(tmp_path, ONE)
    alone, several = read_metrics(tmp_path), read_metrics(straight[0])
    assert len(alone) == 4
    assert len(several) == 12
    for theirs, ours in zip(alone, several, strict=False):
        assert timeless(theirs) == timeless(ours)


def test_each_begins_from_nothing_and_goes_through_the_schedule(
    straight: tuple[Path, CooptResult],
) -> None:
    metrics = read_metrics(straight[0])
    assert [line["restart"] for line in metrics] == [0] * 4 + [1] * 4 + [2] * 4
    targets = np.reshape([line["design_entropy_target"] for line in metrics], (3, 4))
    assert targets[0, -1] < targets[0, 0]
    np.testing.assert_array_equal(targets, np.tile(targets[0], (3, 1)))
    # Two rounds of uniform actions, then as many updates as in the others.
    updates = np.diff([0, *(line["update_count"] for line in metrics)]).reshape(3, 4)
    np.testing.assert_array_equal(updates, np.tile(updates[0], (3, 1)))
    assert updates[0, 0] == 0 < updates[0, -1]
    returns = np.reshape([line["return_mean_cm"] for line in metrics], (3, 4))
    assert len(set(returns[:, 0])) == 3


@pytest.mark.parametrize("kill_after_round", [2, 4, 7, 12])
def test_killed_and_resumed_equals_not_stopping(
    tmp_path: Path, straight: tuple[Path, CooptResult], kill_after_round: int
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, kill_after_round=kill_after_round)
    summary = run(tmp_path, resume=True)
    assert timeless(vars(summary)) == timeless(vars(straight[1]))
    ours, theirs = load_checkpoint(tmp_path), load_checkpoint(straight[0])
    assert ours.arrays.keys() == theirs.arrays.keys()
    for name, value in theirs.arrays.items():
        np.testing.assert_array_equal(ours.arrays[name], value, err_msg=name)
    lines = zip(read_metrics(tmp_path), read_metrics(straight[0]), strict=True)
    for mine, expected in lines:
        assert timeless(mine) == timeless(expected)


def test_the_kept_policy_is_fine_tuned_and_pairs_of_all_compete(
    tmp_path: Path, straight: tuple[Path, CooptResult]
) -> None:
    finetuning = FinetuningSettings(finalist_count=2, timesteps=1)
    settings = replace(SETTINGS, finetuning=finetuning)
    summary = run(tmp_path, settings)
    assert [pair.score_cm for pair in summary.seen_pairs] == [
        pair.score_cm for pair in straight[1].pairs
    ]
    assert summary.best is not None
    assert summary.best.score_cm >= summary.seen_pairs[0].score_cm
    assert summary.finetuning_timesteps == 2 * ONE.timesteps_per_round
    assert len(list((tmp_path / "finetuned").glob("*.npz"))) == 2
    again = run(tmp_path, settings, resume=True)
    assert timeless(vars(again)) == timeless(vars(summary))
