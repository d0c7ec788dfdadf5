"""Paths through choices: their number, weights and draws, against listing them one by one."""

from __future__ import annotations

from itertools import product
from math import comb

import numpy as np
import pytest
from scipy.special import stirling2
from scipy.stats import chi2

from pneumorph.robot.choice_paths import ChoicePaths, WeighedPaths
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

SPACE = DesignSpace(
    location_count=4, regulator_count=2, minimum_legs=2, maximum_legs=3,
    options=("0 * b*", "0 *", "0 *", "0 * b*"), exclusions=("0 2",), minimum_regulators=2,
)  # fmt: skip
LARGE = DesignSpace(
    location_count=12, regulator_count=4, maximum_legs=8, options=("0 * b* c*",) * 12
)
"""Ten thousand million designs."""


OBLIGATORY = DesignSpace(
    location_count=6, regulator_count=3, maximum_legs=4, options=("0 *",) * 5 + ("*",)
)
"""Of the last site's ways some lead to too many legs: nothing leads to the last of its nodes."""


def weighed(
    seed: int = 0, space: DesignSpace = SPACE
) -> tuple[WeighedPaths, np.ndarray, np.ndarray]:
    """Random weights, each path, and its probability by listing all."""
    rng = np.random.default_rng(seed)
    weights = [rng.normal(0.0, 1.5, count) for count in space.paths.option_counts]
    paths = np.array(list(space.paths))
    sums = sum(weight[column] for weight, column in zip(weights, paths.T, strict=True))
    return WeighedPaths(space.paths, weights), paths, np.exp(sums)


@pytest.mark.parametrize(("legs", "kinds"), [((0, 12), 1), ((3, 8), 3), ((5, 5), 26)])
def test_number_of_designs_is_that_of_the_closed_form(legs: tuple[int, int], kinds: int) -> None:
    """Choose the locations, split their legs into unnamed groups, give each a kind: exact where
    there are more than a float can count."""
    texts = " ".join(f"{chr(ord('a') + kind)}*" for kind in range(kinds))
    space = DesignSpace(12, 4, *legs, options=(f"0 {texts}",) * 12)
    wanted = sum(
        comb(12, leg) * kinds**leg
        * sum(int(stirling2(leg, group, exact=True)) for group in range(5))
        for leg in range(legs[0], legs[1] + 1)
    )  # fmt: skip
    assert space.paths.count == space.size == wanted


def test_paths_are_what_the_rules_allow() -> None:
    def allowed(options: tuple[int, ...]) -> bool:
        design = SPACE.of_options(options)
        return (
            2 <= design.leg_count <= 3
            and design == design.canonical()
            and len(design.regulator_order()) == 2
            and not (design.assignment[0] and design.assignment[2])
        )

    every = list(product(*map(range, SPACE.paths.option_counts)))
    wanted = [options for options in every if allowed(options)]
    assert list(SPACE.paths) == wanted
    assert [options for options in every if SPACE.paths.allows(options)] == wanted


@pytest.mark.parametrize("space", [SPACE, OBLIGATORY])
def test_weights_entropy_and_gradient_are_those_of_the_list(space: DesignSpace) -> None:
    """Equal but for rounding; marginals are the gradient of the logarithm of the total."""
    found, paths, weights = weighed(space=space)
    probability = weights / weights.sum()
    assert found.log_total == pytest.approx(np.log(weights.sum()), rel=1e-12)
    np.testing.assert_allclose(found.log_probability(paths), np.log(probability), atol=1e-12)
    assert found.entropy == pytest.approx(-np.sum(probability * np.log(probability)), rel=1e-12)
    for place, marginal in enumerate(found.marginals):
        wanted = [probability[paths[:, place] == at].sum() for at in range(len(marginal))]
        np.testing.assert_allclose(marginal, wanted, atol=1e-14)


def test_entropy_without_weights_is_the_logarithm_of_the_number() -> None:
    for space in (SPACE, LARGE, DesignSpace()):
        zero = [np.zeros(count) for count in space.paths.option_counts]
        even = WeighedPaths(space.paths, zero)
        assert even.entropy == pytest.approx(np.log(space.size), rel=1e-12)
        assert even.log_total == pytest.approx(np.log(space.size), rel=1e-12)


def test_draws_are_as_frequent_as_they_are_probable() -> None:
    """Pearson's statistic of 20 000 draws stays below what one fair sampler of 10^9 exceeds."""
    found, paths, weights = weighed()
    drawn = found.sample(20_000, np.random.default_rng(1))
    place = {tuple(path): number for number, path in enumerate(paths)}
    counts = np.bincount([place[tuple(row)] for row in drawn], minlength=len(paths))
    expected = len(drawn) * weights / weights.sum()
    assert expected.min() >= 5.0  # the statistic is distributed as chi squared
    statistic = np.sum((counts - expected) ** 2 / expected)
    assert statistic < chi2.isf(1e-9, len(paths) - 1)


def test_what_has_no_weight_is_never_drawn() -> None:
    """Weights so far apart that all but one path round to nothing; a draw at the very end of the
    sum still is that path."""

    class Last:
        """Draws the highest number below one."""

        def random(self, count: int) -> np.ndarray:
            return np.full(count, np.nextafter(1.0, 0.0))

    wanted = next(iter(SPACE.paths))
    weights = [np.full(count, -1e4) for count in SPACE.paths.option_counts]
    for place, option in enumerate(wanted):
        weights[place][option] = 0.0
    drawn = WeighedPaths(SPACE.paths, weights).sample(3, Last())  # type: ignore[arg-type]
    assert [tuple(row) for row in drawn] == [wanted] * 3


def test_rules_that_leave_no_path_are_told() -> None:
    none = ChoicePaths([2, 2], 0, lambda known, _, option: known + option, lambda known: known > 2)
    assert none.count == 0
    assert list(none) == []
    with pytest.raises(ValueError, match="there is no path"):
        WeighedPaths(none, [np.zeros(2), np.zeros(2)])


def test_designs_that_are_not_listed_have_a_number_each() -> None:
    assert not LARGE.is_listed
    assert len(LARGE) > 10**10
    drawn = LARGE.drawn(200, np.random.default_rng(0))
    assert len(set(drawn.tolist())) == 200
    for index in drawn:
        design = LARGE[int(index)]
        assert LARGE.index(design) == index
        assert design in LARGE
        assert Design.parse(str(design)) == design
    rows = [LARGE[int(index)].one_hot(4, 3) for index in drawn]
    np.testing.assert_array_equal(LARGE.features(drawn), rows)
    np.testing.assert_array_equal(
        LARGE.features(drawn.reshape(20, 10)), np.reshape(rows, (20, 10, -1))
    )
    # Numbers rise with the order of designs.
    assert [str(LARGE[index]) for index in np.sort(drawn)] == [
        str(design) for design in sorted((LARGE[index] for index in drawn), key=lambda design: [
            (each.regulators[0], each.module) if each else (0, 0)
            for each in ({f.location: f for f in design.fittings}.get(at) for at in range(12))
        ])
    ]  # fmt: skip
    assert LARGE.first == min([LARGE.first, *(LARGE[index] for index in drawn)])
    with pytest.raises(ValueError, match="rules on options, regulators or exclusions"):
        DesignSpace(
            location_count=12, regulator_count=4, maximum_legs=12, exclusions=("0 1",)
        ).index(Design.parse("1.1.1.0.0.0.0.0.0.0.0.0"))


def test_images_are_the_same_whether_designs_are_listed_or_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A space that could be listed, numbered by its choices."""

    def made() -> DesignSpace:
        return DesignSpace(5, 3, 2, 4, options=("0 * b*",) * 5, symmetries=("1 2 3 4 0",))

    listed = made()
    images = listed.mirror_index
    monkeypatch.setattr("pneumorph.robot.design_space.DESIGN_LIMIT", 100)
    coded = made()
    assert listed.is_listed
    assert not coded.is_listed
    numbers = np.array([coded.index(design) for design in listed])
    assert [coded[int(number)] for number in numbers] == list(listed)
    found, order = coded.images(numbers)
    np.testing.assert_array_equal(found, numbers[images])
    np.testing.assert_array_equal(order, listed.mirror_regulator)
    np.testing.assert_array_equal(coded.features(numbers), listed.one_hot)
    np.testing.assert_array_equal(
        coded.options_of(numbers), listed.options_of(np.arange(len(listed)))
    )
    assert [coded.twin(int(each)) for each in numbers] == np.minimum(numbers, found).tolist()
    # Turned designs count as one, whichever of them is drawn.
    assert set(coded.drawn(500, np.random.default_rng(0)).tolist()) <= set(numbers.tolist())
    with pytest.raises(ValueError, match="more than 100 designs"):
        _ = coded.designs


def test_choices_that_no_number_can_tell_apart_are_refused() -> None:
    with pytest.raises(ValueError, match=r"combined in .* ways, expected at most"):
        DesignSpace(30, 5, 3, 30, options=("0 * b* c*",) * 30).drawn(1, np.random.default_rng(0))


def test_designs_of_other_hubs_are_of_no_space() -> None:
    """Listed or not; they have legs where the space allows them, and too many or too few sites."""
    for space in (DesignSpace(), LARGE):
        for text in ("1.1.1", "1.1.1" + 10 * ".0"):
            design = Design.parse(text)
            assert not space.holds(design)
            assert design not in space
        assert space.holds(space.first)


def test_the_first_of_designs_that_are_not_listed_stands_for_its_class(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Choices are counted by what their first sites carry, and a turn may bring a lesser design."""
    monkeypatch.setattr("pneumorph.robot.design_space.DESIGN_LIMIT", 100)
    space = DesignSpace(
        4, 3, 2, 4, options=("*+* b*",) * 4, minimum_regulators=2, symmetries=("1 2 3 0",)
    )
    assert not space.is_listed
    assert space.form(space.first)[0] == space.first
    assert space.first in space
