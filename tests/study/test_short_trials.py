"""Trials that were stopped, ended early or were not seen all the time, beside whole ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.hardware.deployment_log import STOPPED, DeploymentLog, LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack, write_track
from pneumorph.hardware.trial import Trial, read_trials
from pneumorph.hardware.trial_comparison import check_length
from pneumorph.study.deployed_robot import lost_notes, whole_trials


def logged(end_s: float, stopped_s: float | None = None) -> LoggedPressures:
    """A sample each 0.1 s until the end, of a run that was stopped while its pressure falls too."""
    time_s = np.arange(0.0, end_s, 0.1)
    events = [(0.0, "start")]
    if stopped_s is not None:
        events += [(stopped_s, f"{STOPPED}the hose came off"), (stopped_s + 0.1, "vented")]
    zeros = np.zeros((len(time_s), 1))
    return LoggedPressures(time_s, zeros, zeros, tuple(events))


def track(begin_s: float, end_s: float, step_s: float = 0.1) -> MarkerTrack:
    """A marker that goes forward at 10 mm/s, seen from one time to another."""
    time_s = np.append(np.arange(begin_s, end_s, step_s), end_s)
    return MarkerTrack(time_s, np.column_stack([10.0 * time_s, 0.0 * time_s]))


def trial(
    name: str, end_s: float, begin_s: float = 0.0, log: LoggedPressures | None = None
) -> Trial:
    """A trial of a gait of 20 s that is tracked from one time to another."""
    return Trial(name, logged(20.0) if log is None else log, track(begin_s, end_s))


def test_a_trial_that_ended_early_does_not_cut_the_others_short() -> None:
    """Of a gait of 20 s; up to a step of 1 s may be missing."""
    whole, late, short = trial("trial_1", 20.0), trial("trial_2", 19.2), trial("trial_3", 1.1)
    assert whole_trials("L", [whole, late], 20.0, 1.0) == ((whole, late), [])
    kept, told = whole_trials("L", [whole, short, late], 20.0, 1.0)
    assert kept == (whole, late)
    assert told == [
        "L: of a gait of 20 s trials tell of a part: trial_3 from 0.00 to 1.10 s; left out"
    ]
    kept, told = whole_trials("L", [short], 20.0, 1.0)
    assert kept == (short,)
    assert told[0].endswith("from 0.00 to 1.10 s; what all have in common is compared")


def test_a_trial_whose_track_begins_late_is_left_out() -> None:
    """The marker was not seen at first: how far it went until then nobody knows."""
    whole, unseen = trial("trial_1", 20.0), trial("trial_2", 20.0, begin_s=4.0)
    kept, told = whole_trials("L", [whole, unseen], 20.0, 1.0)
    assert kept == (whole,)
    assert told[0].endswith("trial_2 from 4.00 to 20.00 s; left out")


def test_a_trial_that_was_stopped_is_left_out_though_its_camera_films_on() -> None:
    """The robot stood still from 6 s on, which is no short way of a gait of 20 s."""
    whole, stopped = trial("trial_1", 20.0), trial("trial_2", 20.0, log=logged(7.4, 6.0))
    assert stopped.pressures.stopped == (6.0, "the hose came off")
    assert stopped.end_s == 6.0
    kept, told = whole_trials("L", [stopped, whole], 20.0, 1.0)
    assert kept == (whole,)
    assert told == [
        "L: of a gait of 20 s trials tell of a part: trial_2 from 0.00 to 6.00 s (stopped); "
        "left out"
    ]
    assert whole.pressures.stopped is None
    assert whole.end_s == 20.0


def test_a_log_that_was_cut_off_ends_its_trial() -> None:
    """A process that was killed writes of no stop; its last sample holds until the next."""
    cut = trial("trial_1", 20.0, log=logged(6.0))
    assert cut.end_s == pytest.approx(6.0)
    kept, told = whole_trials("L", [trial("trial_2", 20.0), cut], 20.0, 1.0)
    assert [each.name for each in kept] == ["trial_2"]
    assert told[0].endswith("trial_1 from 0.00 to 6.00 s; left out")


def test_of_stopped_trials_alone_what_they_have_in_common_is_compared() -> None:
    both = [trial(f"trial_{end_s:g}", 20.0, log=logged(end_s + 1.4, end_s)) for end_s in (6.0, 9.0)]
    kept, told = whole_trials("L", both, 20.0, 1.0)
    assert kept == tuple(both)
    assert told[0].endswith(
        "trial_6 from 0.00 to 6.00 s (stopped), trial_9 from 0.00 to 9.00 s (stopped); "
        "what all have in common is compared"
    )
    assert check_length("L", 20.0, kept, 1.0) == pytest.approx(6.0, abs=0.051)
    at_once = trial("trial_1", 20.0, log=logged(1.8, 0.4))
    with pytest.raises(ValueError, match=r"simulation and trials have 0\.45 s in common"):
        check_length("L", 20.0, [at_once], 1.0)


def test_a_trial_that_was_killed_at_once_does_not_cut_stopped_ones_short() -> None:
    """Nothing would be left in common: those of a step at least are compared."""
    stopped = [trial(f"trial_{s:g}", 20.0, log=logged(s + 1.4, s)) for s in (6.0, 9.0)]
    killed = trial("trial_1", 20.0, log=logged(0.15))
    kept, told = whole_trials("L", [stopped[0], killed, stopped[1]], 20.0, 1.0)
    assert kept == tuple(stopped)
    assert told[0] == "L: trials tell of less than a step of 1 s: trial_1 until 0.20 s; left out"
    assert told[1].endswith(
        "trial_9 from 0.00 to 9.00 s (stopped); what all have in common is compared"
    )
    assert check_length("L", 20.0, kept, 1.0) == pytest.approx(6.0, abs=0.051)
    # Of such trials alone nothing can be compared, and the shortest is named.
    kept, _ = whole_trials("L", [killed], 20.0, 1.0)
    assert kept == (killed,)
    with pytest.raises(
        ValueError, match=r"the shortest trial is trial_1, .* of 0\.2 s of the gait"
    ):
        check_length("L", 20.0, [*stopped, *kept], 1.0)


def without(begin_s: float, end_s: float) -> MarkerTrack:
    """A track of 20 s without the points between two times."""
    whole = track(0.0, 20.0)
    kept = (whole.time_s <= begin_s + 1e-9) | (whole.time_s >= end_s - 1e-9)
    return MarkerTrack(whole.time_s[kept], whole.position_mm[kept])


def test_a_marker_that_was_lost_is_told() -> None:
    """From 5 to 15 s; a few frames without it are nothing to tell, nor is a time lapse."""
    lost = Trial("trial_2", logged(20.0), without(5.0, 15.0))
    blinked = Trial("trial_3", logged(20.0), without(5.0, 5.4))
    lapse = Trial("trial_4", logged(20.0), track(0.0, 20.0, step_s=1.5))
    assert lost_notes("L", [trial("trial_1", 20.0), blinked, lapse]) == []
    (told,) = lost_notes("L", [trial("trial_1", 20.0), lost, blinked, lapse])
    assert told.startswith("L: the marker was not seen in trial_2 from 5.00 to 15.00 s: ")
    assert "straight line" in told


def test_what_was_lost_before_or_after_the_gait_is_not_told() -> None:
    before = track(-20.0, 30.0)
    kept = (before.time_s <= -10.0) | ((before.time_s >= -1.0) & (before.time_s <= 21.0))
    kept |= before.time_s >= 29.0
    seldom = MarkerTrack(before.time_s[kept], before.position_mm[kept])
    assert len(seldom.lost()) == 2
    assert lost_notes("L", [Trial("trial_1", logged(20.0), seldom)]) == []
    stopped = Trial("trial_1", logged(5.4, 4.0), without(5.0, 15.0))
    assert lost_notes("L", [stopped]) == []


def test_a_marker_is_seen_between_points_that_are_near() -> None:
    seen = without(5.0, 15.0).seen(np.array([-0.1, 0.0, 4.97, 5.0, 5.05, 10.0, 15.0, 20.0, 20.1]))
    assert seen.tolist() == [False, True, True, True, False, False, True, True, False]
    lapse = track(0.0, 20.0, step_s=1.5)
    assert lapse.seen(np.linspace(0.0, 20.0, 101)).all()


def _deployed(folder: Path, stopped_s: float | None = None, tracked: bool = True) -> None:
    with DeploymentLog(folder / "log.csv", 1) as log:
        log.event(0.0, "start")
        for time_s in np.arange(0.0, stopped_s or 20.0, 0.1):
            log.row(time_s, np.zeros(1), np.zeros(1))
        if stopped_s is not None:
            log.event(stopped_s, f"{STOPPED}the hose came off")
    if tracked:
        write_track(folder / "track.csv", track(0.0, 20.0))


def test_a_trial_that_was_stopped_needs_no_track(tmp_path: Path) -> None:
    """Nobody tracks the video of a robot that stood still; one that walked must have a track."""
    _deployed(tmp_path / "trial_1")
    _deployed(tmp_path / "trial_2", stopped_s=3.0, tracked=False)
    _deployed(tmp_path / "trial_3", stopped_s=4.0)
    trials, unseen = read_trials(tmp_path)
    assert [each.name for each in trials] == ["trial_1", "trial_3"]
    assert unseen == ["trial_2"]
    _deployed(tmp_path / "trial_4", tracked=False)
    with pytest.raises(FileNotFoundError, match=r"trial_4 holds no track"):
        read_trials(tmp_path)


def test_a_deployment_of_stopped_trials_without_tracks_is_refused(tmp_path: Path) -> None:
    _deployed(tmp_path / "trial_1", stopped_s=3.0, tracked=False)
    with pytest.raises(FileNotFoundError, match=r"trial_1 holds no track"):
        read_trials(tmp_path)
