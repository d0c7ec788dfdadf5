"""The design distribution is Gibbs', and its entropy follows the schedule."""

import numpy as np
import pytest
from scipy.special import ndtri

from pneumorph.learn.design_distribution import (
    DesignDistribution,
    EntropySchedule,
    entropy,
    gibbs,
    match_entropy,
)

PAPER = EntropySchedule()


def test_gibbs_distribution_of_two_designs_is_the_logistic() -> None:
    for beta, difference in ((0.0, 3.0), (0.7, 2.0), (20.0, 80.0)):
        first = gibbs(np.array([1.0 + difference, 1.0]), beta)[0]
        np.testing.assert_allclose(first, 1.0 / (1.0 + np.exp(-beta * difference)), rtol=1e-14)


def test_entropy_of_a_uniform_distribution_is_the_logarithm_of_its_size() -> None:
    np.testing.assert_allclose(entropy(np.full(6972, 1 / 6972)), np.log(6972), rtol=1e-12)
    assert entropy(np.array([1.0, 0.0])) == 0.0


def test_schedule_is_the_papers() -> None:
    assert PAPER.target(0, 6972) == PAPER.target(200_000, 6972) == np.log(6972)
    np.testing.assert_allclose(PAPER.target(575_000, 6972), 0.5 * np.log(6972), rtol=1e-14)
    assert PAPER.target(950_000, 6972) == PAPER.target(1_000_000, 6972) == 0.0


def test_schedule_can_end_above_zero_and_scores_can_start_elsewhere() -> None:
    schedule = EntropySchedule(0, 100, final_entropy=1.0, initial_score_cm=-2.0)
    np.testing.assert_allclose(schedule.target(50, 100), 0.5 * (np.log(100) + 1.0), rtol=1e-14)
    assert schedule.target(100, 100) == 1.0
    assert schedule.target(100, 2) == np.log(2)  # no distribution over two has more
    np.testing.assert_array_equal(DesignDistribution(3, schedule).scores, -2.0)


@pytest.mark.parametrize("share", [0.95, 0.5, 0.2, 0.02])
def test_bisection_reaches_the_entropy_asked_for(share: float) -> None:
    # The quantiles of N(2, 3): of drawn scores the best two may lie so close that even the largest
    # beta, 20 / cm, leaves more entropy than was asked for.
    scores = 2.0 + 3.0 * ndtri((np.arange(6972) + 0.5) / 6972)
    target = share * np.log(6972)
    beta = match_entropy(scores, target)
    assert abs(entropy(gibbs(scores, beta)) - target) <= 0.01
    assert 0.0 < beta < 20.0


def test_bisection_stops_at_its_ends() -> None:
    scores = np.array([0.0, 0.001])
    assert match_entropy(scores, np.log(2)) == 0.0
    assert match_entropy(scores, 0.0) == 20.0
    assert match_entropy(np.zeros(7), 1.0) == 20.0


def test_entropy_follows_its_target_as_returns_come_in() -> None:
    rng = np.random.default_rng(0)
    distribution = DesignDistribution(500, EntropySchedule(5_000, 50_000))
    truth = rng.normal(0.0, 2.0, 500)
    for timestep in range(0, 50_000, 960):
        designs = distribution.sample(96, rng)
        distribution.record(designs, truth[designs] + rng.normal(0, 0.1, 96))
        distribution.follow_schedule(timestep)
        if distribution.inverse_temperature < 20.0:
            assert abs(distribution.entropy - distribution.target_entropy(timestep)) <= 0.01
    assert distribution.entropy < 0.5
    assert distribution.scores.argmax() == distribution.probabilities.argmax()


def test_designs_that_never_walked_are_not_preferred_where_all_that_walk_are_penalised() -> None:
    """With a reward that is negative throughout, what was tried and is good is what remains; one
    that is mostly positive leaves untried designs at the initial score."""
    rng = np.random.default_rng(0)
    truth = -rng.uniform(1.0, 6.0, 5000)
    distribution = DesignDistribution(5000, EntropySchedule(200, 1500, final_entropy=2.0))
    failed = np.zeros(48, dtype=bool)
    for timestep in range(0, 2000, 48):
        designs = distribution.sample(48, rng)
        distribution.take_round(designs, truth[designs], failed)
        distribution.follow_schedule(timestep)
    assert distribution.entropy < 3.0
    best = distribution.candidates(8, None, rng)
    assert distribution.walked[best].all()
    assert (truth[best] > -1.6).all()
    untried = distribution.scores[~distribution.walked]
    assert untried == pytest.approx(distribution.scores[distribution.walked].mean())
    other = DesignDistribution(5000, EntropySchedule(200, 1500))
    other.restore(distribution.arrays())
    for each in (distribution, other):
        each.take_round(np.arange(48), np.full(48, -9.0), failed)
    np.testing.assert_array_equal(other.scores, distribution.scores)
    positive = DesignDistribution(5000, EntropySchedule(200, 1500))
    positive.take_round(np.arange(48), np.linspace(-1.0, 2.0, 48), failed)
    assert (positive.scores[48:] == 0.0).all()


def test_scores_of_single_worlds_fall_by_what_those_lose_that_walk_in_several() -> None:
    """In the nominal world 0 to 3 made 20, 22, 24 and 26 cm. In several 1 and 3 score 8 and 14, so
    they lost 13 in the mean, as 0 and 2 would. What walked in several worlds stays, and so does
    what never walked."""
    distribution = DesignDistribution(7, EntropySchedule(100, 200))
    first, sound = np.array([0, 1, 2, 3]), np.zeros(4, dtype=bool)
    distribution.take_round(first, np.array([20.0, 22.0, 24.0, 26.0]), sound)
    again = DesignDistribution(7, EntropySchedule(100, 200))
    again.restore(distribution.arrays())
    for each in (distribution, again):
        each.know(np.array([4]), np.array([9.0]), None)
        assert each.scores.tolist() == [20.0, 22.0, 24.0, 26.0, 9.0, 0.0, 0.0]
        scores = np.array([8.0, 14.0, 6.0, 1.0])
        each.take_round(np.array([1, 3, 4, 5]), scores, sound, in_worlds=True)
        assert each.scores.tolist() == [7.0, 8.0, 11.0, 14.0, 6.0, 1.0, 0.0]
        assert np.flatnonzero(each.nominal).tolist() == [0, 2]
        # Where none walks in several worlds for the first time there is nothing to learn of it.
        each.take_round(np.array([1]), np.array([2.0]), sound[:1], in_worlds=True)
        assert each.scores.tolist() == [7.0, 2.0, 11.0, 14.0, 6.0, 1.0, 0.0]


def test_what_one_design_loses_moves_others_by_its_share_of_all_that_told() -> None:
    """Nine lost 10 cm in the mean; a tenth that loses none of what is left takes a tenth of it
    back. One that fails says nothing."""
    distribution = DesignDistribution(12, EntropySchedule(100, 200))
    every = np.arange(12)
    distribution.take_round(every, np.full(12, 25.0), np.zeros(12, dtype=bool))
    sound = np.zeros(9, dtype=bool)
    distribution.take_round(every[:9], np.full(9, 15.0), sound, in_worlds=True)
    np.testing.assert_allclose(distribution.scores[9:], 15.0)
    again = DesignDistribution(12, EntropySchedule(100, 200))
    again.restore(distribution.arrays())
    for each in (distribution, again):
        each.take_round(every[9:10], np.array([25.0]), sound[:1], in_worlds=True)
        np.testing.assert_allclose(each.scores[10:], 16.0)
        each.take_round(every[10:11], np.array([0.0]), ~sound[:1], in_worlds=True)
        np.testing.assert_allclose(each.scores[11], 16.0)


def test_a_design_that_failed_in_the_nominal_world_says_nothing_of_it() -> None:
    """Its score there is none of a walk: 4 cm in several worlds are no gain of 8."""
    distribution = DesignDistribution(4, EntropySchedule(100, 200))
    failing = np.array([False, False, True])
    distribution.take_round(np.array([0, 1, 2]), np.array([5.0, 0.0, -4.0]), failing)
    again = DesignDistribution(4, EntropySchedule(100, 200))
    again.restore(distribution.arrays())
    for each in (distribution, again):
        each.take_round(np.array([2]), np.array([4.0]), ~failing[2:], in_worlds=True)
        assert each.scores.tolist() == [5.0, 0.0, 4.0, 0.0]
        each.take_round(np.array([1]), np.array([-1.0]), ~failing[2:], in_worlds=True)
        assert each.scores.tolist() == [4.0, -1.0, 4.0, 0.0]


def test_in_rounds_of_single_worlds_the_newest_score_stays_as_it_is() -> None:
    """As in the published physics, where each design walks in one world throughout."""
    distribution = DesignDistribution(3, PAPER)
    for scores in ([4.0, 5.0], [1.0, -2.0]):
        distribution.take_round(np.array([0, 1]), np.array(scores), np.zeros(2, dtype=bool))
    assert distribution.scores[:2].tolist() == [1.0, -2.0]


def test_samples_have_the_distribution() -> None:
    distribution = DesignDistribution(4, PAPER)
    distribution.scores = np.log(np.array([1.0, 2.0, 3.0, 4.0]))
    distribution.set_inverse_temperature(1.0)
    count = 100_000
    drawn = distribution.sample(count, np.random.default_rng(0))
    shares = np.bincount(drawn, minlength=4) / count
    # Four standard deviations of a share: 4 sqrt(1/4 / count).
    np.testing.assert_allclose(shares, [0.1, 0.2, 0.3, 0.4], atol=2.0 / np.sqrt(count))


def test_newest_return_replaces_a_score() -> None:
    distribution = DesignDistribution(3, PAPER)
    np.testing.assert_array_equal(distribution.scores, 0.0)
    distribution.record(np.array([1, 1, 2]), np.array([5.0, 3.0, -1.0]))
    np.testing.assert_array_equal(distribution.scores, [0.0, 3.0, -1.0])


def test_candidates_are_the_highest_one_of_images() -> None:
    """1 and 3 are images, as are 0 and 4; 2 is its own."""
    twins = {0: 0, 1: 1, 2: 2, 3: 1, 4: 0}
    scores = np.array([5.0, 9.0, 1.0, 9.5, 5.0])
    for twin, expected in ((twins.__getitem__, [3, 0, 2]), (int, [3, 1, 0])):
        distribution = DesignDistribution(5, PAPER, twin)
        distribution.record(np.arange(5), scores)
        rng = np.random.default_rng(0)
        np.testing.assert_array_equal(distribution.candidates(3, None, rng), expected)
        np.testing.assert_array_equal(distribution.candidates(1, None, rng), expected[:1])
    with_images = DesignDistribution(5, PAPER, twins.__getitem__)
    with_images.record(np.arange(5), scores)
    assert len(with_images.candidates(5, None, rng)) == 3


def test_candidates_are_the_best_by_score_by_expectation_and_of_those_known_by_turns() -> None:
    """A design of an unlucky newest score is one where the critic expects much of it, but not one
    that failed; and so is one that was good in an earlier beginning."""
    distribution = DesignDistribution(6, PAPER)
    failing = np.array([0, 0, 0, 0, 0, 1], dtype=bool)
    distribution.take_round(np.arange(6), np.array([5.0, 9.0, 1.0, 2.0, 4.0, 0.0]), failing)
    expected = np.array([0.0, 3.0, 8.0, 2.0, 1.0, 20.0])
    rng = np.random.default_rng(0)

    def found(count: int, known: tuple[int, ...] = ()) -> list[int]:
        return distribution.candidates(count, expected.__getitem__, rng, known).tolist()

    assert found(4) == [1, 2, 0, 3]  # of 1, which is the second by expectation, once
    assert found(3, (4, 3)) == [1, 2, 4]
    assert sorted(found(9, (4,))) == [0, 1, 2, 3, 4, 5]


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match=r"returns\[1\] is nan, expected finite"):
        DesignDistribution(2, PAPER).record(np.array([0, 1]), np.array([1.0, np.nan]))
    with pytest.raises(ValueError, match="expected 0 <= start < end"):
        EntropySchedule(10, 10)
    with pytest.raises(ValueError, match="design_count is 0"):
        DesignDistribution(0, PAPER)


def test_expectations_raise_scores_and_returns_replace_them() -> None:
    distribution = DesignDistribution(3, EntropySchedule())
    distribution.record(np.array([0, 1]), np.array([4.0, -1.0]))
    distribution.raise_scores(np.array([3.0, 2.0, 5.0]))
    assert distribution.scores.tolist() == [4.0, 2.0, 5.0]
    distribution.record(np.array([2]), np.array([1.0]))
    assert distribution.scores.tolist() == [4.0, 2.0, 1.0]
