"""The path of a robot's marker, from the tables that video trackers write.

Four formats are told apart by their header:

- ours: ``time_s,x_mm,y_mm`` (units of the header, see `measured_table`), with ``turned_deg`` where
  it is known how far the robot has turned to the left; empty where the marker was not seen;
- Tracker (Open Source Physics): a line with the mass's name, then ``t,x,y``;
- DeepLabCut: three header rows ``scorer``, ``bodyparts``, ``coords`` with x, y, likelihood;
- SLEAP: ``track,frame_idx,instance.score,NODE.x,NODE.y,NODE.score``.

The last three give pixels, or whatever unit their user chose: `VideoSettings` turns them into mm. A
second marker in front of the first tells how the robot turns. Of a track of ours, when the gait
starts and which direction is forward are told by `VideoSettings` too, and nothing else.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import read_text, reading, write_text
from pneumorph.base.checked import Checked, Positive, rises
from pneumorph.base.layers import changed_flags
from pneumorph.environment.goal import Goal
from pneumorph.hardware.measured_table import (
    decimal_comma_note,
    delimiter_of,
    read_measured_table,
    refuse_longer,
)

LOST_S = 0.5
LOST_POINTS = 5.0
"""A marker that was not seen for longer, and for so many times the usual distance of points, was
lost: where it was meanwhile is not the straight line between."""

SWAPPED_DEG = 90.0
"""Two markers that seem to turn by more from one frame to the next, and were not lost between, have
changed places in one of them: no robot that crawls turns so fast."""

USUAL_FRAMES_PER_SECOND = 30.0
"""Of a video whose frame rate nobody gave [1/s]."""

_FOR_ALL_TRACKS = ("--start-s", "--heading-deg")
"""What `VideoSettings` tell of tracks that name their units."""

_TRACKER_HEADER = re.compile(r"\s*t\s*[,;\t]")


@dataclass(frozen=True)
class VideoSettings(Checked):
    """How the positions in a video tracker's table become millimetres on the floor."""

    units_per_mm: Positive = 1.0
    """Pixels (or the tracker's units) per millimetre, of a table that does not name its units."""
    frames_per_second: Positive | None = None
    """Frame rate of the video, for a table that counts frames [1/s]; None: 30, with a note."""
    start_s: float = 0.0
    """Time in the video at which the gait starts [s]."""
    heading_deg: float = 0.0
    """Direction that is forward, in which a robot faces at the start unless `--physics.start` turns
    it, counter-clockwise from the picture's x axis [degrees]."""
    y_down: bool | None = None
    """Whether the picture's y axis points down; None: it does in DeepLabCut's and SLEAP's tables,
    which are in pixels, and points up in Tracker's."""
    marker: str = ""
    """Name of the body part or node to follow (DeepLabCut, SLEAP); empty: the first in the
    table."""
    marker_ahead: str = ""
    """Name of a second one in front of it (DeepLabCut, SLEAP): the robot faces from the first to
    the second, which tells how far it turns. Empty: the turn is not known, but from a column of our
    own format."""
    least_likelihood: float = 0.6
    """Points that the tracker rates less likely than this, 0 to 1, are left out."""

    @property
    def frame_rate(self) -> float:
        """Frames of the video each second, given or usual [1/s]."""
        return self.frames_per_second or USUAL_FRAMES_PER_SECOND


@dataclass(frozen=True, eq=False)
class MarkerTrack:
    """Where a marker was.

    Attributes:
        time_s: Times since the gait's start, rising [s], (frame,).
        position_mm: Forward (x) and leftward (y) place [mm], (frame, 2).
        turned_deg: Turn to the left, whole circles counted [degrees], (frame,); None where one
            marker alone was followed.

    Raises:
        ValueError: Fewer than two points, or times that do not rise.
    """

    time_s: np.ndarray
    position_mm: np.ndarray
    turned_deg: np.ndarray | None = None

    def __post_init__(self) -> None:
        if len(self.time_s) < 2:
            raise ValueError(f"a track needs at least 2 points, got {len(self.time_s)}")
        if not rises(self.time_s):
            raise ValueError(
                "times of a track must be finite and rise; frames may be doubled or out of order"
            )

    def seen(self, time_s: np.ndarray) -> np.ndarray:
        """Whether the marker was seen about given times, (time,): not before its first point, after
        its last, or while it was lost (`lost`)."""
        within: np.ndarray = (time_s >= self.time_s[0]) & (time_s <= self.time_s[-1])
        for begin_s, end_s in self.lost():
            within &= (time_s <= begin_s) | (time_s >= end_s)
        return within

    def lost(self) -> list[tuple[float, float]]:
        """From when to when the marker was not seen [s]: for half a second, and for much longer
        than from point to point elsewhere."""
        return [
            (float(self.time_s[place]), float(self.time_s[place + 1]))
            for place in np.flatnonzero(np.diff(self.time_s) > _longest_unseen_s(self.time_s))
        ]

    def forward_cm(self, time_s: np.ndarray) -> np.ndarray:
        """Forward travel since the gait's start at given times [cm], linear in between.

        Before the first and after the last point the nearest point counts.
        """
        return self._since_start(self.position_mm[:, 0], time_s) / 10.0

    def achieved(self, goal: Goal, time_s: float) -> float | None:
        """How much of a goal was achieved at a time since the gait's start [its unit]; None where
        the track does not tell, as of a turn where one marker alone was followed."""
        way = self.along(goal, np.array([time_s]))
        return None if way is None else float(way[0])

    def along(self, goal: Goal, time_s: np.ndarray) -> np.ndarray | None:
        """The same at several times, (time,)."""
        if goal.turns and self.turned_deg is None:
            return None
        turned = np.zeros(len(self.time_s)) if self.turned_deg is None else self.turned_deg
        left_cm = self._since_start(self.position_mm[:, 1], time_s) / 10.0
        return goal.of(self.forward_cm(time_s), left_cm, self._since_start(turned, time_s))

    def _since_start(self, value: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        change: np.ndarray = np.interp(time_s, self.time_s, value) - np.interp(
            0.0, self.time_s, value
        )
        return change


def _longest_unseen_s(time_s: np.ndarray) -> float:
    """For how long a marker may be unseen that was not lost [s].

    Args:
        time_s: When it was seen [s], (frame,).
    """
    return max(LOST_S, LOST_POINTS * float(np.median(np.diff(time_s))))


def read_track(path: Path | str, video: VideoSettings | None = None) -> MarkerTrack:
    """Read a track in any of the formats.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not one of the formats, an unknown marker, or hardly any trusted point.
    """
    path, video = Path(path), video or VideoSettings()
    rows = _rows(path)
    head = rows[0] if rows else []
    try:
        if _says_its_units(head):
            turned = {"turned": "deg"} if any(name.startswith("turned_") for name in head) else {}
            columns = {"time": "s", "x": "mm", "y": "mm", **turned}
            table = read_measured_table(path, columns, may_lack=("x", "y", "turned"))
            position_mm = np.column_stack([table["x"], table["y"]])
            own = replace(video, units_per_mm=1.0, y_down=False)
            track = _placed(table["time"], position_mm, own)
            return (
                _turned(track, table["time"] - video.start_s, table["turned"]) if turned else track
            )
        if head and head[0] == "scorer":
            return _track_of(lambda marker: _deeplabcut(rows, marker, video), video)
        if "frame_idx" in head:
            return _track_of(lambda marker: _sleap(rows, marker, video), video)
        for place in range(min(2, len(rows))):
            if rows[place][:3] == ["t", "x", "y"]:
                cells = [[_number(text) for text in row[:3]] for row in _below(rows, place)]
                values = np.array(cells).reshape(-1, 3)
                return _placed(values[:, 0], values[:, 1:], video)
    except (ValueError, IndexError) as error:
        raise ValueError(f"track {path}: {error}") from error
    raise ValueError(
        f"track {path} begins {','.join(head)!r}, expected time_s,x_mm,y_mm, or the table of "
        "Tracker (t,x,y), DeepLabCut (scorer,...) or SLEAP (track,frame_idx,...)"
    )


def says_its_units(path: Path) -> bool:
    """Whether a track is of our own format: another program's takes `VideoSettings` to be read.

    Raises:
        FileNotFoundError: No such file.
        ValueError: It is no table.
    """
    rows = _rows(path)
    return bool(rows) and _says_its_units(rows[0])


def track_notes(path: Path, video: VideoSettings) -> list[str]:
    """What to tell of a track that `read_track` reads: that its scale or its frame rate is not
    known, or settings that change nothing of it."""
    if says_its_units(path):
        given = changed_flags(VideoSettings(), video)
        idle = [f"--video.{flag[2:]}" for flag in given if flag not in _FOR_ALL_TRACKS]
        told = f"its columns name their units, and {', '.join(idle)} changes nothing of it"
        return [told] if idle else []
    if video.units_per_mm != VideoSettings.units_per_mm:
        if video.frames_per_second is not None or not _counts_frames(_rows(path)[0]):
            return []
        return [
            f"its table counts frames, which are taken at {video.frame_rate:g} a second, as none "
            "is given (--video.frames-per-second): at another rate of the camera its times are "
            "wrong by as much"
        ]
    return [
        "its table does not name its units: positions are counted as mm (--video.units-per-mm "
        f"{video.units_per_mm:g}), and frames, of a table that counts them, at "
        f"{video.frame_rate:g} a second (--video.frames-per-second); distances of a table "
        "in pixels are wrong by their scale"
    ]


def _says_its_units(head: Sequence[str]) -> bool:
    return any(name.startswith(("time_", "x_")) for name in head)


def _counts_frames(head: Sequence[str]) -> bool:
    """Whether a header is DeepLabCut's or SLEAP's."""
    return head[0] == "scorer" or "frame_idx" in head


def _rows(path: Path) -> list[list[str]]:
    """Cells of a track's file, its header's first, without remarks and empty lines."""
    text = read_text(path, "track")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    # Above Tracker's header is a line with the mass's name.
    header = next((line for line in lines[:2] if _TRACKER_HEADER.match(line)), "".join(lines[:1]))
    with reading(path, "track"):
        table = csv.reader(lines, delimiter=delimiter_of(header))
        return [[cell.strip() for cell in row] for row in table]


def _below(rows: list[list[str]], head: int) -> list[list[str]]:
    """Rows below a header's, each as long as that: programs leave out cells at the end.

    Raises:
        ValueError: A row is longer.
    """
    width = len(rows[head])
    refuse_longer(rows[head + 1 :], width)
    return [[*row[:width], *[""] * (width - len(row))] for row in rows[head + 1 :]]


def write_track(path: Path | str, track: MarkerTrack) -> Path:
    """Write a track in the package's own format."""
    known = track.turned_deg is not None
    columns = [track.time_s, *track.position_mm.T, *([track.turned_deg] if known else [])]
    lines = ["time_s,x_mm,y_mm" + (",turned_deg" if known else "")]
    lines += [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    return write_text(path, "\n".join(lines) + "\n")


def _track_of(
    followed: Callable[[str], tuple[np.ndarray, np.ndarray]], video: VideoSettings
) -> MarkerTrack:
    """The track of the marker, with the turn where a second one is followed as well.

    From one frame with both markers to the next the robot is taken to turn evenly, and by less than
    half a circle.

    Args:
        followed: Gives the times (frame,) and the picture's points (frame, 2) of a marker by its
            name, empty for the first; NaN where it was not seen.
        video: What the picture means.

    Raises:
        ValueError: The second marker is the first, or is hardly seen; or they change places.
    """
    if video.y_down is None:
        video = replace(video, y_down=True)  # they are in pixels
    track = _placed(*followed(video.marker), video)
    if not video.marker_ahead:
        return track
    if video.marker_ahead == video.marker:
        raise ValueError(
            f"marker_ahead is {video.marker_ahead!r}, as marker is, expected another one in front "
            "of it: the robot faces from one to the other"
        )
    try:
        ahead = _placed(*followed(video.marker_ahead), video)
    except ValueError as error:
        raise ValueError(f"marker_ahead {video.marker_ahead!r}: {error}") from error
    both_s, first, second = np.intersect1d(track.time_s, ahead.time_s, return_indices=True)
    facing = ahead.position_mm[second] - track.position_mm[first]
    apart = facing.any(axis=1)
    if apart.sum() < 2:
        raise ValueError(
            f"marker_ahead {video.marker_ahead!r} is seen apart from the marker in "
            f"{apart.sum()} frames, expected at least 2: it may be the same one (marker, the "
            "table's first by default), or hardly trusted (least_likelihood)"
        )
    angle = np.degrees(np.arctan2(facing[apart, 1], facing[apart, 0]))
    turned, both_s = np.unwrap(angle, period=360.0), both_s[apart]
    near = np.diff(both_s) <= _longest_unseen_s(track.time_s)
    for place in np.flatnonzero(np.abs(np.diff(turned)) > SWAPPED_DEG):
        before_s, after_s = both_s[place : place + 2] + video.start_s
        if near[place]:
            raise ValueError(
                f"marker_ahead {video.marker_ahead!r}: from {before_s:.3f} to {after_s:.3f} s of "
                f"the video the robot would turn by {abs(turned[place + 1] - turned[place]):.0f} "
                f"degrees, expected at most {SWAPPED_DEG:g}; the two markers may have changed "
                "places in a frame: correct it in the tracker, or empty its cells; or frames are "
                "too far apart to tell how far it turns"
            )
    return _turned(track, both_s, turned)


def _turned(track: MarkerTrack, time_s: np.ndarray, turned_deg: np.ndarray) -> MarkerTrack:
    """The track with a turn [degrees] that is known at some times [s], (time,), NaN where not.

    Raises:
        ValueError: It is known nowhere.
    """
    known = np.isfinite(turned_deg)
    if not known.any():
        raise ValueError("the column of the turn is empty, expected degrees, or no such column")
    turned = np.interp(track.time_s, time_s[known], turned_deg[known])
    return replace(track, turned_deg=turned)


def _deeplabcut(
    rows: list[list[str]], marker: str, video: VideoSettings
) -> tuple[np.ndarray, np.ndarray]:
    if rows[1][0] == "individuals":
        raise ValueError(
            "its second row is 'individuals', as of several animals, expected the table of one: "
            "rows scorer, bodyparts, coords, such as an export of the robot alone"
        )
    parts, coordinates = rows[1], rows[2]
    name = _marker(sorted(set(parts[1:]), key=parts.index), marker)
    column = {c: i for i, c in enumerate(coordinates) if parts[i] == name}
    times, points = [], []
    for row in _below(rows, 2):
        trusted = "likelihood" not in column or _number(row[column["likelihood"]]) >= (
            video.least_likelihood
        )
        if trusted:
            times.append(_number(row[0]) / video.frame_rate)
            points.append([_number(row[column["x"]]), _number(row[column["y"]])])
    return np.array(times), np.array(points).reshape(-1, 2)


def _sleap(
    rows: list[list[str]], marker: str, video: VideoSettings
) -> tuple[np.ndarray, np.ndarray]:
    head = rows[0]
    if "track" in head:
        named = sorted({row[head.index("track")] for row in _below(rows, 0)} - {""})
        if len(named) > 1:
            raise ValueError(
                f"its rows are of several tracks, {', '.join(named)}, expected those of one, such "
                "as an export of the robot alone"
            )
    nodes = [c.removesuffix(".x") for c in head if c.endswith(".x")]
    name = _marker(nodes, marker)
    x, y, frame = head.index(f"{name}.x"), head.index(f"{name}.y"), head.index("frame_idx")
    score = head.index(f"{name}.score") if f"{name}.score" in head else None
    times, points = [], []
    for row in _below(rows, 0):
        # A score that is missing or NaN is trusted by nobody.
        trusted = score is None or _number(row[score]) >= video.least_likelihood
        if not row[x] or not trusted:
            continue
        times.append(_number(row[frame]) / video.frame_rate)
        points.append([_number(row[x]), _number(row[y])])
    return np.array(times), np.array(points).reshape(-1, 2)


def _marker(known: list[str], wanted: str) -> str:
    if wanted and wanted not in known:
        raise ValueError(f"marker {wanted!r} is unknown, the table has {', '.join(known)}")
    return wanted or known[0]


def _number(text: str) -> float:
    if not text:
        return math.nan
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{text!r} is no number, expected one such as 12.5{decimal_comma_note(text)}"
        ) from None


def _placed(time_s: np.ndarray, points: np.ndarray, video: VideoSettings) -> MarkerTrack:
    """Turn a picture's points into forward and leftward millimetres since the gait's start."""
    seen = np.isfinite(points).all(axis=1)
    points = points[seen] / video.units_per_mm * np.array([1.0, -1.0 if video.y_down else 1.0])
    angle = math.radians(video.heading_deg)
    forward = np.array([math.cos(angle), math.sin(angle)])
    left = np.array([-math.sin(angle), math.cos(angle)])
    return MarkerTrack(time_s[seen] - video.start_s, points @ np.column_stack([forward, left]))
