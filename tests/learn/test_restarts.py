"""Learning that begins from nothing several times keeps the beginning with the best pair."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from helpers.stopped_run import Killed, assert_same, run, timeless
from helpers.toy_coopt import SPACE, TASK, CrawlersInWorlds, make_simulator, toy_settings

from pneumorph.base.artefact import ArtefactError
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.objective import Objective
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.restarts import BEST_RESTART
from pneumorph.learn.settings import FinetuningSettings
from pneumorph.learn.training import Training, restart_seed

ONE = toy_settings(round_count=4, seed=1, environment_count=4)
SETTINGS = replace(ONE, restarts=3)
EVALUATION = len(set(map(SPACE.twin, range(len(SPACE))))) * TASK.action_count
"""Actions of one, of a design or its image."""


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("restarts")
    return folder, run(folder, SETTINGS)


@dataclass(frozen=True)
class Alone:
    """A training of one beginning's seed, made by itself."""

    arrays: dict[str, np.ndarray]
    evaluated: list[DesignGaitPair]

    @property
    def score_cm(self) -> float:
        return self.evaluated[0].score_cm


@pytest.fixture(scope="module")
def alone() -> list[Alone]:
    found = []
    for restart in range(3):
        settings = replace(ONE, seed=restart_seed(ONE.seed, restart))
        training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
        while not training.is_finished:
            training.run_round()
        arrays = training.arrays()
        found.append(Alone(arrays, training.evaluate()))
    return found


def test_the_best_beginning_is_kept(straight: tuple[Path, CooptResult], alone: list[Alone]) -> None:
    """Each begins from nothing: it is a training by itself, with a seed of its own."""
    folder, summary = straight
    scores = [each.score_cm for each in alone]
    # Neither the first nor the last, by what no rounding makes.
    assert scores[1] > max(scores[0], scores[2]) + 0.01
    kept = load_checkpoint(folder).arrays
    learned = {name: value for name, value in alone[1].arrays.items() if "best/" not in name}
    assert learned.keys() == {name for name in kept if "best/" not in name}
    for name, value in learned.items():
        np.testing.assert_array_equal(kept[name], value, err_msg=name)
    assert summary.restart_scores_cm == tuple(scores)
    assert summary.best is not None
    assert summary.best.score_cm >= max(scores)
    policy, _, metadata = load_policy(folder / "policy.npz")
    assert metadata["timestep"] == summary.timesteps == 12 * ONE.timesteps_per_round
    # The policy is what a learner's state begins with.
    for number, leaf in enumerate(jax.tree.leaves(policy)):
        np.testing.assert_array_equal(np.asarray(leaf), learned[f"sac/{number}"])


def test_walks_that_rank_gaits_are_counted(straight: tuple[Path, CooptResult]) -> None:
    """All designs but for images at the end of each beginning, and at the end; no walk that
    learns."""
    assert straight[1].evaluation_timesteps == (SETTINGS.restarts + 1) * EVALUATION


def test_a_training_that_an_earlier_version_began_does_not_say_what_ranked_its_gaits() -> None:
    training = Training(crawling(viscous_crawler_robot, make_simulator, ONE), ONE)
    training.evaluate()
    kept = training.metadata()
    assert kept["evaluation_timesteps"] == EVALUATION
    del kept["evaluation_timesteps"]
    training.restore(training.arrays(), kept)
    training.evaluate()
    assert training.ranking.timesteps is None


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
        run(tmp_path, SETTINGS, kill_after_round=kill_after_round)
    assert_same(tmp_path, run(tmp_path, SETTINGS, resume=True), straight)


@pytest.mark.parametrize("after", ["begin_again", "go_on_as"])
def test_killed_between_a_beginning_and_the_next_checkpoint(
    tmp_path: Path,
    straight: tuple[Path, CooptResult],
    after: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The second time that learning begins again, or when the best is gone on from."""
    times = []

    def killed(training: Training, *what: Any) -> None:
        times.append(training.restart)
        if len(times) == (2 if after == "begin_again" else 1):
            raise Killed
        as_usual(training, *what)

    settings = replace(SETTINGS, checkpoint_interval_timesteps=10 * ONE.timesteps_per_round)
    as_usual = getattr(Training, after)
    with monkeypatch.context() as patched:
        patched.setattr(Training, after, killed)
        with pytest.raises(Killed):
            run(tmp_path, settings)
    assert_same(tmp_path, run(tmp_path, settings, resume=True), straight)
    # As if it had been killed once more, after its last checkpoint.
    assert_same(tmp_path, run(tmp_path, settings, resume=True), straight)


def test_a_folder_without_the_best_beginning_is_not_gone_on_with(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        run(tmp_path, SETTINGS, kill_after_round=6)
    (tmp_path / BEST_RESTART).unlink()
    with pytest.raises(ArtefactError, match=r"best_restart\.npz is missing, expected the best of"):
        run(tmp_path, SETTINGS, resume=True)


def test_the_kept_policy_is_fine_tuned_and_pairs_of_all_compete(
    tmp_path: Path, straight: tuple[Path, CooptResult], alone: list[Alone]
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
    # Designs that the kept policy was best with; the policy knows no other beginning's gaits.
    best = BestPairs(ONE.space, 2)
    best.offer(alone[1].evaluated)
    finalists = {str(ONE.space[pair.design]) for pair in best.pairs}
    assert {file.stem for file in (tmp_path / "finetuned").glob("*.npz")} == finalists
    again = run(tmp_path, settings, resume=True)
    assert timeless(vars(again)) == timeless(vars(summary))


def test_each_beginning_has_its_time_in_the_nominal_world() -> None:
    """Worlds are drawn by numbers; those below the objective's are the nominal world's."""
    until = 2 * ONE.timesteps_per_round
    objective = Objective("mean", worlds_per_design=4, nominal_until_timestep=until)
    settings = replace(SETTINGS, restarts=2, objective=objective)
    numbers = []

    class Noting(CrawlersInWorlds):
        def redraw(self, number: int) -> None:
            numbers.append(number)
            super().redraw(number)

    training = Training(crawling(viscous_crawler_robot, Noting, settings), settings)
    numbers.clear()
    for _ in range(4):
        training.run_round()
    training.begin_again()
    for _ in range(4):
        training.run_round()
    one_round = ONE.timesteps_per_round
    assert numbers == [each * one_round for each in (0, 1, 2, 3, 0, 1, 6, 7)]
