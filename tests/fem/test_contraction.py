"""What is left of an error, by the sizes of changes."""

import numpy as np
import pytest

from pneumorph.fem.contraction import PATIENCE, POOR_CONTRACTION, Contraction


def after(*sizes: float, earlier: bool = False) -> Contraction:
    made = Contraction(earlier)
    for size in sizes:
        assert made.accept(size)
    return made


@pytest.mark.parametrize("share", [0.02, 0.3, 0.5])
def test_changes_that_shrink_evenly_leave_the_rest_of_their_series(share):
    rest = sum(share**power for power in range(3, 200))
    assert after(1.0, share, share**2).left == pytest.approx(rest)


def test_changes_that_shrink_by_turns_are_not_taken_at_their_best():
    """Shares of 0.02 and 0.5: after the good one the next change is half of the last, and what the
    last share alone would leave, 0.02 of it, is far too little."""
    first, second = np.cumprod([1.0, 0.5, 0.02]), np.cumprod([1.0, 0.02, 0.5])
    assert after(*first).left > 0.1 * first[-1]
    assert after(*second).left >= second[-1]


def test_nothing_is_known_before_three_changes():
    assert after(1.0, 1e-9).left == np.inf
    assert after(1.0, 1.0, 0.2).left < np.inf


def test_two_changes_that_leave_too_much_are_poor():
    assert not after(1.0, 1.0).accept(1.01 * POOR_CONTRACTION)
    assert after(1.0, 1.0).accept(0.99 * POOR_CONTRACTION)


def test_factors_of_an_earlier_step_must_do_from_the_first_change():
    assert not after(1.0, earlier=True).accept(1.01 * POOR_CONTRACTION)
    assert not after(earlier=True).accept(np.nan)
    assert after(1.0).accept(1.01 * POOR_CONTRACTION)


def test_changes_that_grow_are_poor_at_once():
    assert not after(1.0).accept(1.01)


def test_no_change_leaves_nothing():
    assert after(1.0, 0.1, 0.0).left == 0.0


def test_poor_changes_are_borne_while_they_become_smaller_now_and_then():
    made = after(1.0)
    for size in np.geomspace(0.99, 0.5, 20):
        assert not made.goes_on_poorly(3.0)
        assert not made.goes_on_poorly(size)
    for _ in range(PATIENCE - 1):
        assert not made.goes_on_poorly(3.0)
    assert made.goes_on_poorly(3.0)


@pytest.mark.parametrize("size", [np.nan, np.inf])
def test_what_is_not_finite_is_given_up(size):
    assert after(1.0).goes_on_poorly(size)
