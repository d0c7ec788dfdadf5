"""States of legs, as robots walk and out of what was recorded of them."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.small_robot import small_robot

from pneumorph.reduction.leg_recorder import LegRecorder


@pytest.mark.parametrize("soft", [False, True])
def test_a_recorded_walk_has_the_states_that_were_passed(soft: bool) -> None:
    """Frames in the world's single precision: 50 mm to 2e-6 mm."""
    robot = small_robot(soft=soft)
    commands = np.tile([20.0, 5.0], (8, 1))
    watching, following = LegRecorder(robot, 2), LegRecorder(robot)
    _, trajectory = robot.rollout(robot.settled_state(2), commands, 2, observe=watching)
    following.follow(trajectory)
    expected, found = (each.snapshots("walk", trajectory) for each in (watching, following))
    assert found.displacement.shape == (8, robot.legs[0].part.node_count, 3)
    assert np.abs(found.displacement).max() > 0.01
    np.testing.assert_allclose(found.displacement, expected.displacement, atol=5e-6)
    np.testing.assert_array_equal(found.pressure_kPa, expected.pressure_kPa)
    bare = robot.rollout(robot.settled_state(2), commands[:1], 1, record_nodes=False)[1]
    with pytest.raises(ValueError, match="no node positions, expected them to be recorded"):
        following.follow(bare)
