"""The test animations are those of appendix B."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.study.animations import CORNER_S, HIGH_KPA, animations


def test_hamiltonian_visits_every_corner_one_leg_at_a_time() -> None:
    (animation,) = animations(["hamiltonian"], 16 * CORNER_S)
    commands = sample_commands(animation.gait, CORNER_S, 16)
    assert len(np.unique(commands, axis=0)) == 16
    assert set(np.unique(commands)) == {0.0, HIGH_KPA}
    # From the slack start through all corners and back to it.
    path = np.vstack([np.zeros(4), commands])
    assert (np.abs(np.diff(path, axis=0)).sum(axis=1) == HIGH_KPA).all()
    assert animation.design.leg_count == 4


def test_designs_and_alternation() -> None:
    by_name = {each.name: each for each in animations(["baseline", "two_leg", "six_leg"], 4.0)}
    assert str(by_name["baseline"].design) == "1.0.0.2.2.0.0.1"
    (first, _), (second, _) = by_name["two_leg"].design.legs
    assert second - first == 2  # locations 45 degrees apart: a right angle
    groups = [regulator for _, regulator in by_name["six_leg"].design.legs]
    assert sorted(groups) == [1, 1, 1, 2, 2, 2]
    for name in ("two_leg", "six_leg"):
        gait = by_name[name].gait
        assert gait.pressure_kPa(1.0) == pytest.approx([HIGH_KPA, 0, 0])
        assert gait.pressure_kPa(3.0) == pytest.approx([0, HIGH_KPA, 0])
        assert gait.duration_s == 4.0


def test_bad_requests_are_refused() -> None:
    with pytest.raises(ValueError, match="animation 'jump' is unknown, expected hamiltonian"):
        animations(["jump"], 1.0)
    with pytest.raises(ValueError, match="duration_s is 0"):
        animations(["baseline"], 0.0)
