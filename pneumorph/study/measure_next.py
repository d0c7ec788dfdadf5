"""Which test of a robot would narrow what is expected of it most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.catalogue.bench_tests import BENCH_TESTS
from pneumorph.study.sensitivity import expected_width_cm, weighted_quantiles


@dataclass(frozen=True)
class ExpectedNarrowing:
    """What a test of the robot would do to the best pair's band."""

    test: str
    number: str
    minutes: float
    how: str
    width_cm: float
    """Expected width from the 10th to the 90th percentile."""
    narrowing_cm: float
    """Today's width less that."""


def narrowings(
    numbers: Mapping[str, np.ndarray], distance_cm: np.ndarray
) -> tuple[ExpectedNarrowing, ...]:
    """What each test of a number that differs would leave of a band, the most useful first.

    Args:
        numbers: Values in each world by name, each (world,).
        distance_cm: Distances [cm], (world,).
    """
    low, _, high = weighted_quantiles(distance_cm, np.ones(len(distance_cm)))
    found = []
    for test in BENCH_TESTS:
        values = numbers.get(test.number)
        if values is None or np.ptp(values) == 0.0:
            continue
        deviation = test.deviation_at(float(np.median(values)))
        width = expected_width_cm(values, deviation, distance_cm)
        found.append(
            ExpectedNarrowing(
                test.name, test.number, test.minutes, test.how, width, float(high - low) - width
            )
        )
    return tuple(sorted(found, key=lambda each: -each.narrowing_cm))


def worth_measuring(tests: Sequence[ExpectedNarrowing]) -> str | None:
    """Name of the test that narrows most; of some that do nearly as much, the quickest."""
    if not tests or tests[0].narrowing_cm <= 0.0:
        return None
    as_good = [each for each in tests if each.narrowing_cm >= 0.9 * tests[0].narrowing_cm]
    return min(as_good, key=lambda each: each.minutes).test
