"""Tracks in every format, logs that were cut off, and what a comparison makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.goal import Goal
from pneumorph.hardware.deployment_log import DeploymentLog, LoggedPressures, read_log
from pneumorph.hardware.marker_track import (
    MarkerTrack,
    VideoSettings,
    read_track,
    track_notes,
    write_track,
)
from pneumorph.hardware.trial import Trial, notes_of, read_trial, trial_folders
from pneumorph.hardware.trial_comparison import compare_trials, pressure_tracking
from pneumorph.study.deployed_robot import whole_trials
from pneumorph.study.transfer import TransferSettings, transfer
from pneumorph.trajectory import Trajectory

DESIGN = "1.0.0.2.2.0.0.1"
TIMES = np.arange(0.0, 4.0, 0.1)


def _path() -> np.ndarray:
    """Forward at 10 mm/s with a swing, drifting left."""
    return np.column_stack([10.0 * TIMES + 2.0 * np.sin(TIMES), 1.5 * TIMES])


def test_our_own_format_reads_back(tmp_path: Path) -> None:
    track = MarkerTrack(TIMES, _path())
    read = read_track(write_track(tmp_path / "track.csv", track))
    # Six digits are written.
    np.testing.assert_allclose(read.position_mm, track.position_mm, rtol=1e-5)
    assert read.turned_deg is None
    turned = MarkerTrack(TIMES, _path(), 100.0 * TIMES)
    read = read_track(write_track(tmp_path / "turned.csv", turned))
    assert read.turned_deg is not None
    np.testing.assert_allclose(read.turned_deg, turned.turned_deg, rtol=1e-5)


@pytest.mark.parametrize("kind", ["tracker", "deeplabcut", "sleap"])
def test_video_trackers_tell_the_same_path(kind: str, tmp_path: Path) -> None:
    """5 pixels a mm, y down, robot heading 30 degrees, gait starts 2 s into the video."""
    angle = np.radians(30.0)
    turned = _path() @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    up = kind == "tracker"
    pixels = 5.0 * turned * np.array([1.0, 1.0 if up else -1.0]) + 300.0
    frames = np.round((TIMES + 2.0) * 30.0).astype(int)
    if kind == "tracker":
        lines = ["mass_A\t\t", "t\tx\ty"]
        lines += [f"{t + 2.0}\t{x}\t{y}" for t, (x, y) in zip(TIMES, pixels, strict=True)]
    elif kind == "deeplabcut":
        lines = ["scorer" + ",net" * 6, "bodyparts,leg,leg,leg,disk,disk,disk"]
        lines.append("coords" + ",x,y,likelihood" * 2)
        for f, (x, y) in zip(frames, pixels, strict=True):
            lines.append(f"{f},0,0,0.9,{x},{y},0.99")
        lines.insert(10, "75,0,0,0.9,9999,9999,0.1")  # a frame in which the disk was lost
    else:
        lines = ["track,frame_idx,instance.score,disk.x,disk.y,disk.score"]
        for f, (x, y) in zip(frames, pixels, strict=True):
            lines.append(f"t,{f},0.9,{x},{y},0.95")
    (tmp_path / "track.csv").write_text("\n".join(lines) + "\n")
    video = VideoSettings(
        units_per_mm=5.0,
        frames_per_second=30.0,
        start_s=2.0,
        heading_deg=30.0,
        y_down=not up,
        marker="disk" if kind == "deeplabcut" else "",
    )
    track = read_track(tmp_path / "track.csv", video)
    at = np.array([1.0, 2.5, 3.9])
    expected = np.interp(at, TIMES, _path()[:, 0]) / 10.0
    # Times are rounded to a video frame: 1/60 s at up to 12 mm/s, twice.
    np.testing.assert_allclose(track.forward_cm(at), expected, atol=0.04)
    left_mm = [np.interp(at, track.time_s, track.position_mm[:, 1])]
    left_mm -= np.interp(0.0, track.time_s, track.position_mm[:, 1])
    expected_mm = np.interp(at, TIMES, _path()[:, 1]) - np.interp(0.0, TIMES, _path()[:, 1])
    assert np.ptp(expected_mm) > 1.0
    np.testing.assert_allclose(left_mm[0], expected_mm, atol=0.4)


def test_a_channel_without_a_sensor_is_driven_by_its_commands() -> None:
    """Or with a single reading, between which and nothing no line goes."""
    nan = np.nan
    log = LoggedPressures(
        np.array([0.0, 1.0, 2.0]),
        np.array([[10.0, 20.0, 30.0], [40.0, 50.0, 60.0], [40.0, 50.0, 60.0]]),
        np.array([[11.0, nan, 5.0], [nan, nan, nan], [31.0, nan, nan]]),
        (),
    )
    trial = Trial("trial_1", log, MarkerTrack(np.array([0.0, 2.0]), np.zeros((2, 2))))
    driven = trial.driven_kPa(np.array([0.5, 1.0]))
    np.testing.assert_array_equal(driven, [[16.0, 20.0, 30.0], [21.0, 50.0, 60.0]])


def _two_markers(kind: str, path: Path, lost: Sequence[int] = (), doubled: bool = False) -> Path:
    """The table of a robot that turns to the left by 100 degrees a second and goes on; y points
    down, and the second marker is not trusted in the lost frames."""
    facing = np.radians(100.0 * TIMES)
    first = _path() * [1.0, -1.0]
    second = first + 40.0 * np.column_stack([np.cos(facing), -np.sin(facing)])
    trust = np.full(len(TIMES), 0.9)
    trust[list(lost)] = 0.1
    frame = np.round(TIMES * 30.0).astype(int)
    rows = zip(frame, *first.T, *second.T, trust, strict=True)
    if kind == "deeplabcut":
        lines = ["scorer" + ",net" * 6, "bodyparts,hub,hub,hub,nose,nose,nose"]
        lines.append("coords" + ",x,y,likelihood" * 2)
        lines += [f"{f},{x},{y},0.9,{u},{v},{trusted}" for f, x, y, u, v, trusted in rows]
    else:
        lines = ["track,frame_idx,instance.score,hub.x,hub.y,hub.score,nose.x,nose.y,nose.score"]
        lines += [f"t,{f},0.9,{x},{y},0.9,{u},{v},{trusted}" for f, x, y, u, v, trusted in rows]
    if doubled:
        lines.append(lines[-1])
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("kind", ["deeplabcut", "sleap"])
def test_two_markers_tell_the_turn(kind: str, tmp_path: Path) -> None:
    lost = (7, len(TIMES) - 1)
    table = _two_markers(kind, tmp_path / "track.csv", lost)
    track = read_track(table, VideoSettings(marker_ahead="nose"))
    left = Goal("turn_left")
    # Times are rounded to a frame of 1/30 s.
    assert track.achieved(left, 3.5) == pytest.approx(350.0, abs=100.0 / 60.0)
    assert track.achieved(Goal("turn_right"), 3.5) == pytest.approx(-350.0, abs=100.0 / 60.0)
    assert track.achieved(Goal("heading", 90.0), 3.5) == pytest.approx(0.15 * 3.5, abs=0.01)
    # Where the second marker is lost, the first still tells the way.
    alone = read_track(table)
    assert alone.achieved(left, 3.5) is None
    np.testing.assert_array_equal(alone.forward_cm(TIMES), track.forward_cm(TIMES))
    np.testing.assert_array_equal(alone.time_s, track.time_s)


@pytest.mark.parametrize(
    ("video", "lost", "doubled", "why"),
    [
        (
            {"marker_ahead": "hub", "marker": "hub"},
            (),
            False,
            "marker_ahead is 'hub', as marker is",
        ),
        (
            {"marker_ahead": "hub"},
            (),
            False,
            "in 0 frames, expected at least 2: it may be the same",
        ),
        ({"marker_ahead": "nose"}, range(1, 40), False, "marker_ahead 'nose': a track needs"),
        (
            {"marker_ahead": "tail"},
            (),
            False,
            "marker_ahead 'tail': marker 'tail' is unknown",
        ),
        ({"marker_ahead": "nose"}, (), True, "frames may be doubled or out of order"),
    ],
)
def test_a_second_marker_that_tells_no_turn_is_refused(
    video: dict[str, str], lost: Sequence[int], doubled: bool, why: str, tmp_path: Path
) -> None:
    table = _two_markers("sleap", tmp_path / "track.csv", lost, doubled)
    with pytest.raises(ValueError, match=why):
        read_track(table, VideoSettings(**video))


@pytest.mark.parametrize("swapped", [[20], [0], [20, 21, 22]])
def test_markers_that_change_places_in_some_frames_are_refused(
    swapped: Sequence[int], tmp_path: Path
) -> None:
    """Half a circle forth and half a circle on would count as a whole turn."""
    table = _two_markers("sleap", tmp_path / "track.csv")
    lines = table.read_text().splitlines()
    for place in swapped:
        cells = lines[place + 1].split(",")
        lines[place + 1] = ",".join([*cells[:3], *cells[6:9], *cells[3:6]])
    table.write_text("\n".join(lines) + "\n")
    begin_s = 0.1 * (swapped[0] - 1 if swapped[0] else 0)
    told = rf"'nose': from {begin_s:.3f} to {begin_s + 0.1:.3f} s .* 1[67]\d degrees, .* places"
    with pytest.raises(ValueError, match=told):
        read_track(table, VideoSettings(marker_ahead="nose"))


@pytest.mark.parametrize("frames_per_second", [1.0, 30.0])
def test_markers_that_change_places_are_refused_however_slow_the_camera(
    frames_per_second: float, tmp_path: Path
) -> None:
    """A robot that goes straight, whose markers change places in one frame of 40."""
    rows = ["track,frame_idx,disk.x,disk.y,nose.x,nose.y"]
    rows += [f"t,{i},{i},0,{i + 10},0" if i != 20 else f"t,{i},{i + 10},0,{i},0" for i in range(40)]
    (tmp_path / "track.csv").write_text("\n".join(rows) + "\n")
    video = VideoSettings(frames_per_second=frames_per_second, marker_ahead="nose")
    begin_s, end_s = 19.0 / frames_per_second, 20.0 / frames_per_second
    with pytest.raises(ValueError, match=rf"from {begin_s:.3f} to {end_s:.3f} s .* 180 degrees"):
        read_track(tmp_path / "track.csv", video)


def test_a_turn_while_a_marker_was_lost_is_taken(tmp_path: Path) -> None:
    """By 100 degrees in a second: the markers need not have changed places."""
    table = _two_markers("sleap", tmp_path / "track.csv", lost=range(10, 19))
    track = read_track(table, VideoSettings(marker_ahead="nose"))
    assert track.achieved(Goal("turn_left"), 3.5) == pytest.approx(350.0, abs=100.0 / 60.0)


def test_rows_of_several_sleap_tracks_are_refused(tmp_path: Path) -> None:
    """Two robots that are seen one after the other would make one path."""
    rows = ["a,0,1,0,0,1", "a,1,1,1,0,1", ",2,1,2,0,1", "b,3,1,500,0,1"]
    lines = ["track,frame_idx,instance.score,disk.x,disk.y,disk.score", *rows]
    (tmp_path / "track.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match="of several tracks, a, b, expected those of one"):
        read_track(tmp_path / "track.csv")
    (tmp_path / "track.csv").write_text("\n".join(lines[:-1]) + "\n")
    assert len(read_track(tmp_path / "track.csv").time_s) == 3


def test_empty_cells_of_a_track_of_ours_are_frames_without_the_marker(tmp_path: Path) -> None:
    own = tmp_path / "track.csv"
    own.write_text(
        "time_s,x_cm,y_cm,turned_deg\n0,1,2,0\n1,,,\n2,2,4,\n3, ,4,15\n4,3,4,20\n5,4,4\n"
    )
    track = read_track(own, VideoSettings(start_s=1.0))
    assert track.time_s.tolist() == [-1.0, 1.0, 3.0, 4.0]
    assert track.position_mm[:, 0].tolist() == [10.0, 20.0, 30.0, 40.0]
    # Between 0 degrees at 0 s and 15 at 3 s of the video; the last one known stays.
    np.testing.assert_allclose(track.turned_deg, [0.0, 10.0, 20.0, 20.0])
    own.write_text("time_s,x_mm,y_mm,turned_deg\n0,1,2,\n1,2,2,\n")
    with pytest.raises(ValueError, match=r"track\.csv: the column of the turn is empty"):
        read_track(own)
    own.write_text("time_s,x_mm,y_mm\n0,1,2\n,2,2\n")
    with pytest.raises(ValueError, match="time_s is '', expected a finite number"):
        read_track(own)


def test_start_and_heading_hold_for_a_track_that_names_its_units(tmp_path: Path) -> None:
    """Of a video that began 5 s earlier, with the robot facing along the picture's y axis."""
    own = tmp_path / "track.csv"
    own.write_text("time_s,x_cm,y_cm,turned_deg\n0,1,2,3\n5,1,2,3\n10,2,9,33\n")
    track = read_track(own, VideoSettings(start_s=5.0, heading_deg=90.0))
    assert track.time_s.tolist() == [-5.0, 0.0, 5.0]
    assert float(track.forward_cm(np.array([5.0]))[0]) == pytest.approx(7.0)
    assert track.achieved(Goal("heading", 90.0), 5.0) == pytest.approx(-1.0)
    assert track.achieved(Goal("turn_left"), 5.0) == pytest.approx(30.0)
    # Its scale is that of its columns.
    scaled = read_track(own, VideoSettings(units_per_mm=4.0, frames_per_second=25.0, y_down=False))
    np.testing.assert_array_equal(scaled.position_mm, read_track(own).position_mm)
    np.testing.assert_array_equal(scaled.time_s, [0.0, 5.0, 10.0])


def test_settings_that_change_nothing_of_a_track_are_told(tmp_path: Path) -> None:
    own = write_track(tmp_path / "own.csv", MarkerTrack(TIMES, _path()))
    assert track_notes(own, VideoSettings(start_s=5.0, heading_deg=90.0)) == []
    (told,) = track_notes(own, VideoSettings(units_per_mm=4.0, frames_per_second=25.0))
    assert "--video.units-per-mm, --video.frames-per-second changes nothing" in told


@pytest.mark.parametrize("kind", ["deeplabcut", "sleap"])
def test_a_scale_that_nobody_gave_is_told(kind: str, tmp_path: Path) -> None:
    table = _two_markers(kind, tmp_path / "track.csv")
    given = VideoSettings(units_per_mm=4.0, frames_per_second=30.0)
    assert track_notes(table, given) == []
    (told,) = track_notes(table, replace(given, frames_per_second=None))
    assert "counts frames, which are taken at 30 a second" in told
    assert "--video.frames-per-second" in told
    (told,) = track_notes(table, VideoSettings())
    assert "--video.units-per-mm 1" in told
    assert "30 a second (--video.frames-per-second)" in told
    _log(tmp_path, 3.9)
    trial = read_trial(tmp_path)
    assert trial.notes == (told,)
    assert notes_of([replace(trial, name="a"), replace(trial, name="b")]) == [f"a, b: {told}"]


def test_of_a_table_that_counts_no_frames_no_rate_is_missed(tmp_path: Path) -> None:
    table = tmp_path / "track.txt"
    table.write_text("mass A\nt,x,y\n0,0,0\n1,2,1\n")
    assert track_notes(table, VideoSettings(units_per_mm=4.0)) == []


@pytest.mark.parametrize("kind", ["tracker", "deeplabcut", "sleap"])
def test_y_points_as_the_program_has_it(kind: str, tmp_path: Path) -> None:
    """Up in Tracker's tables, down in pixels."""
    heads = {
        "tracker": "mass A\nt,x,y\n0,0,0\n1,2,4\n",
        "deeplabcut": "scorer,n,n\nbodyparts,a,a\ncoords,x,y\n0,0,0\n30,2,4\n",
        "sleap": "track,frame_idx,a.x,a.y\nt,0,0,0\nt,30,2,4\n",
    }
    (tmp_path / "track.txt").write_text(heads[kind])
    up = kind == "tracker"
    for y_down, left_mm in ((None, 4.0 if up else -4.0), (True, -4.0), (False, 4.0)):
        track = read_track(tmp_path / "track.txt", VideoSettings(y_down=y_down))
        np.testing.assert_array_equal(track.position_mm, [[0.0, 0.0], [2.0, left_mm]])
        assert track.time_s.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("remark", ["# camera A; 30 fps", "#\tby hand"])
def test_a_remark_does_not_tell_what_separates_columns(remark: str, tmp_path: Path) -> None:
    own = tmp_path / "track.csv"
    own.write_text(f"time_s,x_mm,y_mm,turned_deg\n0,0,0,0\n{remark}\n1,1,1,30\n")
    turned_deg = read_track(own).turned_deg
    assert turned_deg is not None
    assert turned_deg.tolist() == [0.0, 30.0]


@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("head", ["time_s,x_mm,y_mm", "left, or; right\nt,x,y"])
def test_tracks_are_separated_as_in_their_header(head: str, mark: str, tmp_path: Path) -> None:
    *above, names = head.split("\n")
    lines = [*above, names.replace(",", mark), f"0{mark}0{mark}0", f"1{mark}1.5{mark}2"]
    (tmp_path / "track.csv").write_text("\n".join(lines) + "\n")
    track = read_track(tmp_path / "track.csv", VideoSettings(y_down=False))
    assert track.position_mm.tolist() == [[0.0, 0.0], [1.5, 2.0]]


def test_frames_in_which_tracker_lost_the_marker_are_left_out(tmp_path: Path) -> None:
    """It leaves cells empty, or out."""
    rows = ["0,0,0", "0.1,,", "0.2,NaN,NaN", "0.3", "0.4,2,1", ",,"]
    (tmp_path / "track.csv").write_text("\n".join(["mass A", "t,x,y", *rows]) + "\n")
    assert read_track(tmp_path / "track.csv").time_s.tolist() == [0.0, 0.4]
    table = ["scorer,n,n,n", "bodyparts,a,a,a", "coords,x,y,likelihood"]
    table += ["0,1,2,.9", "1,1,2", "2,1,3,.9"]
    (tmp_path / "track.csv").write_text("\n".join(table) + "\n")
    np.testing.assert_allclose(30.0 * read_track(tmp_path / "track.csv").time_s, [0.0, 2.0])


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        (["t;x;y", "0;0;0", "0,1;1,5;1"], "'0,1' is no number, .* it has a decimal comma"),
        (
            ["t,x,y", "0,0,0", "0,1,1,5,1"],
            "row 2 is '0,1,1,5,1', expected 3 cells .* decimal comma",
        ),
        (["t,x,y", "0,0,0", "1,1,lost"], "'lost' is no number, expected one such as 12.5$"),
    ],
)
def test_what_is_no_number_is_told_with_its_cause(
    rows: list[str], why: str, tmp_path: Path
) -> None:
    (tmp_path / "track.csv").write_text("\n".join(["mass A", *rows]) + "\n")
    with pytest.raises(ValueError, match=rf"track .*track\.csv: {why}"):
        read_track(tmp_path / "track.csv")


def test_a_table_of_several_animals_is_refused(tmp_path: Path) -> None:
    lines = ["scorer,n,n,n", "individuals,a,a,a", "bodyparts,leg,leg,leg"]
    lines += ["coords,x,y,likelihood", "0,1,2,.9", "1,1,2,.9"]
    (tmp_path / "track.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match="second row is 'individuals', as of several animals"):
        read_track(tmp_path / "track.csv")


def test_what_is_no_track_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("foo,bar\n1,2\n")
    with pytest.raises(ValueError, match="begins 'foo,bar', expected time_s,x_mm,y_mm"):
        read_track(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("track,frame_idx,instance.score,disk.x,disk.y\nt,1,1,1,1\n")
    with pytest.raises(ValueError, match="marker 'foot' is unknown, the table has disk"):
        read_track(tmp_path / "b.csv", VideoSettings(marker="foot"))


@pytest.mark.parametrize("times", [[0.0, np.nan, 2.0], [0.0, 1.0, np.inf], [0.0, 1.0, 1.0]])
def test_times_that_do_not_rise_are_no_track(times: list[float]) -> None:
    with pytest.raises(ValueError, match="must be finite and rise"):
        MarkerTrack(np.array(times), np.zeros((3, 2)))


def test_points_without_a_score_are_trusted_by_nobody(tmp_path: Path) -> None:
    head = "track,frame_idx,instance.score,disk.x,disk.y,disk.score\n"
    rows = ["t,0,0.9,1,1,0.9", "t,1,0.9,999,999,nan", "t,2,0.9,999,999,", "t,3,0.9,4,1,0.8"]
    (tmp_path / "track.csv").write_text(head + "\n".join(rows) + "\n")
    track = read_track(tmp_path / "track.csv")
    np.testing.assert_allclose(track.position_mm[:, 0], [1.0, 4.0])


def test_a_log_cut_off_in_a_row_reads_to_the_row_before(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    with DeploymentLog(path, 3, {"driver": "test"}) as log:
        log.event(0.0, "start")
        log.command(0.0, np.array([10.0, 0.0, 0.0]))
        log.row(0.01, np.array([10.0, 0.0, 0.0]), np.array([1.0, np.nan, 0.5]))
        log.row(0.11, np.array([10.0, 0.0, 0.0]), np.array([8.0, np.nan, 0.5]))
    path.write_text(path.read_text() + "0.21,10.0,0.")
    read = read_log(path)
    np.testing.assert_allclose(read.time_s, [0.01, 0.11])
    np.testing.assert_allclose(read.sensed_kPa[:, 0], [1.0, 8.0])
    assert read.events[0] == (0.0, "start")
    path.write_text(path.read_text().replace("0.21,10.0,0.", "0.21,10,0,0,8.1,,5"))
    np.testing.assert_allclose(read_log(path).time_s, [0.01, 0.11])  # of 54.7 kPa, cut off


def test_rows_of_a_log_without_their_empty_event_are_whole(tmp_path: Path) -> None:
    """As other programs write them; only the last row may have been cut off."""
    path, rows = tmp_path / "log.csv", ["0,5,5", "0.1,5,6,", "0.2,5,7", "0.3,5"]
    path.write_text("time_s,commanded_1_kPa,sensed_1_kPa,event\n" + "\n".join(rows) + "\n")
    assert read_log(path).sensed_kPa[:, 0].tolist() == [5.0, 6.0, 7.0]
    path.write_text(path.read_text().replace("0.1,5,6,", "0.1,5"))
    with pytest.raises(ValueError, match=r"log\.csv, row 2 has 2 cells, expected 4 as in the"):
        read_log(path)


def test_a_log_in_psi_is_read_in_kPa_and_one_without_a_unit_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s,commanded_1_psi,sensed_1_mbar,event\n0,10,500,\n1,10,600,\n")
    read = read_log(path)
    np.testing.assert_allclose(read.commanded_kPa, np.full((2, 1), 68.94757293168361))
    np.testing.assert_allclose(read.sensed_kPa[:, 0], [50.0, 60.0])
    path.write_text("time_s,commanded_1,sensed_1,event\n0,10,5,\n")
    with pytest.raises(ValueError, match=r"'commanded_1' has the unit '1', expected one of kPa,"):
        read_log(path)


def _simulated(
    forward_cm_per_s: float = 0.0, left_cm_per_s: float = 0.0, turned_deg_per_s: float = 0.0
) -> Trajectory:
    """A robot that moves steadily for 3.9 s."""
    time_s = np.linspace(0.0, 3.9, 40)
    place = 10.0 * np.outer(time_s, [forward_cm_per_s, left_cm_per_s, 0.0])
    turn = Rotation.from_rotvec(
        np.outer(np.radians(turned_deg_per_s) * time_s, [0.0, 0.0, 1.0])
    ).as_matrix()
    pressure = np.zeros((40, 3))
    return Trajectory(time_s, place, turn, place, pressure, pressure, np.zeros(40, int))


def _trial(name: str, path: np.ndarray, delay_s: float = 0.0, turned: float | None = None) -> Trial:
    """A trial with a path (time, 2) [mm], sensed late, turning at a rate [degrees/s]."""
    times = np.arange(0.0, 4.0, 0.05)
    commanded = np.column_stack([np.where(times % 2.0 < 1.0, 40.0, 0.0)] * 3)
    late = times - delay_s
    sensed = np.column_stack([np.where((late >= 0) & (late % 2.0 < 1.0), 40.0, 0.0)] * 3)
    track = MarkerTrack(TIMES, path, None if turned is None else turned * TIMES)
    return Trial(name, LoggedPressures(times, commanded, sensed, ()), track)


def test_distances_ratio_steps_and_backsliding() -> None:
    """Paths whose numbers are known: 1 cm/s forward, or a saw that slides back 0.5 cm a cycle."""
    straight = np.column_stack([10.0 * TIMES, 0.0 * TIMES])
    cycle = TIMES % 2.0
    saw = 10.0 * (TIMES // 2.0) + np.where(cycle < 1.5, 10.0 * cycle, 15.0 - 10.0 * (cycle - 1.5))
    sawtooth = np.column_stack([saw, 0.0 * TIMES])
    trials = [_trial("a", straight), _trial("b", 1.2 * straight)]
    comparison = compare_trials("T", DESIGN, _simulated(forward_cm_per_s=2.0), trials, cycle_s=2.0)
    assert comparison.counted is comparison.distance
    assert comparison.distance.mean == pytest.approx(0.5 * (3.9 + 1.2 * 3.9))
    assert comparison.distance.transfer_ratio == pytest.approx(1.1 / 2.0)
    assert comparison.distance.spread == pytest.approx(0.2 * 3.9 / np.sqrt(2.0))
    simulated, measured = comparison.distance.step_rewards()
    np.testing.assert_allclose(simulated, [2.0, 2.0, 2.0])
    np.testing.assert_allclose(measured, [[1.0] * 3, [1.2] * 3])
    steady = _simulated(forward_cm_per_s=1.0)
    slipping = compare_trials("S", DESIGN, steady, [_trial("a", sawtooth)], cycle_s=2.0)
    simulated_slide, measured_slide = slipping.distance.backsliding()
    assert simulated_slide == pytest.approx(0.0)
    # 0.5 cm a cycle; the second one is cut off 0.1 s early. Samples are 0.05 s apart.
    assert measured_slide[0] == pytest.approx(0.5, abs=0.06)


def test_what_counts_of_a_turning_robot_is_compared_in_degrees() -> None:
    """The simulation turns at 10 degrees a second and goes back, trials at 8 and 6 and do not."""
    trials = [_trial(name, 0.0 * _path(), turned=rate) for name, rate in (("a", 8.0), ("b", 6.0))]
    simulated = _simulated(forward_cm_per_s=-1.0, turned_deg_per_s=10.0)
    comparison = compare_trials("T", DESIGN, simulated, trials, Goal("turn_left", cm_per_unit=0.1))
    told = comparison.summary()
    assert told["simulated_achieved"] == pytest.approx(39.0)
    np.testing.assert_allclose(told["achieved"], [31.2, 23.4])
    assert told["transfer_ratio"] == pytest.approx(0.7)
    np.testing.assert_allclose(told["mean_step_rewards"], [7.0, 7.0, 7.0])
    assert told["simulated_distance_cm"] == pytest.approx(-3.9)
    assert told["mean_distance_cm"] == pytest.approx(0.0)


def test_travel_to_the_left_counts_where_that_was_asked_for() -> None:
    leftward = np.column_stack([3.0 * TIMES, 5.0 * TIMES])
    simulated, trials = _simulated(left_cm_per_s=1.0), [_trial("a", leftward)]
    comparison = compare_trials("H", DESIGN, simulated, trials, Goal("heading", 90.0))
    assert comparison.counted.simulated_end == pytest.approx(3.9)
    assert comparison.counted.mean == pytest.approx(0.5 * 3.9)
    assert comparison.distance.mean == pytest.approx(0.3 * 3.9)


def test_a_track_that_does_not_tell_of_a_turn_is_refused_where_that_counts() -> None:
    with pytest.raises(ValueError, match="T: the tracks of a do not tell how far the robot turned"):
        compare_trials("T", DESIGN, _simulated(), [_trial("a", _path())], Goal("turn_left"))


def test_there_is_no_ratio_to_next_to_nothing() -> None:
    """Of a simulation that stands still for the tracker, and so measured noise is all there is."""
    still = compare_trials("S", DESIGN, _simulated(0.02), [_trial("a", _path())])
    assert still.distance.simulated_end == pytest.approx(0.078)
    assert still.distance.transfer_ratio is None
    assert compare_trials(
        "S", DESIGN, _simulated(0.03), [_trial("a", _path())]
    ).distance.transfer_ratio is not None  # fmt: skip


def test_a_simulation_that_failed_has_no_ratio() -> None:
    """What it did until then still stands beside what was measured."""
    failed = replace(_simulated(forward_cm_per_s=1.0), status="diverged")
    comparison = compare_trials("T", DESIGN, failed, [_trial("a", _path())])
    assert comparison.distance.transfer_ratio is None
    assert comparison.distance.simulated_end == pytest.approx(3.9)


def test_pressure_delay_is_found() -> None:
    tracking = pressure_tracking(_trial("a", _path(), delay_s=0.15))
    assert tracking["delay_s"] == pytest.approx(0.15, abs=0.051)
    assert tracking["rms_kPa"] is not None
    assert tracking["rms_kPa"] > 5.0
    assert pressure_tracking(_trial("a", _path()))["rms_kPa"] == 0.0
    # Of regulators that have legs, while the gait lasts.
    trial = _trial("a", _path())
    trial.pressures.sensed_kPa[:, 1] += 3.0
    trial.pressures.sensed_kPa[trial.pressures.time_s > 2.0, 0] += 50.0
    assert pressure_tracking(trial, {1, 2}, 2.0)["rms_kPa"] == pytest.approx(np.sqrt(4.5))
    assert pressure_tracking(trial, {1}, 2.0)["rms_kPa"] == 0.0


def test_a_command_counts_from_when_it_was_given(tmp_path: Path) -> None:
    """A supply answers a fifth of a second after it was told, and is 0.3 s late."""
    given_s, given_kPa = np.arange(0.0, 20.0), np.tile([60.0, 10.0], 10)

    def held_kPa(time_s: float) -> float:
        place = np.searchsorted(given_s, time_s + 1e-9, side="right") - 1
        return float(given_kPa[place]) if place >= 0 else 0.0

    with DeploymentLog(tmp_path / "log.csv", 2) as log:
        for begin_s, kPa in zip(given_s, given_kPa, strict=True):
            log.command(begin_s, np.full(2, kPa))
            for time_s in begin_s + np.arange(0.2, 0.95, 0.1):
                log.row(time_s, np.full(2, kPa), np.array([held_kPa(time_s - 0.3), np.nan]))
    trial = Trial("a", read_log(tmp_path / "log.csv"), MarkerTrack(TIMES, _path()))
    assert pressure_tracking(trial)["delay_s"] == pytest.approx(0.3)
    # The second channel has no sensor.
    driven = trial.driven_kPa(np.array([0.0, 0.95, 1.0, 1.1, 1.95, 2.0]))[:, 1]
    assert driven.tolist() == [60.0, 60.0, 10.0, 10.0, 10.0, 60.0]


def test_a_command_of_its_samples_time_counts_once(tmp_path: Path) -> None:
    """As on a virtual rig: also after a sample of the same time that still has the one before."""
    with DeploymentLog(tmp_path / "log.csv", 1) as log:
        for time_s, kPa, noted in ((0.0, 5.0, True), (1.0, 5.0, False), (1.0, 9.0, True)):
            if noted:
                log.command(time_s, np.full(1, kPa))
            log.row(time_s, np.full(1, kPa), np.full(1, np.nan))
    read = read_log(tmp_path / "log.csv")
    assert [(time_s, kPa.tolist()) for time_s, kPa in read.commands] == [(0.0, [5.0]), (1.0, [9.0])]
    for log in (read, replace(read, commands=())):
        driven = Trial("a", log, MarkerTrack(TIMES, _path())).driven_kPa(np.array([0.0, 0.9, 1.0]))
        assert driven[:, 0].tolist() == [5.0, 5.0, 9.0]


@pytest.mark.parametrize("samples", [0, 1])
def test_a_trial_that_was_killed_at_once_tells_of_next_to_nothing(
    samples: int, tmp_path: Path
) -> None:
    with DeploymentLog(tmp_path / "log.csv", 1) as log:
        log.command(0.0, np.full(1, 50.0))
        for _ in range(samples):
            log.row(0.03, np.full(1, 50.0), np.zeros(1))
    write_track(tmp_path / "track.csv", MarkerTrack(TIMES, _path()))
    killed = read_trial(tmp_path)
    assert killed.end_s == killed.logged_s == 0.03 * samples
    assert pressure_tracking(killed) == {"rms_kPa": None, "delay_s": None}
    whole = [_trial(name, _path()) for name in ("a", "b")]
    kept, (told,) = whole_trials("L", [whole[0], killed, whole[1]], 3.9, 1.0)
    assert [each.name for each in kept] == ["a", "b"]
    assert told.endswith("left out")


def test_a_log_whose_times_fall_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    with DeploymentLog(path, 1) as log:
        for time_s in (0.0, 0.1, 0.1, 0.05):
            log.row(time_s, np.zeros(1), np.zeros(1))
    with pytest.raises(ValueError, match=r"log\.csv: time_s falls from 0\.1 to 0\.05 s"):
        read_log(path)


def _log(folder: Path, end_s: float) -> np.ndarray:
    """A trial's log of eight samples up to a time [s]; returns their times."""
    times_s = np.linspace(0.0, end_s, 8)
    with DeploymentLog(folder / "log.csv", 1) as log:
        for time_s in times_s:
            log.row(time_s, np.zeros(1), np.zeros(1))
    return times_s


@pytest.mark.parametrize("unit_s", [1e-3, 60.0])
def test_a_track_in_other_units_of_time_than_its_log_is_refused(
    unit_s: float, tmp_path: Path
) -> None:
    """A video that begins earlier and ends later is none."""
    gait_s = _log(tmp_path, 20.0)
    write_track(tmp_path / "track.csv", MarkerTrack(3.0 * gait_s - 10.0, np.zeros((8, 2))))
    assert len(read_trial(tmp_path).track.time_s) == 8
    write_track(tmp_path / "track.csv", MarkerTrack(gait_s / unit_s, np.zeros((8, 2))))
    with pytest.raises(ValueError, match=r"track\.csv lasts .* milliseconds or minutes"):
        read_trial(tmp_path)


@pytest.mark.parametrize("first", [0.0, -121.5])
def test_a_track_whose_times_count_frames_is_refused(first: float, tmp_path: Path) -> None:
    """At 30 frames a second, of the gait and of some seconds before and after it."""
    _log(tmp_path, 20.0)
    frames = np.arange(first, first + 30.0 * 24.0)
    write_track(tmp_path / "track.csv", MarkerTrack(frames / 30.0, np.zeros((720, 2))))
    assert len(read_trial(tmp_path).track.time_s) == 720
    write_track(tmp_path / "track.csv", MarkerTrack(frames, np.zeros((720, 2))))
    with pytest.raises(ValueError, match=r"track\.csv lasts 719 s .* count frames"):
        read_trial(tmp_path)


@pytest.mark.parametrize("begin_s", [4e4, -30.0])
def test_a_track_of_another_time_than_its_log_is_refused(begin_s: float, tmp_path: Path) -> None:
    """Seconds of the day, or a video that was stopped before the gait."""
    _log(tmp_path, 20.0)
    times_s = begin_s + np.linspace(0.0, 20.0, 9)
    write_track(tmp_path / "track.csv", MarkerTrack(times_s, np.zeros((9, 2))))
    with pytest.raises(ValueError, match=r"track\.csv goes from .* count from the gait's start"):
        read_trial(tmp_path)


@pytest.mark.parametrize(("logged_s", "step_s"), [(20.0, 10.0), (20.0, 1.0), (0.9, 1.0)])
def test_a_track_of_whole_seconds_is_taken(logged_s: float, step_s: float, tmp_path: Path) -> None:
    """Read from a ruler, or from a time lapse, which runs on where a trial ended at once."""
    _log(tmp_path, logged_s)
    times_s = np.arange(-10.0, 61.0, step_s)
    write_track(tmp_path / "track.csv", MarkerTrack(times_s, np.zeros((len(times_s), 2))))
    assert len(read_trial(tmp_path).track.time_s) == len(times_s)


def test_trial_folders(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="holds no trials"):
        trial_folders(tmp_path)
    for number in (1, 2, 10):
        folder = tmp_path / f"trial_{number}"
        with DeploymentLog(folder / "log.csv", 1) as log:
            log.row(0.0, np.zeros(1), np.zeros(1))
        write_track(folder / "track.csv", MarkerTrack(TIMES, _path()))
    folders = trial_folders(tmp_path)
    assert [each.name for each in folders] == ["trial_1", "trial_2", "trial_10"]
    assert read_trial(folders[0]).name == "trial_1"
    (folders[0] / "track.csv").rename(folders[0] / "video.csv")
    with pytest.raises(FileNotFoundError, match="holds no track"):
        read_trial(folders[0])
    with pytest.raises(FileNotFoundError, match=r"of a deployment, .* such as .*trial_1$"):
        read_trial(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"trial_9 does not exist"):
        read_trial(tmp_path / "trial_9")


def test_a_label_that_is_given_twice_is_refused_before_anything_is_simulated(
    tmp_path: Path,
) -> None:
    with pytest.raises(ValueError, match=r"two: the label 'L' is that of one already"):
        transfer(
            ["L=one", "L=two"], TransferSettings(), paper_robot(),
            RunFolder(tmp_path / "out", "transfer"),
        )  # fmt: skip
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("runs", [["../B=dep"], ["a\\b=dep"], ["=/"]])
def test_labels_that_are_no_names_of_files_are_refused(runs: list[str], tmp_path: Path) -> None:
    """They name the simulations' files, which are to stay in the run's folder."""
    with pytest.raises(ValueError, match="names files of its own, expected one without slashes"):
        transfer(runs, TransferSettings(), paper_robot(), RunFolder(tmp_path / "out", "transfer"))
    assert not list(tmp_path.iterdir())
