"""What was recorded too little of, or finds no room, is told in words."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.trial import Trial
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.run_page import _told_of
from pneumorph.study.finished_run import FinishedRun
from pneumorph.trajectory import Trajectory


def test_a_trajectory_without_frames_is_none() -> None:
    with pytest.raises(ValueError, match="has 0 frames, expected at least one"):
        Trajectory(
            time_s=np.zeros(0),
            hub_position_mm=np.zeros((0, 3)),
            hub_rotation=np.zeros((0, 3, 3)),
            tracked_point_mm=np.zeros((0, 3)),
            commanded_kPa=np.zeros((0, 2)),
            regulated_kPa=np.zeros((0, 2)),
            contact_count=np.zeros(0, dtype=int),
        )


def test_a_trial_without_samples_is_not_drawn() -> None:
    """It was stopped before its first one."""
    log = LoggedPressures(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1)), ())
    track = MarkerTrack(np.array([0.0, 1.0]), np.zeros((2, 2)))
    with pytest.raises(ValueError, match="log of 'B' has no samples"):
        MarkerActor.of(Trial("trial_1", log, track), "B")


def test_an_unsensed_channel_is_drawn_at_its_command_from_when_it_was_given() -> None:
    """And the command no later: samples come between commands."""
    log = LoggedPressures(
        np.array([0.2, 1.2]),
        np.array([[0.0], [60.0]]),
        np.full((2, 1), np.nan),
        (),
        ((0.0, np.zeros(1)), (1.0, np.array([60.0]))),
    )
    track = MarkerTrack(np.array([0.9, 1.0, 1.1, 1.2]), np.zeros((4, 2)))
    shown = MarkerActor.of(Trial("trial_1", log, track), "B")
    assert shown.time_s.tolist() == [0.0, 0.9, 1.0, 1.1, 1.2]
    for pressures in (shown.commanded_kPa, shown.regulated_kPa):
        assert pressures[:, 0].tolist() == [0.0, 0.0, 60.0, 60.0, 60.0]


def test_a_full_disk_is_not_the_fault_of_the_run(tmp_path: Path) -> None:
    run = FinishedRun(tmp_path, {}, {})
    with pytest.raises(OSError, match="cannot be written: No space left"), _told_of(run):
        raise OSError(errno.ENOSPC, "No space left on device")
