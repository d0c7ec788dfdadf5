"""A held gait says its commands at the right times."""

import numpy as np
import pytest

from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import sample_commands


def test_each_command_is_held_until_the_next() -> None:
    held = np.arange(60.0).reshape(20, 3)
    gait = HeldGait.evenly(held)
    assert gait.duration_s == 20.0
    assert gait.regulator_count == 3
    commands = sample_commands(gait, 0.01, 2000)
    np.testing.assert_array_equal(commands, np.repeat(held, 100, axis=0))
    np.testing.assert_array_equal(gait.pressure_kPa(99.0), held[-1])


def test_uneven_times() -> None:
    gait = HeldGait(np.array([0.0, 0.5, 2.0]), np.array([[1.0], [2.0], [3.0]]), 3.0)
    assert [gait.pressure_kPa(time)[0] for time in (0, 0.49, 0.5, 1.99, 2.0, 3.0)] == [
        1,
        1,
        2,
        2,
        3,
        3,
    ]


def test_bad_gaits_are_refused() -> None:
    one = np.zeros((1, 3))
    with pytest.raises(ValueError, match=r"pressure_kPa\[0, 1\] is nan"):
        HeldGait.evenly(np.array([[0.0, np.nan, 0.0]]))
    with pytest.raises(ValueError, match=r"pressure_kPa\[0, 0\] is 91\.0, .* from 0 to 90"):
        HeldGait.evenly(np.array([[91.0, 0.0, 0.0]]))
    with pytest.raises(ValueError, match=r"start_s begins \[0\.5\]"):
        HeldGait(np.array([0.5]), one, 2.0)
    with pytest.raises(ValueError, match=r"duration_s is 0\.0, expected more than"):
        HeldGait(np.array([0.0]), one, 0.0)
    with pytest.raises(ValueError, match=r"held_kPa has shape \(1, 3\), .* 2 commands"):
        HeldGait(np.array([0.0, 1.0]), one, 2.0)
