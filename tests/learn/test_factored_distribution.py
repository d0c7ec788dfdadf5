"""The factored distribution against the enumerated one, theory, and spaces that none can list."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.toy_coopt import TASK, make_simulator, toy_settings
from scipy.stats import chi2

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.design_distribution import DesignDistribution, EntropySchedule
from pneumorph.learn.environments import crawling
from pneumorph.learn.factored_distribution import FactoredDistribution, FactoredSettings
from pneumorph.learn.training import Training
from pneumorph.robot.design_space import DesignSpace

SMALL = DesignSpace(4, 2, 2, 4, options=("0 * b*",) * 4)
LARGE = DesignSpace(12, 4, 3, 8, options=("0 * b* c*",) * 12)
"""Ten thousand million designs."""
TURNED = DesignSpace(6, 2, 3, 6, mirror="none", symmetries=("1 2 3 4 5 0",))
"""Designs that turns by 60 degrees make each other count as one."""
SCHEDULE = EntropySchedule(0, 100)


def planted(space: DesignSpace, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """What each option of each location is worth [cm], and where locations begin."""
    counts = space.paths.option_counts
    worth = np.random.default_rng(seed).normal(0.0, 2.0, sum(counts))
    return worth, np.concatenate([[0], np.cumsum(counts)[:-1]])


def scores_of(space: DesignSpace, designs: np.ndarray, seed: int = 0) -> np.ndarray:
    worth, first = planted(space, seed)
    return worth[space.options_of(designs) + first].sum(axis=1)


@pytest.mark.parametrize("space", [SMALL, LARGE, DesignSpace()])
def test_entropy_starts_at_its_own_maximum_and_follows_its_target(space: DesignSpace) -> None:
    """The logarithm of the number of designs; then within the schedule's tolerance."""
    distribution = FactoredDistribution(space, SCHEDULE)
    assert distribution.entropy == pytest.approx(np.log(len(space)), rel=1e-12)
    assert distribution.target_entropy(0) == pytest.approx(np.log(len(space)), rel=1e-12)
    rng = np.random.default_rng(0)
    designs = distribution.sample(200, rng)
    distribution.take_round(designs, scores_of(space, designs), np.zeros(200, dtype=bool))
    for timestep in (10, 50, 80):
        distribution.follow_schedule(timestep)
        target = (1.0 - timestep / 100) * np.log(len(space))
        assert abs(distribution.entropy - target) <= SCHEDULE.entropy_tolerance


def test_scores_that_are_sums_give_the_enumerated_distribution() -> None:
    """Of rounds that walk every design the weights tend to the scores' own (the ridge's part falls
    by a tenth or more with each); then both are Gibbs' distribution of the same scores."""
    every = np.arange(len(SMALL))
    scores = 7.0 + scores_of(SMALL, every)
    factored, enumerated = (
        FactoredDistribution(SMALL, SCHEDULE),
        DesignDistribution(len(SMALL), SCHEDULE),
    )
    for _ in range(100):
        factored.take_round(every, scores, np.zeros(len(every), dtype=bool))
    enumerated.take_round(every, scores, np.zeros(len(every), dtype=bool))
    np.testing.assert_allclose(factored.scores_cm(every), scores, atol=1e-6)
    for timestep in (20, 60, 90):
        for distribution in (factored, enumerated):
            distribution.follow_schedule(timestep)
        assert factored.entropy == pytest.approx(enumerated.entropy, abs=1e-6)
        assert factored.inverse_temperature == pytest.approx(enumerated.inverse_temperature)
        probability = np.exp(factored.weighed.log_probability(SMALL.options_of(every)))
        np.testing.assert_allclose(probability, enumerated.probabilities, atol=1e-6)
    assert factored.said()["expected_score_cm"] == pytest.approx(
        enumerated.said()["expected_score_cm"], abs=1e-5
    )


def test_weights_are_least_squares_within_rounds() -> None:
    """One round from nothing against a ridge regression written out; its level is no matter."""
    settings = FactoredSettings(ridge=0.3)
    rng = np.random.default_rng(0)
    designs, noise = SMALL.drawn(30, rng), rng.normal(size=30)
    options = SMALL.options_of(designs)
    rows = np.concatenate(
        [np.eye(5)[column] for column in options.T], axis=1
    )  # no leg, two kinds on two regulators
    centred = rows - rows.mean(axis=0)
    wanted = np.linalg.solve(centred.T @ centred + 0.3 * np.eye(20), centred.T @ noise)
    for level in (0.0, 50.0):
        distribution = FactoredDistribution(SMALL, SCHEDULE, settings)
        distribution.take_round(designs, noise + level, np.zeros(30, dtype=bool))
        np.testing.assert_allclose(distribution.weights_cm, wanted, atol=1e-10)


def test_what_new_rounds_say_nothing_of_is_remembered() -> None:
    """Rounds of one design alone tell no option from another: what was learned before stays, though
    it counts by a factor of e^-10 less."""
    distribution = FactoredDistribution(SMALL, SCHEDULE)
    every = np.arange(len(SMALL))
    for _ in range(100):
        distribution.take_round(every, scores_of(SMALL, every), np.zeros(len(every), dtype=bool))
    for _ in range(200):
        distribution.take_round(np.full(16, 3), np.full(16, -4.0), np.zeros(16, dtype=bool))
    after = distribution.scores_cm(every) - distribution.scores_cm(every).mean()
    scores = scores_of(SMALL, every)
    np.testing.assert_allclose(after, scores - scores.mean(), atol=1e-6)


def test_twins_are_equally_probable() -> None:
    """Pearson's statistic of 20 000 draws against the mean of what both have."""
    distribution = FactoredDistribution(SMALL, SCHEDULE, mirrored=True)
    every = np.arange(len(SMALL))
    distribution.take_round(every, scores_of(SMALL, every), np.zeros(len(every), dtype=bool))
    distribution.follow_schedule(30)
    alone = np.exp(distribution.weighed.log_probability(SMALL.options_of(every)))
    shared = 0.5 * (alone + alone[SMALL.mirror_index])
    np.testing.assert_allclose(distribution.probability_of(every), shared, rtol=1e-12)
    assert np.abs(shared - alone).max() > 0.005  # an even hand makes a difference here
    drawn = distribution.sample(20_000, np.random.default_rng(0))
    counts, expected = np.bincount(drawn, minlength=len(every)), 20_000 * shared
    common = expected >= 5.0
    statistic = np.sum((counts - expected)[common] ** 2 / expected[common])
    assert statistic < chi2.isf(1e-9, common.sum())


def test_symmetric_designs_that_count_as_one_share_all_of_their_probability() -> None:
    turned = DesignSpace(4, 2, 2, 4, symmetries=("1 2 3 0",))
    distribution = FactoredDistribution(turned, SCHEDULE, mirrored=True)
    every = np.arange(len(turned))
    distribution.take_round(every, scores_of(turned, every), np.zeros(len(every), dtype=bool))
    distribution.follow_schedule(30)
    probability = distribution.probability_of(every)
    assert probability.sum() == pytest.approx(1.0, abs=1e-12)
    counts = np.bincount(
        distribution.sample(20_000, np.random.default_rng(0)), minlength=len(every)
    )
    expected = 20_000 * probability
    common = expected >= 5.0
    statistic = np.sum((counts - expected)[common] ** 2 / expected[common])
    assert statistic < chi2.isf(1e-9, common.sum())


def test_a_score_counts_for_all_designs_that_symmetries_count_as_one() -> None:
    """Each design walks: the weights of its members' options alone, which no other tells, tend to
    its score, and weigh as much together as a design alone."""
    every = np.arange(len(TURNED))
    scores = np.array([3.0 * TURNED[int(each)].leg_count for each in every])
    distribution, sound = FactoredDistribution(TURNED, SCHEDULE), np.zeros(len(every), dtype=bool)
    distribution.take_round(every, scores, sound)
    options = [TURNED.options_of_members(int(each)) for each in every]
    assert {len(each) for each in options} == {1, 2, 3, 6}
    share = np.concatenate([np.full(len(each), 1.0 / len(each)) for each in options])
    of_members = np.repeat(scores, [len(each) for each in options])
    rows = np.concatenate([np.eye(3)[column] for column in np.concatenate(options).T], axis=1)
    centred = rows - share @ rows / share.sum()
    normal = centred.T @ (share[:, None] * centred)
    wanted = np.linalg.solve(
        normal + np.eye(18), centred.T @ (share * (of_members - scores.mean()))
    )
    np.testing.assert_allclose(distribution.weights_cm, wanted, atol=1e-10)
    distribution = FactoredDistribution(TURNED, SCHEDULE, FactoredSettings(ridge=1e-3))
    for _ in range(5):  # the ridge's part falls by a hundredth or more with each
        distribution.take_round(every, scores, sound)
    np.testing.assert_allclose(distribution.scores_cm(every), scores, atol=1e-6)
    level = scores.mean() - share @ (rows @ distribution.weights_cm) / share.sum()
    np.testing.assert_allclose(level + rows @ distribution.weights_cm, of_members, atol=1e-6)


@pytest.mark.parametrize("expected", [False, True])
def test_the_best_of_designs_that_count_as_one_are_drawn_in_the_end(expected: bool) -> None:
    """A leg is worth 3 cm wherever it is: of paths that never count some would be drawn still."""
    settings, rng = FactoredSettings(drawn_designs=64), np.random.default_rng(0)
    distribution = FactoredDistribution(TURNED, SCHEDULE, settings)
    scores = np.array([3.0 * design.leg_count for design in TURNED])
    for number in range(20):
        designs = distribution.sample(48, rng)
        distribution.take_round(designs, scores[designs], np.zeros(48, dtype=bool))
        if expected:
            distribution.expect(scores.__getitem__, rng)
        distribution.follow_schedule(6 * number)
    assert (scores[distribution.sample(300, rng)] == 18.0).mean() > 0.99


@pytest.mark.parametrize("space", [SMALL, TURNED])
def test_scores_have_the_mean_of_the_newest_round_whatever_is_expected(space: DesignSpace) -> None:
    distribution, rng = FactoredDistribution(space, SCHEDULE), np.random.default_rng(0)
    designs, scores = distribution.sample(96, rng), rng.normal(3.0, 1.0, 96)
    distribution.take_round(designs, scores, np.zeros(96, dtype=bool))
    before = distribution.scores_cm(designs)
    distribution.expect(lambda among: 100.0 + 50.0 * np.cos(among), rng)
    after = distribution.scores_cm(designs)
    assert np.abs(after - before).max() > 1.0
    assert [before.mean(), after.mean()] == pytest.approx([scores.mean()] * 2, abs=1e-9)


def test_the_best_of_ten_thousand_million_is_found_in_little_memory() -> None:
    """Sixty rounds of 96 noisy scores; what is drawn last is near what no design exceeds. A design
    drawn at random lies five to seven deviations of all below that."""
    highest = sum(part.max() for part in np.split(planted(LARGE)[0], planted(LARGE)[1][1:]))
    tracemalloc.start()
    distribution, rng = (
        FactoredDistribution(LARGE, EntropySchedule(10, 60)),
        np.random.default_rng(0),
    )
    for number in range(60):
        designs = distribution.sample(96, rng)
        noisy = scores_of(LARGE, designs) + rng.normal(0.0, 3.0, 96) + 10.0 * rng.normal()
        distribution.take_round(designs, noisy, np.zeros(96, dtype=bool))
        distribution.expect(lambda among: scores_of(LARGE, among), rng)
        distribution.follow_schedule(number)
    found = distribution.candidates(20, None, rng)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30e6  # bytes; a score for each design would take 8 * 10^10
    at_random = scores_of(LARGE, LARGE.drawn(1000, rng))
    reached = scores_of(LARGE, found)
    # The sum of each location's best may break a rule, so it is only a bound.
    assert reached.max() > at_random.mean() + 0.8 * (highest - at_random.mean())
    assert reached.max() > at_random.max()
    assert len(set(found.tolist())) == 20


def test_what_failed_is_not_forgiven_by_what_is_expected() -> None:
    distribution = FactoredDistribution(SMALL, SCHEDULE)
    rng = np.random.default_rng(0)
    every = np.arange(len(SMALL))
    distribution.take_round(every, np.zeros(len(every)), every % 2 == 0)
    asked: list[np.ndarray] = []
    distribution.expect(lambda among: asked.append(among) or among.astype(float), rng)
    assert (asked[0] % 2 == 1).all()
    before = distribution.weights_cm.copy()
    distribution.expect(lambda among: np.full(len(among), -np.inf), rng)  # nothing is known yet
    np.testing.assert_array_equal(distribution.weights_cm, before)
    with pytest.raises(ValueError, match=r"scores\[1\] is nan, expected finite"):
        distribution.take_round(np.array([0, 1]), np.array([0.0, np.nan]), np.zeros(2, dtype=bool))


def test_candidates_are_the_best_seen_and_the_best_drawn_by_turns() -> None:
    distribution = FactoredDistribution(SMALL, SCHEDULE, mirrored=True)
    walked = np.arange(0, 40)
    distribution.take_round(walked, -walked.astype(float), np.zeros(40, dtype=bool))
    found = distribution.candidates(8, lambda among: among.astype(float), np.random.default_rng(0))
    assert found[0] == 0
    assert found[1] == len(SMALL) - 1  # of 1024 drawn from a flat distribution over 200
    assert len({SMALL.twin(int(each)) for each in found}) == 8


def test_a_score_of_a_single_world_is_no_reason_to_walk_before_those_of_several() -> None:
    """As of spaces that are listed: all fall by what those lose that walk in several worlds."""
    distribution = FactoredDistribution(SMALL, SCHEDULE, mirrored=True)
    sound = np.zeros(3, dtype=bool)
    distribution.take_round(np.array([0, 1, 2]), np.array([20.0, 22.0, 24.0]), sound)
    again = FactoredDistribution(SMALL, SCHEDULE, mirrored=True)
    again.restore(distribution.arrays())
    for each in (distribution, again):
        scores = np.array([8.0, 12.0, 1.0])
        each.take_round(np.array([1, 2, 3]), scores, sound, in_worlds=True)
        assert {design: score for design, (score, _) in each.seen.items()} == {
            0: 7.0, 1: 8.0, 2: 12.0, 3: 1.0
        }  # fmt: skip
        assert each.nominal == {0}


def test_a_design_that_failed_in_the_nominal_world_lowers_no_score_of_others() -> None:
    """As of spaces that are listed."""
    distribution = FactoredDistribution(SMALL, SCHEDULE)
    failing = np.array([False, False, True])
    distribution.take_round(np.array([0, 1, 2]), np.array([5.0, 0.0, -4.0]), failing)
    distribution.take_round(np.array([2]), np.array([4.0]), ~failing[2:], in_worlds=True)
    assert {design: score for design, (score, _) in distribution.seen.items()} == {
        0: 5.0, 1: 0.0, 2: 4.0
    }  # fmt: skip


def test_a_score_counts_for_the_image_that_walks_in_several_worlds() -> None:
    """Rounds in worlds name one of a design and its image, and those before them either."""
    distribution = FactoredDistribution(SMALL, SCHEDULE, mirrored=True)
    designs = np.flatnonzero(SMALL.images(np.arange(len(SMALL)))[0] != np.arange(len(SMALL)))[:1]
    images = SMALL.images(designs)[0]
    sound = np.zeros(1, dtype=bool)
    distribution.take_round(images, np.array([30.0]), sound, designs)
    assert distribution.nominal == {int(designs[0]), int(images[0])}
    distribution.take_round(designs, np.array([10.0]), sound, images, in_worlds=True)
    assert distribution.nominal == set()
    assert {score for score, _ in distribution.seen.values()} == {10.0}


def test_a_space_that_none_can_list_trains_and_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    space = DesignSpace(12, 4, 3, 12)
    assert len(space) > 10**7
    settings = replace(
        toy_settings(round_count=4),
        space=space,
        task=replace(TASK, regulator_count=4),
        expected_scores=True,
        evaluated_design_count=16,
    )
    assert settings.is_factored
    straight = learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, settings), settings, tmp_path / "straight"
    )

    class Stopped(RuntimeError):
        """As a kill would."""

    def stop(done: int, *_: object) -> None:
        if done >= 2 * settings.timesteps_per_round:
            raise Stopped

    with pytest.raises(Stopped):
        learn_in_folder(
            crawling(viscous_crawler_robot, make_simulator, settings),
            settings,
            tmp_path / "halves",
            progress=stop,
        )
    resumed = learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, settings),
        settings,
        tmp_path / "halves",
        resume=True,
    )
    assert resumed.pairs == straight.pairs
    assert straight.best.distance_cm > 0.0


def test_the_kind_of_belief_is_that_asked_for() -> None:
    toy = toy_settings(round_count=2)
    assert not toy.is_factored
    factored = replace(toy, distribution="factored")
    training = Training(crawling(viscous_crawler_robot, make_simulator, factored), factored)
    metrics = training.run_round()
    assert isinstance(training.learned.distribution, FactoredDistribution)
    assert sum(metrics["score_histogram"]) == pytest.approx(1.0)
    again = Training(crawling(viscous_crawler_robot, make_simulator, factored), factored)
    again.restore(training.arrays(), training.metadata())
    assert again.run_round()["return_mean_cm"] == training.run_round()["return_mean_cm"]


def test_what_is_known_of_designs_makes_them_candidates_and_weighs_nothing() -> None:
    """They are all good ones: against each other they would say that the worse of them are bad."""
    distribution = FactoredDistribution(LARGE, SCHEDULE, mirrored=True)
    designs = distribution.sample(2, np.random.default_rng(0))
    distribution.know(designs, np.array([15.0, 25.0]), LARGE.images(designs)[0])
    assert not distribution.weights_cm.any()
    found = distribution.candidates(5, None, np.random.default_rng(1))
    assert {*map(LARGE.twin, designs)} <= {*map(LARGE.twin, found)}
    with pytest.raises(ValueError, match="scores"):
        distribution.know(designs, np.array([15.0, np.nan]), None)


def test_designs_that_failed_are_candidates_after_all_others() -> None:
    """As of spaces that are listed, whatever is expected of them; where nothing else is left, of
    these."""
    every = np.arange(len(SMALL))
    for failing in (every % 2 == 0, np.ones(len(every), dtype=bool)):
        scores = np.where(failing, -1.0, 1.0) - 1e-3 * every
        distribution = FactoredDistribution(SMALL, SCHEDULE)
        distribution.take_round(every, scores, failing)
        expected = np.where(failing, 30.0, 5.0)
        found = distribution.candidates(8, expected.__getitem__, np.random.default_rng(0))
        assert len(set(found.tolist())) == 8
        assert failing[found].all() == failing.all()
        assert failing[found].any() == failing.all()


def test_sites_that_must_carry_a_leg_may_come_last() -> None:
    """Behind sites that may carry none, where some ways lead to too many legs: what is believed of
    it after a round is what it is of a list."""
    options = ("* b*", *("0 * b*",) * 3, "* b*")
    space = DesignSpace(5, 2, 2, 4, options=options)
    every = np.arange(len(space))
    distribution = FactoredDistribution(space, SCHEDULE)
    assert distribution.entropy == pytest.approx(np.log(len(space)), rel=1e-12)
    scores = scores_of(space, every)
    distribution.take_round(every, scores, np.zeros(len(every), dtype=bool))
    distribution.follow_schedule(50)
    logarithms = distribution.weighed.log_probability(space.options_of(every))
    probability = np.exp(logarithms)
    assert distribution.entropy == pytest.approx(-probability @ logarithms, rel=1e-12)
    assert distribution.said()["expected_score_cm"] == pytest.approx(
        probability @ distribution.scores_cm(every), rel=1e-9
    )
