"""Drive a batch of robots, each with its own gait, and note how far they get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.environment.crawling_simulator import (
    RUNNING,
    CrawlingSimulator,
    LeaningSimulator,
    RangedSimulator,
    TurningSimulator,
)
from pneumorph.environment.goal import Goal, turn_between
from pneumorph.environment.reward import MILLIMETRES_PER_CENTIMETRE
from pneumorph.physics.open_loop_gait import OpenLoopGait, sample_commands, step_count


@dataclass(frozen=True, eq=False)
class Walk:
    """Travel of a batch of robots.

    Attributes:
        time_s: Recorded times from the start of the gait [s], shape (record,); the first is 0.
        forward_cm: Travel since then [cm], shape (record, robot); NaN once a simulation failed.
        status: Status of each robot at the end, shape (robot,) uint8.
        range_ratio: How far any leg of each robot went, once it had settled, relative to the
            furthest snapshot it was reduced from, shape (robot,); NaN where that is not known.
        left_cm: Travel to the left [cm], shape (record, robot); None where the simulator does not
            know it.
        turned_deg: Turn to the left, whole circles counted [degrees], likewise.
        lean_deg: How far each hub leaned at most, of the recorded times [degrees], shape (robot,);
            None likewise.
    """

    time_s: np.ndarray
    forward_cm: np.ndarray
    status: np.ndarray
    range_ratio: np.ndarray
    left_cm: np.ndarray | None = None
    turned_deg: np.ndarray | None = None
    lean_deg: np.ndarray | None = None

    @property
    def distance_cm(self) -> np.ndarray:
        """Travel of the whole walk [cm], shape (robot,); NaN where the simulation failed."""
        return np.where(self.status == RUNNING, self.forward_cm[-1], np.nan)

    def achieved(self, goal: Goal) -> np.ndarray:
        """What of a goal the whole walk achieved [its unit], shape (robot,); NaN as above.

        Raises:
            ValueError: The simulator does not know it.
        """
        way = goal.of(self.forward_cm, self.left_cm, self.turned_deg)
        return np.where(self.status == RUNNING, way[-1], np.nan)

    def backsliding_cm(self, period_s: float) -> np.ndarray:
        """Mean over whole cycles of the furthest slide back within a cycle [cm], shape (robot,).

        The slide back of a cycle is ``max over t1 < t2 of x(t1) - x(t2)``, which does not depend
        on how densely the path is recorded; the paper calls it backward displacement per step.

        Raises:
            ValueError: The walk is shorter than one period.
        """
        return cycle_slides(self.time_s, self.forward_cm, period_s).mean(axis=0)


def step_rewards(time_s: np.ndarray, way: np.ndarray, step_s: float) -> np.ndarray:
    """What is achieved in each whole step, (step, ...).

    Args:
        time_s: When [s], (time,).
        way: What is achieved until then, such as forward travel, (time, ...).
        step_s: Length of a step [s].

    Raises:
        ValueError: The walk is shorter than one step.
    """
    edges = step_s * np.arange(_whole_parts(time_s, step_s) + 1)
    paths = way.reshape(len(time_s), -1).T
    at = np.stack([np.interp(edges, time_s, path) for path in paths], axis=-1)
    return np.diff(at, axis=0).reshape(-1, *way.shape[1:])


def cycle_slides(time_s: np.ndarray, way: np.ndarray, cycle_s: float) -> np.ndarray:
    """Furthest slide back within each whole cycle, (cycle, ...); arguments as above.

    Raises:
        ValueError: The walk is shorter than one cycle.
    """
    slides = []
    for cycle in range(_whole_parts(time_s, cycle_s)):
        inside = (time_s >= cycle * cycle_s - 1e-6) & (time_s <= (cycle + 1) * cycle_s + 1e-6)
        path = way[inside]
        slides.append(np.max(np.maximum.accumulate(path, axis=0) - path, axis=0))
    return np.array(slides)


def last_cycle(time_s: np.ndarray, cycle_s: float) -> tuple[float, np.ndarray]:
    """Begin of the last whole cycle [s], and which times (time,) are in it; arguments as above.

    Raises:
        ValueError: The walk is shorter than one cycle.
    """
    begin_s = (_whole_parts(time_s, cycle_s) - 1) * cycle_s
    return begin_s, (time_s >= begin_s - 1e-6) & (time_s <= begin_s + cycle_s + 1e-6)


def _whole_parts(time_s: np.ndarray, part_s: float) -> int:
    count = int(np.floor(time_s[-1] / part_s + 1e-6))
    if count < 1:
        raise ValueError(
            f"the walk lasts {time_s[-1]:g} s, expected at least one period of {part_s:g} s"
        )
    apart_s = float(np.max(np.diff(time_s)))
    if part_s < apart_s * (1.0 - 1e-6):
        raise ValueError(
            f"the period is {part_s:g} s, expected at least the {apart_s:g} s from one recorded "
            "place of the walk to the next"
        )
    return count


def walk(
    simulator: CrawlingSimulator,
    gaits: Sequence[OpenLoopGait],
    *,
    duration_s: float,
    time_step_s: float,
    settling_step_count: int = 15,
    record_step_count: int = 3,
    progress: ProgressReport | None = None,
) -> Walk:
    """Reset a simulator, let its robots settle, and drive each with its gait.

    Args:
        simulator: As many robots as there are gaits.
        gaits: One gait per robot, all for the same number of regulators.
        duration_s: How long to walk [s].
        time_step_s: The simulator's time step [s].
        settling_step_count: Steps at zero pressure at the start.
        record_step_count: Steps between recorded places.
        progress: Told how far the walk is.

    Raises:
        ValueError: No gait, gaits of different numbers of regulators, or no step to walk.
    """
    regulators = {gait.regulator_count for gait in gaits}
    if len(regulators) != 1:
        raise ValueError(
            f"gaits command {sorted(regulators)} regulators, expected the same number for all"
        )
    steps = step_count(duration_s, time_step_s)
    commands = np.stack([sample_commands(gait, time_step_s, steps) for gait in gaits], axis=1)
    simulator.reset()
    simulator.advance(np.zeros_like(commands[0]), settling_step_count)
    ranged = simulator if isinstance(simulator, RangedSimulator) else None
    if ranged is not None:
        ranged.forget_range()
    start_mm = np.array(simulator.forward_position_mm)
    time_s, forward_mm = [0.0], [np.zeros(len(gaits))]
    aside = _Aside(simulator) if isinstance(simulator, TurningSimulator) else None
    leaning = simulator if isinstance(simulator, LeaningSimulator) else None
    lean_deg = None if leaning is None else np.zeros(len(gaits))
    for begin, end in _held_spans(commands, record_step_count):
        simulator.advance(commands[begin], end - begin)
        if end % record_step_count == 0 or end == steps:
            time_s.append(end * time_step_s)
            running = simulator.status == RUNNING
            forward_mm.append(np.where(running, simulator.forward_position_mm - start_mm, np.nan))
            if aside is not None:
                aside.record(running)
            if leaning is not None and lean_deg is not None:
                lean_deg = np.where(running, np.maximum(lean_deg, leaning.tilt_deg), lean_deg)
            if progress is not None:
                progress(end, steps, "walking")
    return Walk(
        np.array(time_s),
        np.array(forward_mm) / MILLIMETRES_PER_CENTIMETRE,
        np.array(simulator.status, dtype=np.uint8),
        np.full(len(gaits), np.nan) if ranged is None else ranged.range_ratio,
        None if aside is None else np.array(aside.left_mm) / MILLIMETRES_PER_CENTIMETRE,
        None if aside is None else np.array(aside.turned_deg),
        lean_deg,
    )


class _Aside:
    """What robots do besides going forward, from record to record.

    Attributes:
        left_mm: Travel to the left [mm], of each record (robot,).
        turned_deg: Turn to the left, whole circles counted [degrees], likewise.
    """

    def __init__(self, simulator: TurningSimulator) -> None:
        self._simulator = simulator
        self._start_mm = np.array(simulator.left_position_mm)
        self._heading_deg = np.array(simulator.heading_deg)
        self._turn_deg = np.zeros(len(self._start_mm))
        self.left_mm, self.turned_deg = [self._turn_deg], [self._turn_deg]

    def record(self, running: np.ndarray) -> None:
        """Note where robots are; of two directions the turn is less than half a circle. One that is
        tipped over faces where it did; one that starts so, where it first faces."""
        seen_deg = self._simulator.heading_deg
        heading_deg = np.where(running & np.isfinite(seen_deg), seen_deg, self._heading_deg)
        turn_deg = turn_between(self._heading_deg, heading_deg)
        self._turn_deg = self._turn_deg + np.nan_to_num(turn_deg)
        self._heading_deg = heading_deg
        travel_mm = self._simulator.left_position_mm - self._start_mm
        self.left_mm.append(np.where(running, travel_mm, np.nan))
        self.turned_deg.append(np.where(running, self._turn_deg, np.nan))


def _held_spans(commands: np.ndarray, record_step_count: int) -> list[tuple[int, int]]:
    """Spans of steps in which no command changes and nothing is to be recorded before the end."""
    step_count = len(commands)
    changes = np.flatnonzero((commands[1:] != commands[:-1]).any(axis=(1, 2))) + 1
    bounds = np.union1d(changes, np.arange(0, step_count, record_step_count))
    bounds = np.union1d(bounds, [0, step_count]).astype(int)
    return [(int(begin), int(end)) for begin, end in pairwise(bounds)]
