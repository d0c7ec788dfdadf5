"""Confidence intervals of non-linear least squares whose residuals are correlated in time."""

from __future__ import annotations

import numpy as np


def effective_count(residual: np.ndarray) -> float:
    """Independent samples that correlated residuals of one course in time amount to.

    n (1 - r) / (1 + r) with the residuals' lag-one correlation r (Bayley and Hammersley 1946).

    Args:
        residual: In the order of time, (sample,).
    """
    square = float(residual @ residual)
    r = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
    r = min(max(r, 0.0), 0.999)
    return max(1.0, len(residual) * (1.0 - r) / (1.0 + r))


def confidence_reach(jacobian: np.ndarray, residual: np.ndarray, effective: float) -> np.ndarray:
    """Half the width of each parameter's 95 % confidence interval, (parameter,); infinite of one
    that no sample changes with.

    Args:
        jacobian: Derivatives at the minimum, (sample, parameter).
        residual: What is left there, (sample,).
        effective: Independent samples that they amount to.
    """
    from scipy.stats import t as student

    freedom = max(effective - jacobian.shape[1], 1.0)
    variance = float(residual @ residual) / len(residual) * effective / freedom
    # The information of n samples that amount to so many independent ones.
    information = jacobian.T @ jacobian * effective / len(residual)
    covariance = variance * np.linalg.pinv(information)
    reach: np.ndarray = float(student.ppf(0.975, freedom)) * np.sqrt(np.diag(covariance))
    # The pseudo-inverse takes what cannot be seen for certain.
    return np.where(np.linalg.norm(jacobian, axis=0) > 1e-9, reach, np.inf)
