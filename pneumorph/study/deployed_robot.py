"""What was commanded and measured of a robot on a rig, as its deployment's folder has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from pneumorph.base.run_folder import SUMMARY
from pneumorph.environment.goal import Goal
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.deployment_log import COMMAND
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.schedule import SAME_LOGGED_S, count_skipped, places, skipped_note
from pneumorph.hardware.trial import (
    SCHEDULE_FILE,
    Trial,
    notes_of,
    read_trials,
    trial_folders,
)
from pneumorph.hardware.trial_comparison import check_length
from pneumorph.physics.calibration import NOT_CALIBRATED, UsedCalibration
from pneumorph.robot.design import Design
from pneumorph.study.finished_run import FinishedRun

SAME_LINE = 1e-3
"""Calibrations whose lines, over their moduli, differ by a smaller share convert pressures alike,
to 0.1 kPa."""


@dataclass(frozen=True, eq=False)
class DeployedRobot:
    """What was commanded and measured of one robot."""

    label: str
    run: Path
    gait: HeldGait
    design: Design
    trials: tuple[Trial, ...]

    @classmethod
    def read(
        cls, label: str, run: Path, video: VideoSettings, step_s: float, notes: list[str]
    ) -> DeployedRobot:
        """Read it; what is left out of it goes to the notes.

        Args:
            label: Name of the robot.
            run: The folder.
            video: How tracks are read.
            step_s: Length of a step [s], of which a trial may miss one at most.
            notes: Receives what to tell.

        Raises:
            FileNotFoundError: It has no trials, or one that walked to the end no track.
            ValueError: It is a bend test.
        """
        if not (run / SCHEDULE_FILE).is_file():
            trial_folders(run)  # says what a folder lacks that is none of a deployment
        gait, comments = read_gait(run / SCHEDULE_FILE, maximum_pressure_kPa=float("inf"))
        if "design" not in comments:
            raise ValueError(f"{run} is a bend test, expected the deployment of a design's gait")
        tracked, unseen = read_trials(run, video)
        if unseen:
            notes.append(
                f"{label}: {', '.join(unseen)}: stopped or cut off, and without a track; left out"
            )
        trials, told = whole_trials(label, tracked, gait.duration_s, step_s)
        notes += [*told, *lost_notes(label, trials), *skipped_notes(label, trials, gait)]
        notes += [f"{label}: {note}" for note in notes_of(trials)]
        check_length(label, gait.duration_s, trials, step_s)
        robot = cls(label, run, gait, Design.parse(comments["design"]), trials)
        if (task := robot.learned_for) is not None:
            notes.append(f"{label} was learned for the task {task}, which is in no file of its run")
        return robot

    @cached_property
    def finished(self) -> FinishedRun | None:
        """Its deployment; None where the folder has no summary."""
        return FinishedRun.read(self.run) if (self.run / SUMMARY).is_file() else None

    @property
    def learned_for(self) -> str | None:
        """Task of one's own that its gait was learned for; None where no summary names one."""
        run = self.finished
        if run is None or run.summary.get("learned_for") is None:
            return None
        return run.of_summary("learned_for", str)

    def goal(self) -> Goal | None:
        """What it was taught; None where no summary says so."""
        return None if self.finished is None else self.finished.goal

    def other_pressures(self, ours: UsedCalibration) -> list[str]:
        """What to tell where its commands were made for a robot whose pressures do otherwise."""
        theirs = None if self.finished is None else self.finished.calibration
        if theirs is None or theirs.digest is None:
            return []  # commanded as the gait has them
        lines = [
            np.array([each.slope, each.intercept_kPa]) / (each.modulus_factor or 1.0)
            for each in (theirs, ours)
        ]
        if np.allclose(lines[0], lines[1], rtol=SAME_LINE):
            return []
        by_ours = f"with {ours.said}" if ours.said != NOT_CALIBRATED else "without a calibration"
        return [
            f"{self.label} was deployed with {theirs.file} (slope {theirs.slope:.4g}, intercept "
            f"{theirs.intercept_kPa:.4g} kPa{_modulus(theirs)}), for which its pressures were "
            f"converted, and is simulated {by_ours} ({ours.slope:.4g}, {ours.intercept_kPa:.4g} "
            f"kPa{_modulus(ours)}): these are not the commands that the simulation should have; "
            f"--calibration {theirs.file} simulates it as deployed"
        ]

    def tells_of(self, goal: Goal) -> bool:
        """Whether all tracks tell what of a goal was achieved."""
        return all(trial.track.achieved(goal, 0.0) is not None for trial in self.trials)


def _modulus(calibration: UsedCalibration) -> str:
    factor = calibration.modulus_factor
    return "" if factor is None else f", modulus factor {factor:.4g}"


def labelled_runs(runs: Sequence[str]) -> dict[str, Path]:
    """Folders by their labels, of LABEL=FOLDER or FOLDER.

    Raises:
        ValueError: A label is none, has slashes or is given twice.
    """
    found: dict[str, Path] = {}
    for text in runs:
        label, _, path = text.rpartition("=")
        label = label or Path(path).name
        if not label or set(label) & set("/\\"):
            raise ValueError(
                f"{text}: the label {label!r} names files of its own, expected one without "
                "slashes: LABEL=FOLDER"
            )
        if label in found:
            raise ValueError(
                f"{text}: the label {label!r} is that of {found[label]} already, expected one for "
                "each run: LABEL=FOLDER"
            )
        found[label] = Path(path)
    return found


def whole_trials(
    label: str, trials: Sequence[Trial], duration_s: float, step_s: float
) -> tuple[tuple[Trial, ...], list[str]]:
    """Leave out trials that were stopped, or whose tracks begin late or end early, where others do
    not: the shortest decides how much of the others counts, and what came before its begin is not
    known.

    Args:
        label: Name of the robot.
        trials: Its trials.
        duration_s: Length of the gait [s].
        step_s: How much of it a trial may miss at most, a step [s].

    Returns:
        Those to compare, and what to tell. Trials of less than a step are left out beside longer
        ones, whether those are whole or not.
    """
    begun = [each for each in trials if each.end_s >= step_s]
    if 0 < len(begun) < len(trials):
        at_once = ", ".join(
            f"{each.name} until {each.end_s:.2f} s" for each in trials if each not in begun
        )
        kept, others = whole_trials(label, begun, duration_s, step_s)
        note = f"{label}: trials tell of less than a step of {step_s:g} s: {at_once}; left out"
        return kept, [note, *others]
    short = [
        each for each in trials if each.end_s < duration_s - step_s or each.track.time_s[0] > step_s
    ]
    if not short:
        return tuple(trials), []
    told = ", ".join(
        f"{each.name} from {max(each.track.time_s[0], 0.0):.2f} to {each.end_s:.2f} s"
        + (" (stopped)" if each.pressures.stopped else "")
        for each in short
    )
    ended = f"{label}: of a gait of {duration_s:g} s trials tell of a part: {told}"
    if len(short) == len(trials):
        return tuple(trials), [f"{ended}; what all have in common is compared"]
    return tuple(each for each in trials if each not in short), [f"{ended}; left out"]


def lost_notes(label: str, trials: Sequence[Trial]) -> list[str]:
    """What to tell of markers that were not seen for a while: straight lines are compared there."""
    told = [
        f"{each.name} from {begin_s:.2f} to {end_s:.2f} s"
        for each in trials
        for begin_s, end_s in each.track.lost()
        if end_s > 0.0 and begin_s < each.end_s
    ]
    if not told:
        return []
    return [
        f"{label}: the marker was not seen in {', '.join(told)}: the path is taken for a straight "
        "line there, and rewards of those steps and slides back are those of the line"
    ]


def skipped_notes(label: str, trials: Sequence[Trial], gait: HeldGait) -> list[str]:
    """What to tell of trials whose logs lack commands of their schedule: the rig was too slow.

    Args:
        label: Name of the robot.
        trials: Its trials.
        gait: The schedule.
    """
    due_s = np.append(gait.start_s, gait.duration_s)
    skipped = {each.name: count_skipped(_sent_places(each, due_s)) for each in trials}
    note = skipped_note(skipped, len(gait.start_s))
    return [] if note is None else [f"{label}: {note}"]


def _sent_places(trial: Trial, due_s: np.ndarray) -> list[int]:
    """Places of the commands that its log tells were sent, but for the zero of a stop."""
    log = trial.pressures
    end_s = np.inf if log.stopped is None else log.stopped[0]  # when zero was commanded
    sent_s = [time_s for time_s, event in log.events if event == COMMAND and time_s < end_s]
    return [int(place) for place in places(due_s, np.array(sent_s), SAME_LOGGED_S)]
