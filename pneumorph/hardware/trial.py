"""One measured trial: what was commanded, what was sensed, and where the robot went."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.gait.gait_file import read_gait
from pneumorph.hardware.deployment_log import LoggedPressures, read_log
from pneumorph.hardware.marker_track import MarkerTrack, VideoSettings, read_track, track_notes

LOG_FILE = "log.csv"
TRACK_PATTERN = "track*"
SCHEDULE_FILE = "schedule.csv"
"""Of a deployment, beside its trials' folders."""

OTHER_UNIT = 50.0
"""A video that lasts this many times as long as the log, or the other way round, is taken to be
timed in another unit; one that runs on before and after the gait is not."""

LONGEST_VIDEO_S = 600.0
"""Nor is one of this length beside the log of a trial that ended at once [s]."""

SLOWEST_CAMERA_HZ = 5.0
"""A track whose times rise by one, and that lasts this many times as long as the log, is taken to
count frames."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A trial's log and track."""

    name: str
    pressures: LoggedPressures
    track: MarkerTrack
    notes: tuple[str, ...] = ()
    """What to tell of how its track was read."""

    @property
    def end_s(self) -> float:
        """Until when the gait is known to have been walked and seen [s]: its track may go on behind
        a run that was stopped, or a log that was cut off."""
        return min(self.pressures.driven_s, float(self.track.time_s[-1]))

    @property
    def logged_s(self) -> float:
        """Until when pressures were logged and the marker was tracked [s]."""
        log_s = self.pressures.time_s
        return min(float(log_s[-1]) if len(log_s) else 0.0, float(self.track.time_s[-1]))

    def driven_kPa(self, time_s: np.ndarray) -> np.ndarray:
        """Pressure that drove the robot at given times [real kPa], (time, channel).

        The sensed pressure, linear between samples, or the commanded one where there is no sensor.
        """
        log = self.pressures
        columns = []
        for sensed, commanded in zip(log.sensed_kPa.T, log.commanded_at(time_s).T, strict=True):
            known = np.isfinite(sensed)
            if known.sum() >= 2:
                columns.append(np.interp(time_s, log.time_s[known], sensed[known]))
            else:
                columns.append(commanded)
        return np.maximum(0.0, np.column_stack(columns))


def read_trial(folder: Path, video: VideoSettings | None = None) -> Trial:
    """Read the trial of a folder: its ``log.csv`` and its ``track`` in any format.

    Raises:
        FileNotFoundError: The log or the track is missing.
        ValueError: One of them cannot be read, there are several tracks, or the track's times are
            of another order than the log's.
    """
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} does not exist, expected the folder of a trial")
    tracks = sorted(folder.glob(TRACK_PATTERN))
    if not tracks and any(folder.glob(f"*/{LOG_FILE}")):
        first = trial_folders(folder)[0]
        raise FileNotFoundError(
            f"{folder} is the folder of a deployment, expected that of one of its trials, such as "
            f"{first}"
        )
    if not tracks:
        raise FileNotFoundError(
            f"{folder} holds no track, expected a file such as track.csv with the marker's path; "
            "put the table of your video tracker there"
        )
    if len(tracks) > 1:
        raise ValueError(f"{folder} holds {[each.name for each in tracks]}, expected one track")
    log, track = read_log(folder / LOG_FILE), read_track(tracks[0], video)
    _check_times(log, folder / LOG_FILE, track, tracks[0])
    return Trial(folder.name, log, track, tuple(track_notes(tracks[0], video or VideoSettings())))


def read_trials(run: Path, video: VideoSettings | None = None) -> tuple[list[Trial], list[str]]:
    """Read the trials of a deployment, but those that ended before the gait, stopped or with their
    log cut off, and whose video nobody tracked.

    Returns:
        The trials, and the names of those that are left out.

    Raises:
        FileNotFoundError: There are none, one that walked to the end has no track, or no trial has.
        ValueError: As `read_trial`.
    """
    folders = trial_folders(run)
    early = _ended_early(run, folders)
    unseen = [each for each in early if not any(each.glob(TRACK_PATTERN))]
    if len(unseen) == len(folders):
        unseen = []  # the first one says what is missing
    trials = [read_trial(each, video) for each in folders if each not in unseen]
    return trials, [each.name for each in unseen]


def folders_to_fit(run: Path) -> tuple[list[Path], list[str]]:
    """Folders of a deployment's trials, but those that ended before the gait, stopped or with their
    log cut off, where others did not.

    Returns:
        The folders, and what to tell.

    Raises:
        FileNotFoundError: There are none.
        ValueError: A log, or the schedule, cannot be read.
    """
    folders = trial_folders(run)
    early = _ended_early(run, folders)
    if not early:
        return folders, []
    told = f"{', '.join(each.name for each in early)}: stopped or cut off before the gait's end"
    if len(early) == len(folders):
        return folders, [f"{told}, as all trials are; fitted to as far as they went"]
    return [each for each in folders if each not in early], [f"{told}; left out"]


def notes_of(trials: Sequence[Trial]) -> list[str]:
    """What to tell of how tracks were read, once of all of which it is the same."""
    told = dict.fromkeys(note for trial in trials for note in trial.notes)
    return [
        f"{', '.join(trial.name for trial in trials if note in trial.notes)}: {note}"
        for note in told
    ]


def _ended_early(run: Path, folders: Sequence[Path]) -> list[Path]:
    """Folders of trials that were stopped, or whose log ends before the gait that was scheduled."""
    schedule, gait_s = run / SCHEDULE_FILE, 0.0
    if schedule.is_file():
        gait_s = read_gait(schedule, maximum_pressure_kPa=np.inf)[0].duration_s

    def early(log: LoggedPressures) -> bool:
        return log.stopped is not None or log.driven_s < gait_s

    return [each for each in folders if early(read_log(each / LOG_FILE))]


def _check_times(
    log: LoggedPressures, log_file: Path, track: MarkerTrack, track_file: Path
) -> None:
    """Refuse a track that is of another time than its log, or in another unit.

    Raises:
        ValueError: It is.
    """
    end_s = float(log.time_s[-1]) if len(log.time_s) else np.inf
    if not (track.time_s[0] <= end_s and track.time_s[-1] > 0.0):
        raise ValueError(
            f"{track_file} goes from {track.time_s[0]:g} to {track.time_s[-1]:g} s and "
            f"{log_file} to {end_s:g} s, expected both to count from the gait's start "
            "(--video.start-s)"
        )
    logged_s, tracked_s = np.ptp(log.time_s) if len(log.time_s) else 0.0, np.ptp(track.time_s)
    long = tracked_s > max(OTHER_UNIT * logged_s, LONGEST_VIDEO_S)
    if logged_s > 0.0 and (long or tracked_s < logged_s / OTHER_UNIT):
        raise ValueError(
            f"{track_file} lasts {tracked_s:g} s and {log_file} {logged_s:g} s, expected "
            "about the same: times may be in milliseconds or minutes, which a column time_ms or "
            "time_min says"
        )
    counted = len(track.time_s) > 2 and float(np.median(np.diff(track.time_s))) == 1.0
    if counted and logged_s >= 1.0 and tracked_s > SLOWEST_CAMERA_HZ * logged_s:
        raise ValueError(
            f"{track_file} lasts {tracked_s:g} s and {log_file} {logged_s:g} s, expected "
            "about the same: its times rise by one, so they may count frames, which divided by the "
            "camera's frames per second are seconds"
        )


def trial_folders(run: Path) -> list[Path]:
    """Folders of a deployment's trials, in order.

    Raises:
        FileNotFoundError: There are none.
    """
    folders = sorted(
        (log.parent for log in run.glob(f"*/{LOG_FILE}")),
        key=lambda path: (len(path.name), path.name),
    )
    if not folders:
        raise FileNotFoundError(
            f"{run} holds no trials, expected the folder of `pneumorph deploy` with trial_1/"
            f"{LOG_FILE} and so on"
        )
    return folders
