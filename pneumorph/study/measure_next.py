"""Which test of a robot would narrow what is expected of it most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pneumorph.base.result import in_cm
from pneumorph.catalogue.bench_tests import BENCH_TESTS
from pneumorph.study.sensitivity import expected_width, weighted_quantiles

CHANCE_SHARE = 1.25
"""Over the root of the number of worlds: share of a band's width that the best of all tests seems
to take away though the distance depends on nothing. Measured: of 100 draws of `measured_worlds`
with normal distances of their own, 95 stay below 7.9 % with 200 worlds and 12.6 % with 96."""


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


def narrowings(
    numbers: Mapping[str, np.ndarray], achieved: np.ndarray
) -> tuple[ExpectedNarrowing, ...]:
    """What each test of a number that differs would leave of a band, the most useful first.

    Args:
        numbers: Values in each world by name, each (world,).
        achieved: What is achieved in each [any unit], (world,).
    """
    low, _, high = weighted_quantiles(achieved, np.ones(len(achieved)))
    found = []
    for test in BENCH_TESTS:
        values = numbers.get(test.number)
        if values is None or np.ptp(values) == 0.0:
            continue
        deviation = test.deviation_at(float(np.median(values)))
        width = expected_width(values, deviation, achieved)
        found.append(
            ExpectedNarrowing(
                test.name, test.number, test.minutes, test.how, width, float(high - low) - width
            )
        )
    return tuple(sorted(found, key=lambda each: -each.narrowing))


def worth_measuring(tests: Sequence[ExpectedNarrowing], world_count: int) -> str | None:
    """Name of the test that narrows most; of some that do nearly as much, the quickest. None where
    the best does no more than chance may (`CHANCE_SHARE`).

    Args:
        tests: As `narrowings` returns them.
        world_count: Number of worlds that they were told from.
    """
    if not tests:
        return None
    best = tests[0].narrowing
    if best <= CHANCE_SHARE / np.sqrt(world_count) * (best + tests[0].width):
        return None
    as_good = [each for each in tests if each.narrowing >= 0.9 * best]
    return min(as_good, key=lambda each: each.minutes).test
