"""Which of several pairs goes furthest, over worlds in some of which simulations fail."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.study.robustness import robustness


def test_a_failed_simulation_is_never_the_best() -> None:
    """Beside a pair that slides back; where both fail nobody is, and equal ones share a world."""
    nan = np.nan
    achieved = np.array([[nan, -1.0], [nan, -2.0], [nan, nan], [3.0, 3.0]])
    found = robustness(["L1", "L2"], np.array([1.0, 2.0]), achieved)
    shares = [pair.best_share for pair in found.pairs]
    assert shares == pytest.approx([0.125, 0.625])
    assert found.failed_count == 4


def test_a_pair_that_failed_where_nothing_is_drawn_hides_no_correlation() -> None:
    nominal = np.array([1.0, np.nan, 3.0])
    achieved = np.array([[1.0, 0.0, 2.0], [1.5, 0.5, 2.5]])
    assert robustness(["L1", "L2", "L3"], nominal, achieved).kendall_tau == pytest.approx(1.0)
