"""Confidence intervals of non-linear least squares whose residuals are correlated in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Course:
    """Residuals of one measured course in time, such as one coordinate of a path, at the minimum.

    Attributes:
        jacobian: Their derivatives by the parameters, (sample, parameter).
        residual: In the order of time, (sample,).
        mean_removed: Whether their mean was fitted as well, for this course alone.
    """

    jacobian: np.ndarray
    residual: np.ndarray
    mean_removed: bool = False


@dataclass(frozen=True, eq=False)
class Confidence:
    """How well parameters are known.

    Attributes:
        reach: Half the width of each one's 95 % confidence interval, (parameter,); infinite of one
            that no sample changes with.
        effective: Independent samples behind the interval that rests on the fewest.
    """

    reach: np.ndarray
    effective: float


def effective_count(residual: np.ndarray, mean_removed: bool = False) -> float:
    """Independent samples that correlated residuals of one course in time amount to.

    n (1 - r) / (1 + r) with the residuals' lag-one correlation r (Bayley and Hammersley 1946),
    which comes out too small by (1 + 3 r) / n where the mean is their own (Marriott and Pope 1954,
    Biometrika 41:390).

    Args:
        residual: In the order of time, (sample,).
        mean_removed: Whether their own mean was taken off; it counts as one of the samples.
    """
    count, square = len(residual), float(residual @ residual)
    r = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
    if mean_removed:
        r += (1.0 + 3.0 * r) / count
    r = min(max(r, 0.0), 0.999)
    return max(1.0, count * (1.0 - r) / (1.0 + r) - (1.0 if mean_removed else 0.0))


def confidence(courses: Sequence[Course]) -> Confidence:
    """95 % confidence intervals of parameters that were fitted to courses.

    Courses are independent of each other, each with a deviation and a correlation of its own, so
    that one which hardly changes with a parameter says as little of how well it is known:

        C = A^-1 (sum_c s_c^2 n_c / m_c A_c) A^-1,   A_c = J_c^T J_c,   A = sum_c A_c,

    with n_c samples that amount to m_c (`effective_count`). Each course loses its share of the
    parameters, tr(A^-1 A_c), and Student's t has the degrees of freedom of Welch (1947) and
    Satterthwaite (1946). That holds where derivatives change slowly beside the residuals'
    correlation; an interval of a parameter whose derivative changes sign with every cycle is too
    wide, up to some five times at a correlation of 0.95 from sample to sample.

    Args:
        courses: At least one, all of the same parameters.
    """
    from scipy.stats import t as student

    squares = [course.jacobian.T @ course.jacobian for course in courses]
    inverse = np.linalg.pinv(np.sum(squares, axis=0))
    variances, freedoms = [], []
    for course, square in zip(courses, squares, strict=True):
        effective = effective_count(course.residual, course.mean_removed)
        freedom = max(effective - float(np.trace(inverse @ square)), 1.0)
        # s^2 n / m, with s^2 = |r|^2 / n m / freedom
        each = float(course.residual @ course.residual) / freedom
        variances.append(each * np.diag(inverse @ square @ inverse))
        freedoms.append(freedom)
    variance = np.sum(variances, axis=0)
    # Of what is known exactly or not at all every share is 0.
    share = np.array(variances) / np.where(variance > 0.0, variance, 1.0)
    spread = np.sum(share**2 / np.array(freedoms)[:, None], axis=0)
    freedom_of = np.where(spread > 0.0, 1.0 / np.where(spread > 0.0, spread, 1.0), sum(freedoms))
    reach = student.ppf(0.975, freedom_of) * np.sqrt(variance)
    # The pseudo-inverse takes what cannot be seen for certain.
    seen = np.sqrt(np.diag(np.sum(squares, axis=0))) > 1e-9
    rank = float(np.trace(inverse @ np.sum(squares, axis=0)))
    return Confidence(np.where(seen, reach, np.inf), float(freedom_of.min()) + rank)
