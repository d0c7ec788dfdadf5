"""A gait as timed commands that a rig can follow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.trial import SCHEDULE_FILE
from pneumorph.physics.open_loop_gait import SAME_TIME_S, OpenLoopGait, sample_commands, step_count

SEARCH_STEP_S = 0.01
"""The gait is looked at this often for changes [s]: the simulation's time step."""

SAME_LOGGED_S = 1e-3
"""Commands that a log tells of are this far from their own time at most [s]: it tells times to
0.1 ms, and no two commands are that near."""

LEAST_SHARE = 0.5
"""A schedule that reaches less of a regulator's highest pressure is another gait."""


@dataclass(frozen=True, eq=False)
class Schedule:
    """Commands in time; the last one is zero and marks the end.

    Attributes:
        time_s: When each command is given, rising from 0 [s], (command,).
        pressure_kPa: Real pressures [kPa], (command, channel).
        volts: Command voltages [V], (command, channel).
    """

    time_s: np.ndarray
    pressure_kPa: np.ndarray
    volts: np.ndarray

    @property
    def duration_s(self) -> float:
        """When the last command vents [s]."""
        return float(self.time_s[-1])

    def place(self, time_s: float) -> int:
        """Number of the command that holds at a time."""
        return int(places(self.time_s, np.array([time_s]))[0])

    def lines(self) -> list[str]:
        """The schedule as text, a line a command."""
        channels = range(1, self.pressure_kPa.shape[1] + 1)
        head = "  time_s  " + "  ".join(f"{f'channel {n}':>20}" for n in channels)
        lines = [head]
        for time_s, pressures, volts in zip(
            self.time_s, self.pressure_kPa, self.volts, strict=True
        ):
            cells = "  ".join(
                f"{p:7.2f} kPa {v:6.3f} V" for p, v in zip(pressures, volts, strict=True)
            )
            lines.append(f"{time_s:8.2f}  {cells}")
        return lines


def places(due_s: np.ndarray, sent_s: np.ndarray, same_s: float = SAME_TIME_S) -> np.ndarray:
    """Numbers of the commands that hold at given times, (time,); -1 before the first.

    Args:
        due_s: When each command is due, rising [s], (command,).
        sent_s: The times [s], (time,).
        same_s: A command that is due so soon after a time holds already [s].
    """
    return np.searchsorted(due_s, sent_s + same_s, side="right") - 1


def count_skipped(sent: Iterable[int]) -> int:
    """How many commands were due before one that was sent, and were never sent.

    Args:
        sent: Places of those that were.
    """
    known = set(sent)
    return len(set(range(max(known, default=0))) - known)


def skipped_note(skipped: Mapping[str, int], due_count: int) -> str | None:
    """What to tell of trials that lack commands of their schedule; None where none does.

    Args:
        skipped: How many each trial lacks, by its name.
        due_count: How many its schedule has, without the last one, which vents.
    """
    told = ", ".join(f"{count} in {name}" for name, count in skipped.items() if count)
    if not told:
        return None
    return (
        f"commands of {SCHEDULE_FILE} were never sent ({told} of {due_count}): the rig took longer "
        "with the ones before than its update_interval_s, so the robot was driven with another "
        f"gait than {SCHEDULE_FILE}, by which it is simulated; a longer interval gives the rig time"
    )


def plan_schedule(gait: OpenLoopGait, rig: RigSettings) -> Schedule:
    """Plan the commands of a gait.

    A command is given when the gait's target differs from the last command, at least
    ``update_interval_s`` after it, and changes by at most ``rate_kPa_per_s`` times
    ``update_interval_s``, however long the last one has held. At the end everything is vented.

    Args:
        gait: The gait; it must command as many regulators as the rig has channels.
        rig: The rig.

    Raises:
        ValueError: Another number of regulators, a pressure beyond the gait's own limit or a
            channel's hard limits, a rig so slow that it would reach less than half of the gait's
            pressure, or a gait that is too short or too long to be stepped through.
    """
    if gait.regulator_count != len(rig.channels):
        raise ValueError(
            f"the gait commands {gait.regulator_count} regulators, the rig has "
            f"{len(rig.channels)} channels, expected the same number"
        )
    times, pressures = [0.0], [np.zeros(gait.regulator_count)]
    count = step_count(gait.duration_s, SEARCH_STEP_S)
    targets = sample_commands(gait, SEARCH_STEP_S, count)
    pressures[0] = _approached(pressures[0], targets[0], rig, rig.update_interval_s)
    for step in range(1, count):
        time_s = step * SEARCH_STEP_S
        waited = time_s - times[-1]
        if waited < rig.update_interval_s - SAME_TIME_S:
            continue
        if not np.array_equal(targets[step], pressures[-1]):
            times.append(time_s)
            pressures.append(_approached(pressures[-1], targets[step], rig, rig.update_interval_s))
    times.append(gait.duration_s)
    pressures.append(np.zeros(gait.regulator_count))
    _refuse_another_gait(np.max(targets, axis=0), np.max(pressures, axis=0), rig)
    volts = []
    for time_s, pressure in zip(times, pressures, strict=True):
        try:
            volts.append(rig.command_volts(pressure))
        except ValueError as error:
            raise ValueError(f"the gait's command at {time_s:g} s: {error}") from error
    return Schedule(np.array(times), np.array(pressures), np.array(volts))


def _refuse_another_gait(meant: np.ndarray, reached: np.ndarray, rig: RigSettings) -> None:
    """Refuse a schedule that falls so short of its gait that it is none any more.

    Args:
        meant: Highest pressure of each regulator in the gait [kPa], (channel,).
        reached: In the schedule [kPa], (channel,).
        rig: Its rate and interval.
    """
    for channel in np.flatnonzero(reached < LEAST_SHARE * meant):
        raise ValueError(
            f"channel {channel + 1} would reach {reached[channel]:.3g} kPa, the gait has "
            f"{meant[channel]:.3g} kPa, expected at least {LEAST_SHARE:.0%} of it: a command every "
            f"update_interval_s = {rig.update_interval_s:g} s that changes by no more than "
            f"rate_kPa_per_s = {rig.rate_kPa_per_s:g} kPa/s cannot follow; likely cause: the "
            "interval is too long or the rate too low, or the gait too fast for this rig"
        )


def _approached(
    last: np.ndarray, target: np.ndarray, rig: RigSettings, elapsed_s: float
) -> np.ndarray:
    most = rig.rate_kPa_per_s * elapsed_s
    return last + np.clip(target - last, -most, most)
