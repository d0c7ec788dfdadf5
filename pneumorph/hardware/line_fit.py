"""A straight line through points by least squares, with confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SAME_PLACE = 0.0099
"""Readings nearer to the next lower one than this share of the range are of the same place: just
below 1 %, so that a staircase of up to 100 even steps has a place at each pressure."""
WIDEST_PLACE = 0.0299
"""How far a place reaches at most from its lowest reading, as a share of the range, so that a slow
ramp is cut into pieces; regulators scatter by less."""


@dataclass(frozen=True)
class LineFit:
    """y = slope x + intercept, with 95 % confidence intervals of both."""

    slope: float
    intercept: float
    slope_interval: tuple[float, float]
    """95 % confidence interval of the slope; NaN of points at two places, through whose means a
    line always goes: nothing tells how far it is off elsewhere."""
    intercept_interval: tuple[float, float]
    """The same of the intercept."""
    r_squared: float
    """Share of the variance of the means of y at the places that the line explains."""
    rms: float
    """Root mean square of the residuals, in units of y."""
    point_count: int


def fit_line(x: np.ndarray, y: np.ndarray, confidence: float = 0.95) -> LineFit:
    """Ordinary least squares; intervals by Student's t with m - 2 degrees of freedom.

    The m points are the means at the places (`SAME_PLACE`), each of which counts once: what the
    line itself lacks there is the same in all repeats, which know no more of it. The standard
    errors are s / sqrt(Sxx) and s sqrt(1/m + mean(x)^2 / Sxx) with s^2 = sum r^2 / (m - 2) (Draper
    and Smith, Applied Regression Analysis, 1998, section 1.4). They take the means to scatter
    alike: where noise is all that scatters them, places should be read about equally often.

    Args:
        x: Abscissae, (point,).
        y: Ordinates, (point,).
        confidence: Of the intervals.

    Raises:
        ValueError: Fewer than three points, or all at the same place.
    """
    from scipy.stats import t as student

    count = len(x)
    if count < 3:
        raise ValueError(f"a line with confidence needs at least 3 points, got {count}")
    if not np.ptp(x) > 0.0:
        raise ValueError(f"all {count} points are at {x[0]:g}, expected different ones")
    of = _places(x)
    readings = np.bincount(of)
    places, means = x, y
    if len(readings) < count:
        places, means = np.bincount(of, x) / readings, np.bincount(of, y) / readings
    mean = float(np.mean(places))
    spread = float(np.sum((places - mean) ** 2))
    slope = float(np.sum((places - mean) * (means - np.mean(means))) / spread)
    intercept = float(np.mean(means)) - slope * mean
    slope_error = intercept_error = np.nan
    missed = means - slope * places - intercept
    if (freedom := len(places) - 2) > 0:
        scatter = np.sqrt(float(missed @ missed) / freedom)
        reach = float(student.ppf(0.5 + 0.5 * confidence, freedom))
        slope_error = reach * scatter / np.sqrt(spread)
        intercept_error = reach * scatter * np.sqrt(1.0 / len(places) + mean**2 / spread)
    residual = y - slope * x - intercept
    total = float(np.sum((means - np.mean(means)) ** 2))
    return LineFit(
        slope,
        intercept,
        (float(slope - slope_error), float(slope + slope_error)),
        (float(intercept - intercept_error), float(intercept + intercept_error)),
        1.0 - float(missed @ missed) / total if total > 0.0 else 1.0,
        float(np.sqrt(float(residual @ residual) / count)),
        count,
    )


def _places(x: np.ndarray) -> np.ndarray:
    """Number of the place of each point, from the lowest up, (point,)."""
    found = np.empty(len(x), dtype=int)
    number, lowest, last, span = -1, -np.inf, -np.inf, np.ptp(x)
    for each in np.argsort(x, kind="stable"):
        if x[each] - last >= SAME_PLACE * span or x[each] - lowest >= WIDEST_PLACE * span:
            number, lowest = number + 1, x[each]
        found[each], last = number, x[each]
    return found
