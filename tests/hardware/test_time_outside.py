"""Readings outside now and then against the closed form of their forgetful sum."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pneumorph.hardware.time_outside import TimeOutside


def _too_long_at(sides: list[int], step_s: float = 0.1, longest_s: float = 0.2) -> int | None:
    """Number of the first sample at which it is too long."""
    times = TimeOutside(longest_s, 1)
    for number, side in enumerate(sides):
        times.add(step_s * number, np.array([side]))
        if times.too_long[0]:
            return number
    return None


@pytest.mark.parametrize("every", [2, 3, 5, 8])
@pytest.mark.parametrize("crossing", [False, True])
def test_readings_outside_now_and_then_add_up(every: int, crossing: bool) -> None:
    """Each counts its 0.1 s, and f = exp(-0.1 every / 5) of the sum is left at the next: after the
    n-th it is 0.1 (1 - f^n) / (1 - f), which is to reach 2.5 times 0.2 s."""
    left = math.exp(-0.1 * every / 5.0)
    outside_count = math.ceil(math.log(1.0 - 0.5 * (1.0 - left) / 0.1) / math.log(left))
    sides = [0 if (n + 1) % every else 1 for n in range(200)]
    if crossing:
        sides = [side * (-1) ** (n // every) for n, side in enumerate(sides)]
    assert _too_long_at(sides) == every * outside_count - 1


def test_one_reading_in_twelve_is_forgotten() -> None:
    assert _too_long_at([0 if n % 12 else 1 for n in range(2000)]) is None


def test_without_a_break_either_side_counts() -> None:
    assert _too_long_at([0, 0, 1, 1, 1, 1]) == 4
    assert _too_long_at([0, 0, 1, -1, 1, -1]) == 4
    assert _too_long_at([0, 0, 1, 1, 0, 1, 1, 0]) is None


def test_a_single_reading_after_a_long_pause_counts_as_a_short_one() -> None:
    """Samples 2 s apart: nobody knows when in them the reading came to be outside."""
    assert _too_long_at([0, 1, 0, 0], step_s=2.0) is None


def test_what_may_last_no_time_is_found_at_once() -> None:
    assert _too_long_at([0, 1, 0], longest_s=0.0) == 1
