"""The conductances of each regulator from logs of commanded and sensed pressure.

Between two samples a regulator goes along its curve towards the command that held, so a log is
simulated exactly but for the noise of its sensor. Filling and venting conductance are found by
non-linear least squares, for one regulator after the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.hardware.confidence import Course, confidence
from pneumorph.hardware.deployment_log import COMMAND, LoggedPressures
from pneumorph.physics.air import Air
from pneumorph.physics.regulators import AirRegulators, air_regulators

NAMES = ("filling_mm3_per_s_kPa", "venting_mm3_per_s_kPa")

LEAST_STEP_KPA = 10.0
"""A log in which a command never rises, or never falls, by this much in all tells nothing."""

WIDEST = 2.0
"""A conductance whose interval reaches beyond this factor on either side is not known."""

SCANNED = np.geomspace(0.02, 50.0, 18)
"""Factors on the conductances that the search begins with which are tried first."""

STEP = 1e-3
"""Relative step of the derivatives."""


@dataclass(frozen=True)
class AirFit:
    """What was found; regulators that no leg hangs on keep what they had."""

    air: Air
    """With the fitted conductances of each regulator."""
    intervals: dict[str, tuple[float, float]]
    """95 % confidence interval of each that was fitted, such as ``filling_1_mm3_per_s_kPa``."""
    rms_kPa: float
    """Root mean square of what the fit leaves of the sensed pressures [kPa]."""
    sample_count: int
    """Samples that were fitted to."""


def fit_air(logs: Sequence[LoggedPressures], air: Air, chambers_mm3: Sequence[float]) -> AirFit:
    """Fit the conductances of every regulator that feeds legs.

    Args:
        logs: Of trials of one robot on one rig.
        air: What is known: supply, critical ratio, volumes; its conductances begin the search.
        chambers_mm3: Volume of all chambers of each regulator without pressure [mm^3].

    Raises:
        ValueError: No log, other regulators than channels, a channel without a sensor, or a log
            that cannot tell.
    """
    if not logs:
        raise ValueError("logs is empty, expected that of at least one trial")
    count = logs[0].sensed_kPa.shape[1]
    if count != len(chambers_mm3):
        raise ValueError(
            f"the logs have {count} channels, the robot {len(chambers_mm3)} regulators, expected "
            "the same number"
        )
    conductances = {name: list(air.of_each(name, count)) for name in NAMES}
    intervals, residuals = {}, []
    for channel in (i for i, chamber in enumerate(chambers_mm3) if chamber > 0.0):
        problem = _Problem(logs, channel, air, float(chambers_mm3[channel]))
        start = np.log([conductances[name][channel] for name in NAMES])
        found, reach, residual = _minimum(problem, start)
        residuals.append(residual)
        for name, x, r in zip(NAMES, found, reach, strict=True):
            conductances[name][channel] = math.exp(x)
            kind = name.split("_")[0]
            intervals[f"{kind}_{channel + 1}_mm3_per_s_kPa"] = (math.exp(x - r), math.exp(x + r))
    left = np.concatenate(residuals)
    return AirFit(
        replace(
            air,
            law="orifice",
            filling_mm3_per_s_kPa=tuple(conductances[NAMES[0]]),
            venting_mm3_per_s_kPa=tuple(conductances[NAMES[1]]),
        ),
        intervals,
        float(np.sqrt(np.mean(left**2))),
        len(left),
    )


def simulated_kPa(log: LoggedPressures, channel: int, air: Air, chamber_mm3: float) -> np.ndarray:
    """Pressure of one regulator at each sample of a log, from its first on [real kPa], (sample,).

    Args:
        log: Its commands.
        channel: Which regulator, counted from 0.
        air: Its air; conductances of each regulator.
        chamber_mm3: Volume of its chambers without pressure [mm^3].
    """
    count = log.sensed_kPa.shape[1]
    own = replace(
        air,
        filling_mm3_per_s_kPa=(air.of_each(NAMES[0], count)[channel],),
        venting_mm3_per_s_kPa=(air.of_each(NAMES[1], count)[channel],),
    )
    return _course(log, channel, air_regulators(own, [chamber_mm3]))


def _course(log: LoggedPressures, channel: int, regulator: AirRegulators) -> np.ndarray:
    commanded = log.commanded_kPa[:, channel]
    given_s = np.array([time_s for time_s, event in log.events if event == COMMAND])
    pressure = np.array([max(float(log.sensed_kPa[0, channel]), 0.0)])
    course = [pressure[0]]
    for number in range(1, len(commanded)):
        start_s, end_s = log.time_s[number - 1 : number + 1]
        before, after = commanded[number - 1 : number + 1]
        # The last command since the sample before; one that nobody noted came with the sample.
        within = given_s[(given_s > start_s) & (given_s <= end_s)]
        change_s = end_s if before == after or len(within) == 0 else within[-1]
        pressure = regulator.after(pressure, np.array([before]), change_s - start_s)
        pressure = regulator.after(pressure, np.array([after]), end_s - change_s)
        course.append(pressure[0])
    return np.array(course)


class _Problem:
    """Residuals of one channel as a function of the logarithms of its two conductances."""

    def __init__(
        self, logs: Sequence[LoggedPressures], channel: int, air: Air, chamber_mm3: float
    ) -> None:
        self.name = f"regulator {channel + 1}"
        self._logs, self._channel = logs, channel
        self._air, self._chamber_mm3 = air, chamber_mm3
        for log in logs:
            if len(log.time_s) == 0 or not np.all(np.isfinite(log.sensed_kPa[:, channel])):
                raise ValueError(
                    f"{self.name} has no sensed pressure in some sample, expected one in each: "
                    "its air cannot be identified without a sensor"
                )
        changes = np.concatenate([np.diff(log.commanded_kPa[:, channel]) for log in logs])
        for sign, what, lacks in ((1.0, "rises", "filling"), (-1.0, "falls", "venting")):
            moved = float(np.sum(np.maximum(sign * changes, 0.0)))
            if moved < LEAST_STEP_KPA:
                raise ValueError(
                    f"the command of {self.name} {what} by {moved:.3g} kPa in all, expected at "
                    f"least {LEAST_STEP_KPA:g} kPa: the log shows no {lacks}; deploy a gait with "
                    "steps up and down on every regulator"
                )

    def residuals(self, logarithms: np.ndarray) -> list[np.ndarray]:
        """What is simulated over what was sensed, of each log [kPa]."""
        filling, venting = np.exp(logarithms)
        own = replace(
            self._air,
            filling_mm3_per_s_kPa=(float(filling),),
            venting_mm3_per_s_kPa=(float(venting),),
        )
        regulator = air_regulators(own, [self._chamber_mm3])
        return [
            (_course(log, self._channel, regulator) - log.sensed_kPa[:, self._channel])[1:]
            for log in self._logs
        ]

    def residual(self, logarithms: np.ndarray) -> np.ndarray:
        return np.concatenate(self.residuals(logarithms))

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Central differences, (sample, parameter)."""
        shifts = STEP * np.eye(len(x))
        return np.column_stack(
            [(self.residual(x + s) - self.residual(x - s)) / (2.0 * STEP) for s in shifts]
        )


def _minimum(problem: _Problem, start: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the residuals are least, the reach of the intervals there, and the residuals.

    Raises:
        ValueError: The log cannot tell one of the conductances.
    """
    from scipy.optimize import least_squares

    best = np.array(start)
    for place in range(len(best)):
        tried = np.tile(best, (len(SCANNED), 1))
        tried[:, place] = start[place] + np.log(SCANNED)
        best = min(tried, key=lambda x: float(np.sum(problem.residual(x) ** 2)))
    reach_of_search = math.log(10.0 * float(SCANNED[-1]))
    found = least_squares(
        problem.residual,
        best,
        jac=problem.jacobian,
        bounds=(start - reach_of_search, start + reach_of_search),
        x_scale=0.1,
        xtol=1e-8,
        max_nfev=60,
    )
    left = problem.residuals(found.x)
    ends = np.cumsum([len(each) for each in left])[:-1]
    jacobians = np.split(problem.jacobian(found.x), ends)
    reach = confidence([*map(Course, jacobians, left)]).reach
    for name, width in zip(NAMES, reach, strict=True):
        if not width < math.log(WIDEST):
            kind = name.split("_")[0]
            raise ValueError(
                f"the log cannot tell how fast {problem.name} is at {kind}: its conductance is "
                f"only known to a factor of {math.exp(min(width, 20.0)):.3g}, expected less than "
                f"{WIDEST:g}; it may be at its command in almost every sample, so sample more "
                "often (sample_interval_s) or command larger steps"
            )
    return found.x, reach, np.asarray(found.fun)
