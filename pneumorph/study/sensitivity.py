"""Which uncertain number a distance depends on, from the worlds that were walked already."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

LEAST_EFFECTIVE = 16.0
"""Worlds that must be left, by their weights, for a band to be told of them."""

BAND = (0.1, 0.5, 0.9)
"""Quantiles of a band."""


@dataclass(frozen=True)
class Sensitivity:
    """How a distance depends on one number of the worlds."""

    number: str
    rank_correlation: float
    """Spearman's, -1 to 1: positive where more of it goes further."""
    first_order_index: float
    """Share of the distance's variance that knowing it takes away on average (Sobol's), 0 to 1."""


def sensitivities(
    numbers: Mapping[str, np.ndarray], achieved: np.ndarray
) -> tuple[Sensitivity, ...]:
    """Of each number that differs from world to world, the largest index first.

    Args:
        numbers: Values in each world by name, each (world,).
        achieved: What is achieved in each [any unit], (world,).
    """
    from scipy.stats import spearmanr

    found = []
    for name, values in numbers.items():
        if np.ptp(values) == 0.0 or np.ptp(achieved) == 0.0:
            continue
        correlation = float(spearmanr(values, achieved).statistic)
        found.append(Sensitivity(name, correlation, first_order_index(values, achieved)))
    return tuple(sorted(found, key=lambda each: -each.first_order_index))


def first_order_index(values: np.ndarray, results: np.ndarray) -> float:
    """Var(E[result | value]) / Var(result), from classes of alike size.

    The share of variance between classes of values (Plischke, Borgonovo and Smith 2013), less what
    chance alone puts there (Kelley's 1935 epsilon squared), and not negative. Eight worlds a
    class, five to ten classes, so that of a linear dependence and of one with a turning point
    nearly all is seen; a number of as few values has a class for each.

    Args:
        values: Of one number, (world,).
        results: (world,).
    """
    count, kinds = len(values), np.unique(values)
    class_count = _class_count(count)
    if len(kinds) <= class_count:
        classes = [np.flatnonzero(values == kind) for kind in kinds]
    else:
        classes = np.array_split(np.argsort(values, kind="stable"), class_count)
    within = sum(float(((results[each] - results[each].mean()) ** 2).sum()) for each in classes)
    total = float(((results - results.mean()) ** 2).sum())
    if total == 0.0 or count <= len(classes):
        return 0.0
    unexplained = within / (count - len(classes)) / (total / (count - 1))
    return min(max(1.0 - unexplained, 0.0), 1.0)


def chance_index(count: int, share: float = 0.95, numbers: int = 1) -> float:
    """What the largest `first_order_index` of numbers that nothing depends on stays below so often.

    The share between k classes of n normal results is distributed as Beta((k - 1) / 2, (n - k) / 2)
    (Fisher's analysis of variance).

    Args:
        count: Worlds.
        share: How often, 0 to 1.
        numbers: How many of them.
    """
    from scipy.stats import beta

    classes = _class_count(count)
    if count <= classes:
        return 1.0
    between = float(
        beta.ppf(share ** (1.0 / numbers), (classes - 1) / 2.0, (count - classes) / 2.0)
    )
    return max(1.0 - (1.0 - between) * (count - 1) / (count - classes), 0.0)


def _class_count(count: int) -> int:
    return min(max(count // 8, 5), 10)


def weighted_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: Sequence[float] = BAND
) -> np.ndarray:
    """Quantiles of weighted values, (share,).

    Linear between the middles of the weights; of equal weights Hazen's.

    Args:
        values: (value,).
        weights: Not negative, not all zero, (value,).
        shares: From 0 to 1.
    """
    order = np.argsort(values, kind="stable")
    weight = weights[order] / weights.sum()
    quantiles: np.ndarray = np.interp(shares, np.cumsum(weight) - 0.5 * weight, values[order])
    return quantiles


def agreement(values: np.ndarray, deviation: float) -> np.ndarray:
    """How well the other worlds agree with what would be measured in each, (world, others).

    Each world is taken for the true one in turn; where what is measured there leaves too few of the
    others, the measurement is taken for less exact, so that a band of them is rather too wide.

    Args:
        values: Of the number, (world,).
        deviation: Standard deviation of the measurement.
    """
    apart = values - values[:, None]
    return np.array([_weights(np.delete(row, true), deviation) for true, row in enumerate(apart)])


def mean_width(weights: np.ndarray, achieved: np.ndarray) -> float:
    """Width of the band, 10th to 90th percentile, that a measurement of one number would leave, on
    average over what it may find: of the other worlds, over the worlds [unit of `achieved`].

    Args:
        weights: As `agreement` returns them, (world, others).
        achieved: What is achieved in each [any unit], (world,).
    """
    order = np.argsort(achieved, kind="stable")
    widths = []
    for true, own in enumerate(weights):
        others = order[order != true]
        weight = own[others - (others > true)]  # the others are numbered without the world itself
        middle = (np.cumsum(weight) - 0.5 * weight) / weight.sum()
        low, high = np.interp(BAND[::2], middle, achieved[others])
        widths.append(high - low)
    return float(np.mean(widths))


def _weights(apart: np.ndarray, deviation: float) -> np.ndarray:
    """Likelihoods of worlds that are so far from what was measured, of enough of them."""
    enough = min(LEAST_EFFECTIVE, 0.5 * len(apart))
    while True:
        weights: np.ndarray = np.exp(-0.5 * (apart / deviation) ** 2)
        squares = float((weights**2).sum())
        if squares > 0.0 and weights.sum() ** 2 / squares >= enough:
            return weights
        deviation *= 1.25
