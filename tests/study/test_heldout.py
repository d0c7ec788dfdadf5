"""Held-out robots: the same for everyone, each by its own number, longer ones begin as shorter."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.study.heldout import heldout_animations


def test_each_depends_on_its_number_only() -> None:
    few, many = heldout_animations(2, 3.0), heldout_animations(5, 6.0)
    for short, long in zip(few, many, strict=False):
        assert short.name == long.name
        assert short.design == long.design
        commands = [sample_commands(each.gait, 0.01, 300) for each in (short, long)]
        np.testing.assert_array_equal(*commands)
        assert commands[0].min() >= 0.0
        assert commands[0].max() <= 90.0
        assert len(np.unique(commands[0], axis=0)) == 3
    assert len({str(each.design) for each in many}) > 1


def test_no_time_is_refused() -> None:
    with pytest.raises(ValueError, match="duration_s is 0"):
        heldout_animations(1, 0.0)
