"""Equilibria along a path of pressure, from a solver that reaches no further than three units."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.synthetic_part import rubber_reduced_part

from pneumorph.reduction import modal_equilibrium
from pneumorph.reduction.modal_equilibrium import ModalEquilibrium, rising_modal_equilibria


@pytest.fixture
def asked(monkeypatch) -> list[float]:
    """Pressures that the solver is asked for; its states' first coordinate is the pressure."""
    pressures: list[float] = []

    def solve(part, pressure, *, start, **_) -> ModalEquilibrium:
        pressures.append(float(pressure[0]))
        alpha = np.full(part.mode_count, np.nan)
        if abs(pressure[0] - start[0]) <= 3.0:
            return ModalEquilibrium(np.full(part.mode_count, pressure[0]), True, 1, 0.0)
        return ModalEquilibrium(alpha, False, 1, np.inf)

    monkeypatch.setattr(modal_equilibrium, "modal_equilibrium", solve)
    return pressures


def test_a_step_that_is_too_long_is_made_in_parts(asked):
    found = [each.converged for each in rising_modal_equilibria(rubber_reduced_part(), [2.0, 10.0])]
    assert found == [True, True]
    assert asked == [2.0, 10.0, 6.0, 4.0, 6.0, 8.0, 10.0]


def test_after_one_that_is_not_found_the_last_that_was_is_gone_on_from(asked):
    pressures = [2.0, 60.0, 5.0]
    found = list(rising_modal_equilibria(rubber_reduced_part(), pressures))
    assert [each.converged for each in found] == [True, False, True]
    assert asked[-1] == 5.0
    assert found[-1].alpha[0] == 5.0
