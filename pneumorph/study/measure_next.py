"""Which test of a robot would narrow what is expected of it most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pneumorph.base.result import in_cm
from pneumorph.catalogue.bench_tests import BENCH_TESTS
from pneumorph.study.sensitivity import agreement, mean_width, weighted_quantiles

_PERMUTED = 60
"""How often distances are dealt out to the worlds anew."""
_SHARE = 0.95
"""Of these, how many a test must be ahead of."""


@dataclass(frozen=True)
class ExpectedNarrowing:
    """What a test of the robot would do to the best pair's band."""

    test: str
    number: str
    minutes: float
    how: str
    width: float = field(metadata=in_cm("width_cm"))
    """Expected width from the 10th to the 90th percentile."""
    narrowing: float = field(metadata=in_cm("narrowing_cm"))
    """Today's width less that."""


@dataclass(frozen=True)
class Narrowings:
    """What could be tested.

    Attributes:
        tests: The most useful first.
        chance: What the best of them would seem to narrow a band by in one of twenty cases in
            which the distance depends on nothing [its unit].
    """

    tests: tuple[ExpectedNarrowing, ...]
    chance: float


def narrowings(
    numbers: Mapping[str, np.ndarray],
    achieved: np.ndarray,
    measured: Mapping[str, tuple[float, float]] | None = None,
) -> Narrowings:
    """What each test of a number that differs would leave of a band.

    A band of few worlds, which is what agrees with a measurement, is narrower than that of many
    where distances have thin tails or two peaks, whatever is measured. So the width that a test
    leaves is set beside the widths that it leaves of distances that are dealt out to the worlds
    anew, which depend on nothing (a permutation test; Good, Permutation Tests, 2000).

    Args:
        numbers: Values in each world by name, each (world,).
        achieved: What is achieved in each [any unit], (world,).
        measured: What the worlds agree with already, value and standard deviation by the number. A
            number that is known as well as one reading tells it is not tested again: much of a
            reading's error is in all readings alike.
    """
    measured = measured or {}
    low, _, high = weighted_quantiles(achieved, np.ones(len(achieved)))
    rng, today = np.random.default_rng(0), float(high - low)
    dealt = [rng.permutation(achieved) for _ in range(_PERMUTED)]
    found, by_chance = [], []
    for test in BENCH_TESTS:
        values = numbers.get(test.number)
        if values is None or np.ptp(values) == 0.0:
            continue
        found_value, found_deviation = measured.get(test.number, (0.0, np.inf))
        if found_deviation <= test.deviation_at(found_value) * (1.0 + 1e-9):
            continue
        deviation = test.deviation_at(float(np.median(values)))
        agreeing = agreement(values, deviation)
        without = np.array([mean_width(agreeing, each) for each in dealt])
        narrowing = float(without.mean()) - mean_width(agreeing, achieved)
        by_chance.append(without.mean() - without)
        found.append(
            ExpectedNarrowing(
                test.name, test.number, test.minutes, test.how, today - narrowing, narrowing
            )
        )
    best = np.max(by_chance, axis=0) if by_chance else np.zeros(1)
    return Narrowings(
        tuple(sorted(found, key=lambda each: -each.narrowing)), float(np.quantile(best, _SHARE))
    )


def worth_measuring(tests: Sequence[ExpectedNarrowing], chance: float) -> str | None:
    """Name of the test that narrows most; of some that do nearly as much, the quickest. None where
    the best does no more than chance may.

    Args:
        tests: As `narrowings` returns them.
        chance: Likewise.
    """
    if not tests:
        return None
    best = tests[0].narrowing
    if best <= chance:
        return None
    least = max(0.9 * best, chance)
    as_good = [each for each in tests if each.narrowing >= least]
    return min(as_good, key=lambda each: each.minutes).test
