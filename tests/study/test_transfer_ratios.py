"""What robots achieve over what the first one does."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.environment.goal import Goal
from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.trial import Trial
from pneumorph.hardware.trial_comparison import TrialComparison, compare_trials
from pneumorph.study.transfer import DistanceRatio, _ratio
from pneumorph.trajectory import Trajectory

TIME_S = np.linspace(0.0, 4.0, 41)


def _compared(simulated_cm: float, measured_cm: float) -> TrialComparison:
    """A robot that goes steadily forward for 4 s."""
    way = np.outer(TIME_S / 4.0, [10.0, 0.0, 0.0])
    turn, zeros = np.broadcast_to(np.eye(3), (41, 3, 3)), np.zeros((41, 3))
    place = simulated_cm * way
    simulated = Trajectory(TIME_S, place, turn, place, zeros, zeros, np.zeros(41, int))
    log = LoggedPressures(TIME_S, zeros, zeros, ())
    trial = Trial("trial_1", log, MarkerTrack(TIME_S, measured_cm * way[:, :2]))
    return compare_trials("B", "1.0.0.2.2.0.0.1", simulated, [trial], Goal("forward"))


def test_over_a_first_robot_that_walks_there_is_a_ratio() -> None:
    ratio = _ratio(_compared(10.0, 9.0), _compared(4.0, 3.0))
    assert ratio.simulated == pytest.approx(2.5)
    assert ratio.measured == pytest.approx(3.0)


@pytest.mark.parametrize("little_cm", [0.0, 0.002, 0.09, -5.0])
def test_over_next_to_nothing_there_is_none(little_cm: float) -> None:
    """Noise alone has a ratio to noise; a factor over a way back means nothing either."""
    robot = _compared(10.0, 9.0)
    assert _ratio(robot, _compared(little_cm, little_cm)) == DistanceRatio(None, None)
    assert _ratio(robot, _compared(10.0, little_cm)).measured is None
    assert _ratio(robot, _compared(10.0, little_cm)).simulated == pytest.approx(1.0)
