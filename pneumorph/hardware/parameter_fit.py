"""Modulus, friction and stiffness damping from measured trajectories, by a search and non-linear
least squares.

The simulated robot is driven with the pressures that were sensed, so the regulators take no part;
what differs between its path and the measured one is put down to the parameters. Residuals are
correlated from one instant to the next, more so along the way than across it, so intervals count
the effective number of samples of each coordinate (`pneumorph.hardware.confidence`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.hardware.confidence import Course, confidence
from pneumorph.hardware.trial import Trial

Parameters = dict[str, float]
"""Value by name: ``modulus_factor``, ``stiffness_damping_s``, ``friction``."""

PathSimulator = Callable[[Parameters, np.ndarray], np.ndarray]
"""Simulates a robot: parameters and real pressures (step, regulator) -> place of the marker [mm]
after every step, (step + 1, 2); NaN where the simulation failed."""

BOUNDS: dict[str, tuple[float, float]] = {
    "modulus_factor": (0.4, 2.5),
    "stiffness_damping_s": (0.01, 0.5),
    "friction": (0.2, 2.5),
}
"""Where a parameter is looked for."""

FAILED_MM = 200.0
"""Residual of a simulation that failed [mm]."""


@dataclass(frozen=True)
class ParameterFitSettings(Checked):
    """How modulus, friction and stiffness damping are fitted to the tracked paths of trials
    (--trials). After a search over all that is possible, non-linear least squares."""

    names: tuple[str, ...] = ()
    """Parameters to fit, of modulus_factor, stiffness_damping_s and friction; the others keep the
    simulation's values. By default all that the simulation has: measured silicone has no stiffness
    damping. Leave out one that the paths say nothing about."""
    samples_per_s: Positive = 10.0
    """Samples of each path that are compared [1/s]."""
    search_count: CountOrNone = 32
    """About how many simulations of each trial, for each of the parameters, search all that is
    possible first, since paths of legs that stick and slip fit almost as well in many places; 0:
    begin at the simulation's values."""
    step: Positive = 0.02
    """Relative step of the central differences that give derivatives. Much smaller steps fail,
    because contact makes the paths slightly irregular."""
    evaluation_limit: Count = 30
    """Largest number of times that least squares simulate all trials, without those for
    derivatives."""

    def __post_init__(self) -> None:
        super().__post_init__()
        unknown = set(self.names) - set(BOUNDS)
        if unknown:
            raise ValueError(f"names is {self.names}, expected some of {', '.join(BOUNDS)}")

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version, which tried values of one parameter after the other."""
        return {name: value for name, value in content.items() if name != "scan_count"}

    def resolved(self, start: Parameters) -> ParameterFitSettings:
        """The same with the parameters by name.

        Args:
            start: The simulation's values.

        Raises:
            ValueError: One that is asked for is zero there.
        """
        for name in self.names:
            if not start[name] > 0.0:
                raise ValueError(
                    f"names has {name}, which is {start[name]:g} in the simulation, expected "
                    "parameters that it has; leave it out of fit.names"
                )
        return replace(self, names=self.names or tuple(name for name in start if start[name] > 0.0))


@dataclass(frozen=True)
class ParameterFit:
    """What was found."""

    values: Parameters
    """Best parameters."""
    intervals: dict[str, tuple[float, float]]
    """95 % confidence interval of each."""
    r_squared: float
    """Share of the measured paths' variance that the simulation explains; none of what stood still
    is explained."""
    rms_mm: float
    """Root mean square distance of the paths [mm]."""
    start_rms_mm: float
    """The same before the fit [mm]."""
    effective_sample_count: float
    """Independent samples behind the interval that rests on the fewest."""
    simulation_count: int
    """Robots simulated."""
    converged: bool
    """Whether least squares ended by themselves."""


def fit_parameters(
    trials: Sequence[Trial],
    simulate: PathSimulator,
    start: Parameters,
    time_step_s: float,
    settings: ParameterFitSettings | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> ParameterFit:
    """Fit parameters to the paths of trials.

    Args:
        trials: Measured trials of one robot.
        simulate: Simulates that robot.
        start: Parameters to begin with.
        time_step_s: The simulation's time step [s].
        settings: What to fit and how.
        progress: Told how many simulations are done.

    Raises:
        ValueError: No trial, too few samples for the parameters, paths that do not change with one
            of them, or one that the simulation has not.
    """
    from scipy.optimize import least_squares

    settings = (settings or ParameterFitSettings()).resolved(start)
    problem = _Problem(trials, simulate, dict(start), time_step_s, settings, progress)
    first = problem.residual(problem.logarithms(start))
    low, high = np.log(np.array([BOUNDS[name] for name in settings.names])).T
    begin = problem.logarithms(start)
    if problem.search_count:
        found_at, cost = _searched(problem, low, high)
        if cost < first @ first:
            begin = found_at
    found = least_squares(
        problem.residual,
        np.clip(begin, low + 1e-6, high - 1e-6),
        # A relative step of the logarithm, as of `diff_step`, would be none at 1, whose log is 0.
        jac=problem.jacobian,
        bounds=(low, high),
        x_scale=0.1,
        xtol=1e-4,
        ftol=1e-5,
        gtol=1e-12,
        max_nfev=settings.evaluation_limit,
    )
    residual = found.fun
    known = confidence(problem.courses(found.x, residual))
    reach = known.reach
    unseen = [name for name, width in zip(settings.names, reach, strict=True) if width == math.inf]
    if unseen:
        raise ValueError(
            f"no path changes with {unseen[0]}, expected a parameter that matters: robots diverge, "
            "or every surface has a coefficient of its own (physics.friction_by_surface); leave it "
            "out of fit.names"
        )
    with np.errstate(over="ignore"):  # of what the paths hardly tell, the end may be infinite
        ends = np.exp(found.x + np.outer([-1.0, 1.0], reach))
    total = float(np.sum(problem.deviation**2))
    square_sum = float(residual @ residual)
    return ParameterFit(
        values={n: float(np.exp(x)) for n, x in zip(settings.names, found.x, strict=True)},
        intervals={
            n: (float(low), float(high))
            for n, (low, high) in zip(settings.names, ends.T, strict=True)
        },
        r_squared=1.0 - square_sum / total if total > 0.0 else -math.inf,
        rms_mm=float(np.sqrt(2.0 * square_sum / len(residual))),
        start_rms_mm=float(np.sqrt(2.0 * first @ first / len(first))),
        effective_sample_count=known.effective,
        simulation_count=problem.simulation_count,
        converged=bool(found.status > 0),
    )


class _Problem:
    """Residuals as a function of the logarithms of the parameters."""

    def __init__(
        self,
        trials: Sequence[Trial],
        simulate: PathSimulator,
        start: Parameters,
        time_step_s: float,
        settings: ParameterFitSettings,
        progress: Callable[[int, int, str], None] | None,
    ) -> None:
        if not trials:
            raise ValueError("trials is empty, expected at least one measured trial")
        self._simulate, self._start, self._settings = simulate, start, settings
        self._progress = progress
        self.simulation_count = 0
        self._cases = []
        deviation = []
        for trial in trials:
            end = trial.logged_s
            steps = int(end / time_step_s)
            driven = trial.driven_kPa(time_step_s * np.arange(steps))
            every = max(1, round(1.0 / (settings.samples_per_s * time_step_s)))
            chosen = np.arange(every, steps + 1, every)
            chosen = chosen[trial.track.seen(time_step_s * chosen)]
            if len(chosen) <= len(settings.names):
                raise ValueError(
                    f"{trial.name} lasts {end:g} s, of which its track tells {len(chosen)} "
                    f"samples: too few for {len(settings.names)} parameters"
                )
            measured = np.column_stack(
                [
                    np.interp(time_step_s * chosen, trial.track.time_s, x)
                    for x in trial.track.position_mm.T
                ]
            )
            self._cases.append((driven, chosen, measured))
            deviation.append((measured - measured.mean(axis=0)).ravel())
        self.deviation: np.ndarray = np.concatenate(deviation)

    @property
    def search_count(self) -> int:
        """Simulations of each trial before least squares."""
        return self._settings.search_count * len(self._settings.names)

    def logarithms(self, values: Parameters) -> np.ndarray:
        return np.log([values[name] for name in self._settings.names])

    def residual(self, logarithms: np.ndarray) -> np.ndarray:
        values = dict(self._start)
        values |= {
            n: float(np.exp(x)) for n, x in zip(self._settings.names, logarithms, strict=True)
        }
        parts = []
        for driven, chosen, measured in self._cases:
            path = self._simulate(values, driven)
            part = path[chosen] - measured
            sound = np.isfinite(part).all(axis=1)
            if sound.any():
                # Where it began is a single frame, whose error would be one of all samples.
                part = part - part[sound].mean(axis=0)
            parts.append(np.where(sound[:, None], part, FAILED_MM).ravel())
            self.simulation_count += 1
        if self._progress is not None:
            # How many least squares take is not known before; most end within the limit.
            searched = 3 * self.search_count // 2  # it ends with a whole division
            expected = (searched + 2 * self._settings.evaluation_limit) * len(self._cases)
            self._progress(min(self.simulation_count, expected - 1), expected, "fitting")
        return np.concatenate(parts)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Central differences, (residual, parameter)."""
        step = self._settings.step
        columns = []
        for place in range(len(x)):
            shift = np.zeros(len(x))
            shift[place] = step
            columns.append((self.residual(x + shift) - self.residual(x - shift)) / (2.0 * step))
        return np.column_stack(columns)

    def courses(self, x: np.ndarray, residual: np.ndarray) -> list[Course]:
        """Each trial's two coordinates, whose means were taken off."""
        ends = np.cumsum([2 * len(chosen) for _, chosen, _ in self._cases])[:-1]
        parts = zip(np.split(self.jacobian(x), ends), np.split(residual, ends), strict=True)
        return [
            Course(jacobian[place::2], left[place::2], mean_removed=True)
            for jacobian, left in parts
            for place in range(2)
        ]


def _searched(problem: _Problem, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, float]:
    """The best logarithms that a search finds which divides the space between the bounds, and their
    squares (DIRECT; Jones, Perttunen and Stuckman 1993, J. Optim. Theory Appl. 79:157)."""
    from scipy.optimize import direct

    def squares(logarithms: np.ndarray) -> float:
        residual = problem.residual(logarithms)
        return float(residual @ residual)

    bounds = list(zip(low, high, strict=True))
    found = direct(squares, bounds, maxfun=problem.search_count, locally_biased=False)
    return found.x, float(found.fun)
