"""Straight lines as commands that are held."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.gait.interpolated_gait import InterpolatedGait


@pytest.mark.parametrize("duration_s", [0.4, 1.0, 2.3, 2.5, 2.7])
def test_each_command_is_that_of_the_middle_of_its_span(duration_s: float) -> None:
    """Which of a straight line is the mean over the span, the last of which may be longer or
    shorter than the others."""
    slope = 20.0
    gait = InterpolatedGait(np.array([0.0, duration_s]), np.array([[0.0], [slope * duration_s]]))
    held = gait.held(1.0)
    edges = np.append(held.start_s, held.duration_s)
    assert held.duration_s == duration_s
    np.testing.assert_allclose(held.held_kPa[:, 0], slope * 0.5 * (edges[1:] + edges[:-1]))
