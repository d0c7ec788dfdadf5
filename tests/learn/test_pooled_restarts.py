"""The last beginnings of a training learn from what all before them saw and found."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.stopped_run import Killed, assert_same, run, timeless
from helpers.toy_coopt import make_simulator, toy_settings

from pneumorph.base.artefact import ArtefactError, load_artefact, save_artefact
from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.checkpoint import load_checkpoint
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.demonstrations import known_pair
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.pool_files import KIND, VERSION
from pneumorph.learn.settings import CooptSettings, FinetuningSettings
from pneumorph.learn.training import Training, restart_seed

ONE = toy_settings(round_count=4, seed=1, environment_count=4)
APART = replace(
    ONE,
    restarts=4,
    finetuning=FinetuningSettings(finalist_count=2, timesteps=1, updates_per_vector_step=1),
)
POOLED = replace(APART, pooled_restarts=2)
ROUNDS = 16


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("pooled")
    return folder, run(folder, POOLED)


def test_the_first_beginnings_are_as_without(
    straight: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    run(tmp_path, APART)
    apart, pooled = (list(map(timeless, read_metrics(each))) for each in (tmp_path, straight[0]))
    assert len(pooled) == ROUNDS
    assert pooled[:8] == apart[:8]
    for ours, theirs in zip(pooled[8:], apart[8:], strict=True):
        assert ours["return_mean_cm"] != theirs["return_mean_cm"]


def finished(restart: int, settings: CooptSettings = POOLED) -> Training:
    """A training after so many of its beginnings, their evaluations noted."""
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    for number in range(restart + 1):
        while not training.is_restart_over:
            training.run_round()
        training.pool.note(training.evaluate())
        if number < restart:
            training.begin_again()
    return training


def test_a_pooled_beginning_has_new_weights_and_learns_from_all_that_was_seen() -> None:
    training = finished(1)
    before = training.learned.buffer
    own = [training.pool.transitions[0], before.arrays()]
    updates = training.update_count
    training.begin_again()
    learned = training.learned
    # Each transition and its image.
    seen = 2 * 4 * ONE.timesteps_per_round
    assert learned.buffer.earlier_count == 2 * seen
    assert len(learned.buffer) == 0
    for place, arrays in enumerate(own):
        held = learned.buffer._arrays["reward"][place * seen : (place + 1) * seen]
        np.testing.assert_array_equal(held, arrays["reward"])
    assert training.update_count - updates == POOLED.first_learning_steps * POOLED.updates == 16 * 4


def test_a_pooled_beginning_begins_with_weights_of_its_own() -> None:
    settings = replace(POOLED, updates=0)
    training = finished(1, settings)
    training.begin_again()
    fresh = training.learner.initial_state(restart_seed(settings.seed, 2)).arrays()
    for name, value in training.learned.state.arrays().items():
        np.testing.assert_array_equal(value, fresh[name], err_msg=name)


def test_a_pooled_beginning_knows_what_the_best_designs_scored() -> None:
    training = finished(1, replace(POOLED, evaluated_design_count=3))
    found = dict(training.pool.scores_cm)
    training.begin_again()
    distribution = training.learned.distribution
    np.testing.assert_allclose(distribution.entropy, np.log(len(ONE.space)))  # chosen later
    twins = training._twins
    assert twins is not None
    images = twins.designs(np.array([*found]))
    for design, image in zip(found, images, strict=True):
        assert distribution.scores[design] == distribution.scores[image] == found[design]
    untold = np.setdiff1d(np.arange(len(ONE.space)), [*found, *images])
    assert len(untold) > 10
    assert not distribution.walked[untold].any()


def test_the_best_of_earlier_beginnings_is_evaluated_after_an_unlucky_round() -> None:
    """What is known of it is of many worlds without noise, a round of few with it."""
    training = finished(1, replace(POOLED, evaluated_design_count=3))
    best = training.pool.best()[0]
    assert training.pool.scores_cm[best] == max(training.pool.scores_cm.values())
    training.begin_again()
    while not training.is_restart_over:
        training.run_round()
    twins, unlucky = training._twins, np.array([best])
    assert twins is not None
    distribution = training.learned.distribution
    distribution.take_round(
        unlucky, np.array([-99.0]), np.zeros(1, dtype=bool), twins.designs(unlucky)
    )
    evaluated = np.array([pair.design for pair in training.evaluate()])
    assert len(evaluated) == 3
    assert best in twins.once(evaluated)


def test_what_a_design_scored_is_its_best_evaluation() -> None:
    training = finished(0)
    pair = max(training.evaluate(), key=lambda each: each.score_cm)
    for score in (pair.score_cm - 5.0, pair.score_cm - 1.0):
        training.pool.note([replace(pair, score_cm=score)])
    assert max(training.pool.scores_cm.values()) == pair.score_cm


@pytest.mark.parametrize(
    ("kill_after_round", "seldom"), [(9, False), (9, True), (12, True), (14, False), (16, True)]
)
def test_killed_and_resumed_equals_not_stopping(
    tmp_path: Path, straight: tuple[Path, CooptResult], kill_after_round: int, seldom: bool
) -> None:
    """With a checkpoint after each round and at the end of each beginning alone."""
    every = 10**9 if seldom else POOLED.checkpoint_interval_timesteps
    settings = replace(POOLED, checkpoint_interval_timesteps=every)
    with pytest.raises(Killed):
        run(tmp_path, settings, kill_after_round=kill_after_round)
    assert_same(tmp_path, run(tmp_path, settings, resume=True), straight)


def test_what_was_seen_is_kept_while_it_is_needed(
    tmp_path: Path, straight: tuple[Path, CooptResult]
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, POOLED, kill_after_round=9)
    kept = sorted(file.name for file in tmp_path.glob("transitions*"))
    assert kept == ["transitions.1.npz", "transitions.2.npz"]
    assert not list(straight[0].glob("transitions*"))
    (tmp_path / kept[1]).unlink()
    with pytest.raises(ArtefactError, match=r"transitions\.2\.npz is missing.*beginning 2 of"):
        run(tmp_path, POOLED, resume=True)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda arrays, told: arrays.pop("reward"), "reward is missing"),
        (
            lambda arrays, told: arrays.update(reward=arrays["reward"][:3]),
            r"reward has shape \(3,\)",
        ),
        (lambda arrays, told: arrays.update(state=arrays["state"][:, :2]), "state has shape"),
        (lambda arrays, told: told.update(beginning=2), "beginning is 2, expected 1"),
        (lambda arrays, told: told.update(seed=7), "seed is 7, expected 1"),
    ],
)
def test_other_transitions_are_refused_by_the_name_of_their_file(
    damage: Callable[[dict[str, np.ndarray], dict[str, Any]], Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(Killed):
        run(tmp_path, POOLED, kill_after_round=9)
    file = tmp_path / "transitions.1.npz"
    arrays, metadata = load_artefact(file, KIND, VERSION)
    told = {name: metadata[name] for name in ("beginning", "seed")}
    damage(arrays, told)
    save_artefact(file, KIND, VERSION, arrays, told)
    with pytest.raises(ArtefactError, match=rf"transitions\.1\.npz cannot be read.*{said}"):
        run(tmp_path, POOLED, resume=True)


def test_gaits_are_not_shown_again() -> None:
    """What was found since would be forgotten for them."""
    gait = HeldGait.evenly(np.array([[60.0, 0.0], [0.0, 60.0]]), 0.6)
    settings = replace(POOLED, restarts=2, pooled_restarts=1)
    pair = known_pair(gait, ONE.space[3], ONE.space, ONE.task, 0.6, "demonstration")
    make = crawling(viscous_crawler_robot, make_simulator, settings)
    training = Training(make, settings, None, [pair])
    walked = []
    walk = training.walk_and_learn
    training.walk_and_learn = lambda *what: (walked.append(what[2]), walk(*what))[1]  # type: ignore[method-assign]
    for _ in range(2):
        while not training.is_restart_over:
            training.run_round()
        training.pool.note(training.evaluate())
        if training.restart == 0:
            training.begin_again()
    assert [each is not None for each in walked] == [True] + [False] * 7


def test_fine_tuning_learns_from_what_its_own_beginning_saw(
    straight: tuple[Path, CooptResult],
) -> None:
    training = finished(3)
    assert training.learned.buffer.earlier_count > 0
    training.take_over(load_checkpoint(straight[0]))
    assert training.learned.buffer.earlier_count == 0
    assert len(training.learned.buffer) == 2 * 4 * ONE.timesteps_per_round


def test_without_pooling_nothing_is_kept(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        run(tmp_path, APART, kill_after_round=9)
    assert not list(tmp_path.glob("transitions*"))


def test_the_only_beginning_is_never_pooled(tmp_path: Path) -> None:
    alone = replace(ONE, pooled_restarts=3)
    run(tmp_path / "one", alone)
    run(tmp_path / "usual", ONE)
    ours, theirs = (list(map(timeless, read_metrics(tmp_path / each))) for each in ("one", "usual"))
    assert ours == theirs


def test_more_pooled_beginnings_than_there_can_be_are_settings() -> None:
    """Those that a preset has where fewer beginnings are asked for, whole settings that an earlier
    version accepted, and those of a layer that another lies over; commands refuse others."""
    preset = replace(ONE, restarts=12, pooled_restarts=4)
    assert layered(preset, [{"restarts": 1}]).restarts == 1
    assert layered(preset, [{"restarts": 3, "pooled_restarts": 2}]).pooled_restarts == 2
    kept = replace(ONE, pooled_restarts=3)
    assert layered(preset, [settings_to_dict(kept)]) == kept
    assert layered(ONE, [{"pooled_restarts": 3}, {"restarts": 4}]).pooled_restarts == 3


def test_one_killed_after_its_last_round_evaluates_the_same_designs(tmp_path: Path) -> None:
    """Among them the best of earlier beginnings, of which it has nothing left to learn."""
    settings = replace(
        toy_settings(round_count=2, seed=2, environment_count=4),
        restarts=2,
        pooled_restarts=1,
        evaluated_design_count=6,
        updates=1,
    )
    whole = tmp_path / "whole", run(tmp_path / "whole", settings)
    with pytest.raises(Killed):
        run(tmp_path / "stopped", settings, kill_after_round=4)
    assert_same(tmp_path / "stopped", run(tmp_path / "stopped", settings, resume=True), whole)
