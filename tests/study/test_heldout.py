"""Held-out robots: the same for everyone, each by its own number, longer ones begin as shorter."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.robot.design import Design
from pneumorph.study.heldout import heldout_animations, inflation_wave, periodic_animations


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


def test_periodic_gaits_repeat_and_waves_go_from_hind_to_fore_legs_or_back() -> None:
    drawn = periodic_animations(9, 8.0)
    assert [each.name for each in drawn] == [f"periodic_{number:02d}" for number in range(9)]
    assert isinstance(drawn[8].gait, ExpertGait)  # the gaits take turns
    assert drawn[8].gait.phase_deg == 0.0
    for each in drawn[4:8]:
        commands = sample_commands(each.gait, 0.01, 800)
        np.testing.assert_array_equal(commands[400:], commands[:400])
    # Two legs forward on regulator 1, two backward on regulator 2: places 0, 7 and 3, 4.
    design = Design.parse("1.0.0.2.2.0.0.1")
    for period_s, first in ((4.0, 1), (-4.0, 0)):
        commands = sample_commands(inflation_wave(design, period_s, 4.0, 3), 1.0, 4)
        expected = np.zeros((4, 3))
        expected[[0, 1], first] = expected[[1, 2], 1 - first] = 90.0
        np.testing.assert_array_equal(commands, expected)
