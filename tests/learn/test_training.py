"""Co-optimisation finds the known best of a toy design space."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.toy_coopt import SPACE, TASK, best_distances_cm, make_simulator, scored, toy_settings

from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.gait.walk import walk
from pneumorph.learn.environments import crawling
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import Training


@cache
def training_of(seed: int, expected_scores: bool = False) -> tuple[Training, list[dict]]:
    settings = replace(toy_settings(40, seed), expected_scores=expected_scores)
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    metrics = []
    while not training.is_finished:
        metrics.append(training.run_round())
    return training, metrics


@pytest.fixture(scope="module")
def trained() -> tuple[Training, list[dict]]:
    """What holds for every seed is asked of the first."""
    return training_of(0)


def found_a_best_design(training: Training) -> bool:
    """One of the best designs, with a gait of its own.

    Two opposite legs on a diagonal; the four ways to place them tie up to rounding, and the
    runners-up are 3 % behind: which of these is found is the seed's luck. Drawn actions do not
    reach the extreme pressures exactly: nine seeds came to 63 to 89 % of the optimum. No design
    without an out-of-phase gait can do more than 30 % of it.
    """
    best, found = best_distances_cm(), training.best.pairs[0]
    # No gait beats the exhaustive search by more than its grid of pressures leaves out.
    assert found.distance_cm < 1.05 * best.max()
    return best[found.design] > 0.95 * best.max() and found.distance_cm > 0.45 * best.max()


@pytest.mark.parametrize("expected_scores", [False, True])
def test_best_design_of_the_toy_space_is_found(expected_scores: bool) -> None:
    """By one of three seeds: of nine, one settled too early for a design of 30 %."""
    best = best_distances_cm()
    winners = np.flatnonzero(best > best.max() - 1e-9)
    assert {str(SPACE[index]) for index in winners} == {"1.0.2.0", "0.1.0.2", "1.2.0.0", "0.0.1.2"}
    assert any(found_a_best_design(training_of(seed, expected_scores)[0]) for seed in range(3))


def test_policy_learned_and_not_the_dice() -> None:
    """By one of three seeds: of twelve, one settled for a design of 30 %, and the others began with
    -0.2 to 0.04 cm and ended with 58 to 74 % of the optimum, evaluated 72 to 84 %."""

    def learned(training: Training, metrics: list[dict]) -> bool:
        assert metrics[0]["return_mean_cm"] < 0.5
        pairs = training.evaluate()
        assert pairs[0].source == "policy"
        distances = [pair.distance_cm for pair in pairs]
        assert distances == sorted(distances, reverse=True)
        twins = [SPACE.twin(index) for index in range(len(SPACE))]
        assert sorted(twins[pair.design] for pair in pairs) == sorted(set(twins))
        furthest = best_distances_cm().max()
        return bool(
            metrics[-1]["return_mean_cm"] > 0.4 * furthest and distances[0] > 0.55 * furthest
        )

    assert any(learned(*training_of(seed)) for seed in range(3))


def test_entropy_follows_its_target(trained: tuple[Training, list[dict]]) -> None:
    training, metrics = trained
    tolerance = training.settings.schedule.entropy_tolerance
    limit = training.settings.schedule.maximum_inverse_temperature
    following = [line for line in metrics if line["inverse_temperature"] < limit]
    assert len(following) >= 25
    for line in following:
        assert abs(line["design_entropy"] - line["design_entropy_target"]) <= tolerance
        np.testing.assert_allclose(sum(line["score_histogram"]), 1.0)


def test_best_pair_walks_its_distance_again(trained: tuple[Training, list[dict]]) -> None:
    training, _ = trained
    for pair in training.best.pairs:
        result = walk(
            make_simulator([SPACE[pair.design]]),
            [pair.gait(TASK.action_step_count * 0.05)],
            duration_s=TASK.action_count * TASK.action_step_count * 0.05,
            time_step_s=0.05,
            settling_step_count=TASK.settling_step_count,
        )
        np.testing.assert_allclose(result.distance_cm[0], pair.distance_cm, atol=1e-12)  # rounding
    twins = {min(pair.design, SPACE.mirror_index[pair.design]) for pair in training.best.pairs}
    assert len(twins) == len(training.best.pairs)


@pytest.mark.parametrize("terminal", [True, False])
def test_stored_transitions_shift_the_memory_even_at_an_episodes_end(terminal: bool) -> None:
    settings = toy_settings(round_count=2)
    task = replace(TASK, time_limit_is_terminal=terminal)
    training = Training(
        crawling(viscous_crawler_robot, make_simulator, replace(settings, task=task)),
        replace(settings, task=task),
    )
    training.run_round()
    stored = training.learned.buffer.arrays()
    np.testing.assert_array_equal(
        stored["next_state"], np.hstack([stored["action"], stored["state"][:, :2]])
    )
    # One terminal transition per episode, or none where time runs out without ending anything;
    # twice over, for the mirror images.
    assert stored["terminal"].sum() == (2 * 16 if terminal else 0)


def test_what_is_expected_of_a_design_does_not_forgive_its_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = replace(toy_settings(round_count=40), expected_scores=True)
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    training.timestep = settings.schedule.decay_start_timestep
    everything = np.full(len(SPACE), 50.0)
    monkeypatch.setattr(training, "expected_returns", lambda *_: everything.copy())
    failing = int(np.flatnonzero(SPACE.mirror_index != np.arange(len(SPACE)))[0])
    image = int(SPACE.mirror_index[failing])
    (other,) = np.flatnonzero(~np.isin(np.arange(len(SPACE)), [failing, image]))[:1]
    for designs, failed in (([failing, other], [True, False]), ([other, other], [False, False])):
        training._update_distribution(scored(designs, [0.0, 1.0], failed))
        assert training.learned.distribution.scores[[failing, image]].max() <= 0.0
        assert training.learned.distribution.scores[other] == 50.0
    # Walking again it is a design like any other, and a restored training knows as much.
    again = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    again.restore(training.arrays(), training.metadata())
    kept = again.learned.distribution.failing
    np.testing.assert_array_equal(kept, training.learned.distribution.failing)
    training._update_distribution(scored([failing], [2.0], [False]))
    assert training.learned.distribution.scores[[failing, image]].min() == 50.0


@pytest.mark.parametrize("expected_scores", [False, True])
def test_a_failing_design_neither_stops_training_nor_wins(expected_scores: bool) -> None:
    class Fragile(ViscousCrawler):
        """Fails wherever regulator 1 is commanded above 80 kPa, and would travel far."""

        def advance(self, command_kPa, step_count, active=None) -> None:
            super().advance(command_kPa, step_count, active)
            self._status[command_kPa[:, 0] > 80.0] = 1
            self._forward_mm[command_kPa[:, 0] > 80.0] += 1e6

    settings = replace(toy_settings(round_count=3), expected_scores=expected_scores)
    training = Training(crawling(viscous_crawler_robot, Fragile, settings), settings)
    metrics = [training.run_round() for _ in range(3)]
    assert sum(line["failed_count"] for line in metrics) == training.failure_count > 0
    assert all(np.isfinite(line["return_mean_cm"]) for line in metrics)
    assert all(pair.distance_cm < 10.0 for pair in training.best.pairs)
    assert all(pair.held_kPa[:, 0].max() <= 80.0 for pair in training.best.pairs)


def test_designs_that_failed_do_not_lower_what_is_expected_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The critic gives 10 to each that walked, which made 5 cm, and 9 to another: 4.5 cm, also
    where two of them failed. Where all did, nothing is known."""
    settings = replace(toy_settings(round_count=40), expected_scores=True)
    walked = np.unique([SPACE.twin(each) for each in range(len(SPACE))])[:4]
    (other,) = np.setdiff1d(np.arange(len(SPACE)), [walked, SPACE.images(walked)[0]])[:1]
    values = np.full(len(SPACE), 10.0)
    values[other] = 9.0
    for failed, expected in (([0, 0, 0, 0], 4.5), ([0, 0, 1, 1], 4.5), ([1, 1, 1, 1], 0.0)):
        training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
        training.timestep = settings.schedule.decay_start_timestep
        monkeypatch.setattr(training, "_values", lambda designs: values[designs])
        failing = [bool(each) for each in failed]
        scores = [0.0 if each else 5.0 for each in failing]
        training._update_distribution(scored(walked.tolist(), scores, failing))
        assert training.learned.distribution.scores[other] == pytest.approx(expected)


def test_the_critic_knows_designs_better_than_their_newest_returns() -> None:
    """After uniform rounds, beside what the policy makes of every design now."""
    training = Training(
        crawling(viscous_crawler_robot, make_simulator, toy_settings(40)), toy_settings(40)
    )
    while training.timestep < training.settings.schedule.decay_start_timestep:
        training.run_round()
    newest = training.learned.distribution.scores.copy()
    designs = np.arange(len(SPACE))
    distance_cm = np.empty(len(SPACE))
    for pair in training.evaluate():
        distance_cm[pair.design] = pair.distance_cm
    expected = training.expected_returns(designs, distance_cm)
    # Scaled, they add up to what walked.
    assert expected.sum() == pytest.approx(distance_cm.sum())
    error, newest_error = (
        np.sqrt(np.mean((guess - distance_cm) ** 2)) for guess in (expected, newest)
    )
    assert error < newest_error
    # Nothing is expected before anything came forward.
    assert np.all(training.expected_returns(designs, -distance_cm) == -np.inf)


def test_both_readings_of_timesteps_per_update() -> None:
    assert CooptSettings().updates_per_vector_step == 1
    assert CooptSettings(update_every="timestep").updates_per_vector_step == 96
    paper = CooptSettings()
    assert paper.round_count * paper.task.action_count == 10_420  # updates of one million steps


def test_settings_are_checked() -> None:
    with pytest.raises(ValueError, match="environment_count must be at least 1, got 0"):
        CooptSettings(environment_count=0)
    with pytest.raises(ValueError, match="design space has 2 regulators and the task 3"):
        CooptSettings(space=SPACE)


def test_what_is_expected_is_scaled_to_what_was_walked_however_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two designs walked 0.3 cm, of which the critic gave 0.06; less than none says nothing."""
    settings = toy_settings(round_count=1)
    training = Training(crawling(viscous_crawler_robot, make_simulator, settings), settings)
    values = 0.01 * np.arange(len(SPACE), dtype=float)
    monkeypatch.setattr(training, "_values", lambda designs: values[designs])
    walked, returns = np.array([2, 4]), np.array([0.1, 0.2])
    np.testing.assert_allclose(training.expected_returns(walked, returns), 5.0 * values)
    some = np.array([7, 3])
    expected = training.expected_returns(walked, returns, some)
    np.testing.assert_allclose(expected, 5.0 * values[some])
    assert np.isneginf(training.expected_returns(walked, -returns)).all()
    assert np.isneginf(training.expected_returns(np.array([0, 0]), returns)).all()
