"""A part cut to its first modes."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_part import synthetic_reduced_part

from pneumorph.robot.truncated_part import truncated_part


def test_the_cut_part_is_the_whole_one_with_its_last_modes_at_rest():
    whole = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
    cut = truncated_part(whole, 4)
    alpha = 0.2 * np.random.default_rng(0).normal(size=4)
    padded = np.pad(alpha, (0, 2))
    # The same numbers, summed in another order.
    assert cut.positions(alpha) == pytest.approx(whole.positions(padded), abs=1e-10)
    assert cut.internal_force(alpha, "polar") == pytest.approx(
        whole.internal_force(padded, "polar")[:4], rel=1e-10
    )
    assert cut.cavity().gradient(alpha) == pytest.approx(
        whole.cavity().gradient(padded)[:4], rel=1e-10
    )


@pytest.mark.parametrize("mode_count", [0, 7])
def test_modes_that_are_not_there_are_refused(mode_count):
    with pytest.raises(ValueError, match="expected 1 to 6, the modes of the part"):
        truncated_part(synthetic_reduced_part(mode_count=6, cells=(6, 4, 4)), mode_count)
