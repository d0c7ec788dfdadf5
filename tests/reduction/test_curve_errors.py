"""Errors of a bend or a force relative to its size, where it has one."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.reduction.errors import ReducedBend, ReducedBlockedForce

PRESSURE_KPA = np.array([1.0, 2.0, 3.0])
FULL = np.array([0.02, 5.0, 10.0])


def bend(reduced: np.ndarray) -> ReducedBend:
    return ReducedBend(PRESSURE_KPA, FULL, reduced, np.zeros(3), np.zeros((3, 1)))


def test_a_small_first_value_is_compared_as_a_twentieth_of_the_largest() -> None:
    """0.008 of 0.02 degrees is no error of 40 %."""
    reduced = FULL + np.array([0.008, 0.05, -0.2])
    found = bend(reduced)
    np.testing.assert_allclose(found.error_percent, [1.6, 1.0, -2.0])
    assert found.worst_percent == pytest.approx(2.0)
    forces = ReducedBlockedForce(PRESSURE_KPA, -FULL, -reduced, np.zeros((3, 1)))
    assert forces.worst_percent == pytest.approx(2.0)
    assert bend(FULL + np.array([0.2, 0.0, 0.0])).worst_percent == pytest.approx(40.0)


def test_a_missing_equilibrium_is_no_small_error() -> None:
    reduced = np.array([np.nan, 5.0, 10.0])
    assert bend(reduced).worst_percent == np.inf
    forces = ReducedBlockedForce(PRESSURE_KPA, FULL, reduced, np.zeros((2, 1)))
    assert forces.worst_percent == np.inf
