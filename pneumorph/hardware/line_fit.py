"""A straight line through points by least squares, with confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LineFit:
    """y = slope x + intercept, with 95 % confidence intervals of both."""

    slope: float
    intercept: float
    slope_interval: tuple[float, float]
    """95 % confidence interval of the slope."""
    intercept_interval: tuple[float, float]
    """95 % confidence interval of the intercept."""
    r_squared: float
    """Share of the variance of y that the line explains."""
    rms: float
    """Root mean square of the residuals, in units of y."""
    point_count: int


def fit_line(x: np.ndarray, y: np.ndarray, confidence: float = 0.95) -> LineFit:
    """Ordinary least squares; intervals by Student's t with n - 2 degrees of freedom.

    The standard errors are s / sqrt(Sxx) and s sqrt(1/n + mean(x)^2 / Sxx) with
    s^2 = sum r^2 / (n - 2) (Draper and Smith, Applied Regression Analysis, 1998, section 1.4).
    Where points repeat, r is what the means at the m places are off, each counted as often as it
    has points, with m - 2 degrees of freedom (the mean square of the lack of fit, section 2.1):
    what the line itself lacks there is the same in all repeats, which know no more of it. Of two
    places, whose means no line misses, the points count.

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
    mean = float(np.mean(x))
    spread = float(np.sum((x - mean) ** 2))
    if spread <= 0.0:
        raise ValueError(f"all {count} points are at {mean:g}, expected different ones")
    slope = float(np.sum((x - mean) * (y - np.mean(y))) / spread)
    intercept = float(np.mean(y)) - slope * mean
    residual = y - slope * x - intercept
    square_sum = float(residual @ residual)
    freedom, missed = count - 2, square_sum
    places, of = np.unique(x, return_inverse=True)
    if 3 <= len(places) < count:
        freedom = len(places) - 2
        missed = float(np.sum(np.bincount(of, residual) ** 2 / np.bincount(of)))
    scatter = np.sqrt(missed / freedom)
    reach = float(student.ppf(0.5 + 0.5 * confidence, freedom))
    slope_error = reach * scatter / np.sqrt(spread)
    intercept_error = reach * scatter * np.sqrt(1.0 / count + mean**2 / spread)
    total = float(np.sum((y - np.mean(y)) ** 2))
    return LineFit(
        slope,
        intercept,
        (float(slope - slope_error), float(slope + slope_error)),
        (float(intercept - intercept_error), float(intercept + intercept_error)),
        1.0 - square_sum / total if total > 0.0 else 1.0,
        float(np.sqrt(square_sum / count)),
        count,
    )
