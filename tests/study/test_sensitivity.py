"""What distances depend on, from the worlds that were walked: identities and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from pneumorph.catalogue.bench_tests import BENCH_TESTS, BenchTest
from pneumorph.catalogue.measured_worlds import UNCERTAINTIES
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.certified_pairs import Band
from pneumorph.study.measure_next import ExpectedNarrowing, narrowings, worth_measuring
from pneumorph.study.robustness import robustness
from pneumorph.study.sensitivity import (
    agreement,
    chance_index,
    first_order_index,
    mean_width,
    sensitivities,
    weighted_quantiles,
)


def test_first_order_indices_of_a_sum() -> None:
    """Of 2 x + y with x and y uniform 4/5 and 1/5, of the product of two centred ones none, by 400
    worlds: the index's standard error is then below 0.03, and ten classes lose 1 % of x."""
    x, y, unrelated = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 400))
    assert first_order_index(x, 2.0 * x + y) == pytest.approx(0.8, abs=0.06)
    assert first_order_index(y, 2.0 * x + y) == pytest.approx(0.2, abs=0.1)
    assert first_order_index(unrelated, 2.0 * x + y) < 0.06
    assert first_order_index(x, x * y) < 0.06
    # A parabola has no rank correlation, and all of the variance.
    (found,) = sensitivities({"x": x, "the same everywhere": np.ones(400)}, x**2)
    assert abs(found.rank_correlation) < 0.2
    assert found.first_order_index > 0.9


def test_a_number_of_few_values_has_a_class_for_each() -> None:
    """Of y that is noise of deviation 1 plus 2 for one of three kinds: 8/9 of 1 + 8/9 in halves of
    one and two thirds; a class that mixes kinds tells less."""
    rng = np.random.default_rng(0)
    kinds = rng.integers(3, size=400).astype(float)
    share = first_order_index(kinds, rng.normal(size=400) + 2.0 * (kinds == 1.0))
    assert share == pytest.approx((8.0 / 9.0) / (1.0 + 8.0 / 9.0), abs=0.08)


def _several(count: int) -> np.ndarray:
    """Five numbers and a result that depends on none of them, (draw, 6, world)."""
    return np.random.default_rng(6).normal(size=(600, 6, count))


@pytest.mark.parametrize("count", [48, 200])
def test_chance_stays_below_its_index_in_nineteen_of_twenty(count: int) -> None:
    """Normal results that depend on nothing; of 2000 draws the share's standard error is 0.005."""
    drawn = np.random.default_rng(2).normal(size=(2000, 2, count))
    found = np.array([first_order_index(x, y) for x, y in drawn])
    assert np.mean(found < chance_index(count)) == pytest.approx(0.95, abs=0.015)
    several = np.array([max(first_order_index(x, y) for x in xs) for *xs, y in _several(count)])
    assert np.mean(several < chance_index(count, numbers=5)) == pytest.approx(0.95, abs=0.03)
    assert chance_index(2) == 1.0  # as many classes as worlds tell nothing


def test_sensitivities_are_sorted_and_signed() -> None:
    x, y = np.random.default_rng(1).uniform(-1.0, 1.0, (2, 200))
    found = sensitivities({"little": y, "much": x}, y - 3.0 * x)
    assert [each.number for each in found] == ["much", "little"]
    assert found[0].rank_correlation < -0.8 < 0.0 < found[1].rank_correlation


def test_quantiles_of_weights() -> None:
    """Weights that are whole numbers are repetitions; equal ones give Hazen's quantiles."""
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.0])
    repeated = np.quantile([1.0, 1.0, 2.0, 3.0], [0.5, 0.75], method="hazen")
    np.testing.assert_allclose(weighted_quantiles(values, weights, (0.625, 0.875)), [2.0, 3.0])
    np.testing.assert_allclose(
        weighted_quantiles(np.array([1.0, 1.0, 2.0, 3.0]), np.ones(4), (0.5, 0.75)), repeated
    )


def test_a_tenth_percentile_is_one_thing() -> None:
    """Of pairs in drawn worlds and of a certificate's bands."""
    distances = np.random.default_rng(3).normal(size=64)
    (pair,) = robustness(["L1"], np.zeros(1), distances[:, None]).pairs
    assert pair.tenth_percentile == Band.of(distances).low
    assert pair.tenth_percentile == pytest.approx(np.quantile(distances, 0.1, method="hazen"))


def test_a_band_is_that_of_a_sample_in_which_failures_go_nowhere() -> None:
    """Of 1, 3, 5, 7 and a failure: quantiles at Hazen's places, the deviation of a sample."""
    band = Band.of(np.array([5.0, 1.0, np.nan, 7.0, 3.0]))
    assert (band.low, band.median, band.high) == pytest.approx((0.0, 3.0, 7.0))
    assert (band.mean, band.failed_count) == (3.2, 1)
    assert band.deviation == pytest.approx(
        np.sqrt((3.2**2 + 2.2**2 + 0.2**2 + 1.8**2 + 3.8**2) / 4)
    )


def test_a_failure_is_never_better_than_going_back() -> None:
    """Its robot counts for no more than where it achieved least."""
    band = Band.of(np.array([-5.0, -1.0, np.nan, -7.0, -3.0]))
    assert (band.low, band.median, band.high) == pytest.approx((-7.0, -5.0, -1.0))
    assert (band.mean, band.failed_count) == (pytest.approx(-4.6), 1)


def test_percentiles_have_the_errors_of_order_statistics() -> None:
    """Of many samples of a normal, sqrt(p (1 - p) / n) over the density, to 5 % for samples of 200;
    the mean of 400 estimates scatters by a percent."""
    rng, count = np.random.default_rng(4), 200
    bands = [Band.of(rng.normal(size=count)) for _ in range(400)]
    for name, share in (("low", 0.1), ("median", 0.5), ("high", 0.9)):
        expected = np.sqrt(share * (1.0 - share) / count) / norm.pdf(norm.ppf(share))
        found = [getattr(band, f"{name}_error") for band in bands]
        assert np.mean(found) == pytest.approx(expected, rel=0.07)


def test_the_width_that_a_measurement_leaves() -> None:
    """Of x + y, both normal, an exact measurement of x leaves the band of y, 2.563 deviations; one
    that is as uncertain as x itself leaves a variance of a half of x's. Twelve per cent is what 400
    worlds with weights of 16 and more scatter by."""
    x, y = np.random.default_rng(2).normal(size=(2, 400))
    spread = 2.0 * 1.2816
    width = mean_width(agreement(x, 1e-6), 2.0 * x + y)
    assert width == pytest.approx(spread, rel=0.12)
    width = mean_width(agreement(x, 1.0), 2.0 * x + y)
    assert width == pytest.approx(spread * np.sqrt(3.0), rel=0.12)
    assert mean_width(agreement(y, 1e3), x) == pytest.approx(spread, rel=0.12)


def test_the_test_that_is_worth_making() -> None:
    """Distances that depend on the modulus alone ask for a bend; on nothing that is known, for
    nothing."""
    rng = np.random.default_rng(3)
    numbers = {
        name: rng.uniform(0.8, 1.2, 200) for name in ("modulus_factor", "mass_factor", "friction")
    }
    could = narrowings(numbers, 10.0 * numbers["modulus_factor"])
    tests = could.tests
    assert worth_measuring(tests, could.chance) == "bend at one pressure"
    today = np.ptp(np.quantile(10.0 * numbers["modulus_factor"], [0.1, 0.9], method="hazen"))
    assert tests[0].narrowing == pytest.approx(today - tests[0].width)
    # A deviation of 0.03 leaves 2.563 x 0.3 of about 3.2 cm.
    assert tests[0].width == pytest.approx(0.77, rel=0.1)
    nothing = narrowings(numbers, np.ones(200))
    assert worth_measuring(nothing.tests, nothing.chance) is None
    both = 10.0 * (numbers["modulus_factor"] + numbers["mass_factor"])
    # Both tell as much, and scales are quicker.
    alike = narrowings(numbers, both)
    assert worth_measuring(alike.tests, alike.chance) == "weighing"


def test_what_is_known_as_well_is_not_measured_again() -> None:
    """A bend at one pressure errs by 0.03 of the modulus, half of it in all readings alike: five
    readings know it to 0.019, and a sixth would change that by next to nothing."""
    numbers = {"modulus_factor": np.random.default_rng(6).normal(1.0, 0.1, 200)}
    far = 10.0 * numbers["modulus_factor"]
    known, vague = (
        narrowings(numbers, far, {"modulus_factor": (1.0, each)}) for each in (0.019, 0.1)
    )
    assert (known.tests, worth_measuring(known.tests, known.chance)) == ((), None)
    assert vague == narrowings(numbers, far)
    assert worth_measuring(vague.tests, vague.chance) == "bend at one pressure"


@pytest.mark.parametrize("test", BENCH_TESTS, ids=lambda test: test.name)
def test_one_reading_is_enough_whatever_worlds_are_drawn_then(test: BenchTest) -> None:
    """Whose median lies beside the value that was read."""
    value = 0.5
    deviation = test.deviation_at(value)
    for seed in range(20):
        numbers = {test.number: np.random.default_rng(seed).normal(value, deviation, 64)}
        could = narrowings(numbers, numbers[test.number], {test.number: (value, deviation)})
        assert could.tests == ()


def test_chance_names_a_test_in_one_of_twenty() -> None:
    """Distances with two peaks, as of robots that fall in some worlds: bands of few worlds are
    narrower than that of all. Of 60 draws at most 8 may name one, with a probability of 0.003."""
    rng, named, count = np.random.default_rng(4), 0, 48
    for _ in range(60):
        numbers = {
            name: rng.uniform(0.8, 1.2, count)
            for name in ("modulus_factor", "mass_factor", "filling_factor")
        }
        falls = rng.random(count) < 0.15
        far = np.where(falls, rng.normal(5.0, 1.0, count), rng.normal(30.0, 3.0, count))
        could = narrowings(numbers, far)
        named += worth_measuring(could.tests, could.chance) is not None
    assert named <= 8


@pytest.mark.parametrize("count", [48, 96, 200])
def test_what_one_number_decides_is_seen_in_short_certificates(count: int) -> None:
    """Linear and with a turning point: a class of an eighth holds 1/64 of a uniform one's variance
    and 4/64 of a folded one's, five classes 1/25 and up to 4/25 beside its point."""
    x = np.random.default_rng(5).uniform(-1.0, 1.0, count)
    assert first_order_index(x, x) > 0.93
    assert first_order_index(x, np.abs(x)) > 0.7


def test_of_tests_that_tell_nearly_as_much_the_quickest_is_named() -> None:
    most = ExpectedNarrowing("slow", "friction", 20.0, "", width=1.0, narrowing=5.0)
    nearly = replace(most, test="quick", minutes=2.0, narrowing=4.6)
    little = replace(most, test="at once", minutes=1.0, narrowing=4.4)
    assert worth_measuring((most, nearly, little), 1.0) == "quick"
    assert worth_measuring((most, little), 1.0) == "slow"
    assert worth_measuring((most, nearly, little), 5.0) is None


def test_bands_are_honest_before_and_after_tests() -> None:
    """80 hidden worlds with distances by a formula of three numbers, each told by three noisy
    tests: bands of 80 % contain 80 % of the distances, before and after, within three standard
    errors, 0.134; and they become narrower by more than half."""
    prior = Randomisation(
        friction="U(0.3, 1.2)", modulus_factor="U(0.85, 1.15)", mass_factor="N(1, 0.05)"
    )

    def distance_cm(world: World) -> float:
        return 6.0 * np.sqrt(world.friction) / world.modulus_factor - 3.0 * world.mass_factor**2

    def band(drawn: Randomisation, seed: int) -> Band:
        worlds = unseen_worlds(drawn, 40, seed)
        return Band.of(np.array([distance_cm(world) for world in worlds]))

    hidden_rng, noise = np.random.default_rng([4, 4]), np.random.default_rng(5)
    deviations = {"friction": 0.04, "modulus_factor": 0.03, "mass_factor": 0.01}
    inside, width = np.zeros((2, 80), bool), np.zeros((2, 80))
    for number in range(80):
        hidden = prior.draw(hidden_rng)
        found = tuple(
            (name, hidden.numbers[name] + deviation * float(noise.standard_normal()), deviation)
            for name, deviation in deviations.items()
        )
        for row, drawn in enumerate((prior, replace(prior, measured=found))):
            said = band(drawn, number)
            inside[row, number] = said.low <= distance_cm(hidden) <= said.high
            width[row, number] = said.high - said.low
    assert inside.mean(axis=1) == pytest.approx(0.8, abs=0.134)
    assert width[1].mean() < 0.5 * width[0].mean()


def test_every_uncertain_number_has_a_test() -> None:
    assert {test.number for test in BENCH_TESTS} == set(UNCERTAINTIES)
    assert all(test.how and test.minutes > 0.0 for test in BENCH_TESTS)
