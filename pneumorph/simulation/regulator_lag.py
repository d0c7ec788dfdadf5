"""Commands as regulators that lag pass them on.

A first-order filter, as each robot's world has it, acts before the regulators' rate limit or air:
after a time t of one command c the filtered one is c + (c_0 - c) exp(-t / lag). For a few time
steps at a time its mean over them is passed on, so that commands come as late as they should.

These steps are counted from each robot's own change of command, so what a robot gets depends on its
commands alone: not on its neighbours', nor on how often somebody looks.
"""

from __future__ import annotations

import numpy as np

LAG_STEPS = 5
"""A lagging command is renewed after this many time steps, and held at its mean over them."""


class RegulatorLag:
    """The filter of robots side by side.

    Where a command does not last for so many steps, the next one is taken to last no longer: of one
    that changes in every step the mean is over one.

    Args:
        lag_s: Time constant of each robot [s], (robot,); 0 for none.
        regulator_count: Regulators of each.
        time_step_s: Time step [s].
    """

    def __init__(self, lag_s: np.ndarray, regulator_count: int, time_step_s: float) -> None:
        self._lag_s, self._time_step_s = np.asarray(lag_s, dtype=float)[:, None], time_step_s
        robots = len(self._lag_s)
        self._filtered, self._command = np.zeros((2, robots, regulator_count))
        self._passed = np.zeros(robots, dtype=np.int64)
        """Steps since the command was renewed."""
        self._planned = np.full(robots, LAG_STEPS)
        """Steps for which it was."""

    def reset(self, chosen: np.ndarray) -> None:
        """Let robots begin without pressure, (robot,) bool."""
        self._filtered[chosen] = self._command[chosen] = 0.0
        self._passed[chosen], self._planned[chosen] = 0, LAG_STEPS

    def ask(self, command_kPa: np.ndarray, moving: np.ndarray) -> None:
        """Take the command of the next steps.

        Args:
            command_kPa: (robot, regulator).
            moving: The robots that it is for, (robot,) bool.
        """
        changed = moving & (command_kPa != self._command).any(axis=1)
        cut = changed & (self._passed > 0)
        ended = changed | (moving & (self._passed >= self._planned))
        self._filtered = np.where(ended[:, None], self._now(), self._filtered)
        self._command = np.where(changed[:, None], command_kPa, self._command)
        self._planned = np.where(ended, np.where(cut, self._passed, LAG_STEPS), self._planned)
        self._passed = np.where(ended, 0, self._passed)

    def held_kPa(self) -> np.ndarray:
        """What is passed on until the command is renewed, (robot, regulator)."""
        time_s = self._planned[:, None] * self._time_step_s
        kept = self._kept(time_s)
        mean = (1.0 - kept) * self._lag_s / time_s
        held: np.ndarray = self._command + (self._filtered - self._command) * mean
        return held

    def steps_left(self, moving: np.ndarray) -> int:
        """For how many steps that holds, of the robots that move, (robot,) bool; of others as many
        as ever."""
        lagging = moving & (self._lag_s[:, 0] > 0.0)
        left = (self._planned - self._passed)[lagging]
        return int(left.min(initial=np.iinfo(np.int32).max))

    def go_on(self, step_count: int, moving: np.ndarray) -> None:
        """Let steps pass, no more than are left, (robot,) bool."""
        self._passed = np.where(moving, self._passed + step_count, self._passed)

    def _now(self) -> np.ndarray:
        """The filtered command after the steps that have passed, (robot, regulator)."""
        kept = self._kept(self._passed[:, None] * self._time_step_s)
        now: np.ndarray = self._command + (self._filtered - self._command) * kept
        return now

    def _kept(self, time_s: np.ndarray) -> np.ndarray:
        """Which share of its distance to a command the filter still has after times, exp(-t / lag):
        without a lag nothing, but all where no time has passed."""
        with np.errstate(divide="ignore", invalid="ignore"):
            kept = np.exp(-time_s / self._lag_s)
        return np.where(time_s > 0.0, kept, 1.0)


def lagging_commands(commands_kPa: np.ndarray, lag_s: float, time_step_s: float) -> np.ndarray:
    """Commands of a whole gait as `RegulatorLag` passes them on [kPa], (step, regulator).

    Args:
        commands_kPa: Of the gait [kPa], (step, regulator).
        lag_s: Time constant [s]; 0 for none.
        time_step_s: Time step [s].
    """
    if lag_s == 0.0:
        return commands_kPa
    lag = RegulatorLag(np.array([lag_s]), commands_kPa.shape[1], time_step_s)
    moving, lagging = np.ones(1, dtype=bool), np.empty_like(commands_kPa, dtype=float)
    changes = np.flatnonzero((commands_kPa[1:] != commands_kPa[:-1]).any(axis=1)) + 1
    ends = [*changes.tolist(), len(commands_kPa)]
    begin = 0
    for end in ends:
        while begin < end:
            lag.ask(commands_kPa[begin : begin + 1], moving)
            count = min(lag.steps_left(moving), end - begin)
            lagging[begin : begin + count] = lag.held_kPa()
            lag.go_on(count, moving)
            begin += count
    return lagging
