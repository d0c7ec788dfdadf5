"""Trials on a rig beside the simulation: reward per step, backsliding, spread, transfer ratio."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.walk import cycle_slides, step_rewards
from pneumorph.hardware.trial import Trial
from pneumorph.trajectory import Trajectory

LEAST_SIMULATED = {"cm": 0.1, "degrees": 1.0}
"""What a simulation must achieve for a ratio to it, by unit: a marker is seen to some 0.2 mm, and a
turn to a degree or so."""


@dataclass(frozen=True, eq=False)
class ComparedPath:
    """What of a goal one robot achieves, simulated and measured. Axes: time, trial, step.

    Attributes:
        goal: What is achieved; its unit is that of all below.
        time_s: Instants at which paths are compared [s], (time,).
        simulated: What the simulation has achieved, (time,).
        measured: The same of each trial, (trial, time).
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].
        simulated_whole: Whether the simulation came to its end; where not there is no ratio.
    """

    goal: Goal
    time_s: np.ndarray
    simulated: np.ndarray
    measured: np.ndarray
    step_s: float
    cycle_s: float
    simulated_whole: bool = True

    @property
    def simulated_end(self) -> float:
        """What the simulation achieved."""
        return float(self.simulated[-1])

    @property
    def ends(self) -> np.ndarray:
        """What each trial achieved, (trial,)."""
        return self.measured[:, -1]

    @property
    def mean(self) -> float:
        """Mean over trials."""
        return float(np.mean(self.ends))

    @property
    def spread(self) -> float | None:
        """Standard deviation over trials; None for a single one."""
        return float(np.std(self.ends, ddof=1)) if len(self.ends) > 1 else None

    @property
    def transfer_ratio(self) -> float | None:
        """Measured over simulated; None where the simulation fails or achieves next to nothing, to
        which noise alone has a ratio."""
        if not self.simulated_whole or abs(self.simulated_end) < LEAST_SIMULATED[self.goal.unit]:
            return None
        return self.mean / self.simulated_end

    def step_rewards(self) -> tuple[np.ndarray, np.ndarray]:
        """What is achieved in each step: by the simulation (step,), by each trial (trial, step)."""
        simulated = step_rewards(self.time_s, self.simulated, self.step_s)
        return simulated, step_rewards(self.time_s, self.measured.T, self.step_s).T

    def backsliding(self) -> tuple[float, np.ndarray]:
        """Mean slide back per cycle: of the simulation, and of each trial (trial,)."""
        cycle_s = min(self.cycle_s, float(self.time_s[-1]))
        simulated = cycle_slides(self.time_s, self.simulated, cycle_s)
        measured = cycle_slides(self.time_s, self.measured.T, cycle_s)
        return float(simulated.mean()), measured.mean(axis=0)

    @property
    def rms(self) -> float:
        """Root mean square difference of the simulation and the trials' mean path."""
        return float(np.sqrt(np.mean((self.measured.mean(axis=0) - self.simulated) ** 2)))


@dataclass(frozen=True, eq=False)
class TrialComparison:
    """One robot, simulated and measured.

    Attributes:
        label: Its name.
        design: Its design.
        distance: Its travel forward.
        counted: What counts of its motion; the travel again where that is the distance.
        simulated_turned_deg: How far the simulation turned to the left [degrees].
        turned_deg: The same of the trials whose tracks tell [degrees].
    """

    label: str
    design: str
    distance: ComparedPath
    counted: ComparedPath
    simulated_turned_deg: float
    turned_deg: tuple[float, ...]

    def summary(self) -> dict[str, Any]:
        """Everything as numbers, for a summary."""
        distance, counted = self.distance, self.counted
        simulated_cm, measured_cm = distance.step_rewards()
        simulated_slide_cm, measured_slides_cm = distance.backsliding()
        simulated_steps, measured_steps = counted.step_rewards()
        return {
            "label": self.label,
            "design": self.design,
            "simulated_distance_cm": distance.simulated_end,
            "distances_cm": distance.ends.tolist(),
            "mean_distance_cm": distance.mean,
            "spread_cm": distance.spread,
            "transfer_ratio": counted.transfer_ratio,
            "simulated_reward_per_step_cm": simulated_cm.tolist(),
            "mean_reward_per_step_cm": measured_cm.mean(axis=0).tolist(),
            "simulated_backsliding_cm": simulated_slide_cm,
            "mean_backsliding_cm": float(measured_slides_cm.mean()),
            "path_rms_cm": distance.rms,
            "simulated_turned_deg": self.simulated_turned_deg,
            "mean_turned_deg": float(np.mean(self.turned_deg)) if self.turned_deg else None,
            "simulated_achieved": counted.simulated_end,
            "achieved": counted.ends.tolist(),
            "mean_achieved": counted.mean,
            "achieved_spread": counted.spread,
            "simulated_step_rewards": simulated_steps.tolist(),
            "mean_step_rewards": measured_steps.mean(axis=0).tolist(),
        }


def compare_trials(
    label: str,
    design: str,
    simulated: Trajectory,
    trials: Sequence[Trial],
    goal: Goal = FORWARD,
    step_s: float = 1.0,
    cycle_s: float = 4.0,
    sample_s: float = 0.05,
) -> TrialComparison:
    """Put a simulated path and measured trials on common instants.

    Args:
        label: Name of the robot.
        design: Its design.
        simulated: The simulation.
        trials: The trials.
        goal: What counts of the motion.
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].
        sample_s: Distance of the instants [s].

    Raises:
        ValueError: No trial, paths shorter than one step, or a goal that a track does not tell of.
    """
    end = check_length(label, float(simulated.time_s[-1]), trials, step_s, sample_s)
    time_s = np.linspace(0.0, end, round(end / sample_s) + 1)

    def compared(what: Goal) -> ComparedPath:
        measured = [trial.track.along(what, time_s) for trial in trials]
        told = [each for each in measured if each is not None]
        if len(told) < len(measured):
            silent = ", ".join(t.name for t, m in zip(trials, measured, strict=True) if m is None)
            raise ValueError(
                f"{label}: the tracks of {silent} do not tell how far the robot turned, expected a "
                "second marker in front of the first, or a column turned_deg"
            )
        ours = np.interp(time_s, simulated.time_s, what.along(simulated))
        whole = simulated.status == "completed"
        return ComparedPath(what, time_s, ours, np.array(told), step_s, cycle_s, whole)

    turned = [trial.track.achieved(Goal("turn_left"), end) for trial in trials]
    distance = compared(FORWARD)
    return TrialComparison(
        label,
        design,
        distance,
        distance if goal.is_forward else compared(goal),
        float(np.interp(end, simulated.time_s, simulated.turned_deg)),
        tuple(each for each in turned if each is not None),
    )


def check_length(
    label: str,
    simulated_s: float,
    trials: Sequence[Trial],
    step_s: float,
    sample_s: float = 0.05,
) -> float:
    """How much simulation and trials have in common [s].

    Args:
        label: Name of the robot.
        simulated_s: Length of the simulation [s].
        trials: The trials.
        step_s: Length of a step, over which a reward is counted [s].
        sample_s: A camera's last frame lies up to so much before the end [s].

    Raises:
        ValueError: No trial, or less than one step.
    """
    if not trials:
        raise ValueError(f"{label} has no trials, expected at least one")
    shortest = min(trials, key=lambda trial: trial.end_s)
    common_s = min(simulated_s, shortest.end_s + sample_s)
    if common_s < step_s:
        raise ValueError(
            f"{label}: simulation and trials have {common_s:g} s in common, expected at least one "
            f"step of {step_s:g} s; the shortest trial is {shortest.name}, whose log and track "
            f"tell of {shortest.end_s:g} s of the gait: it may have been stopped or cut off, or "
            "times of its track do not count from the gait's start"
        )
    return common_s


def pressure_tracking(
    trial: Trial, regulators: Collection[int] | None = None, until_s: float = np.inf
) -> dict[str, float | None]:
    """How well sensed pressures follow commanded ones.

    Args:
        trial: The trial.
        regulators: Numbers of those that count, from 1; None for all. One without a leg has
            nothing but its sensor's noise.
        until_s: Samples later than this do not count, such as those of venting [s].

    Returns:
        Root mean square difference [kPa], and the delay [s] that makes it least (of whole samples
        up to one second); None without sensors, or with fewer than two samples.
    """
    log = trial.pressures
    known = np.isfinite(log.sensed_kPa) & (log.time_s <= until_s)[:, None]
    if regulators is not None:
        channels = 1 + np.arange(known.shape[1])
        known &= np.isin(channels, list(regulators))
    if known.sum() < 2 or len(log.time_s) < 2:
        return {"rms_kPa": None, "delay_s": None}
    difference = (log.sensed_kPa - log.commanded_kPa)[known]
    step = float(np.median(np.diff(log.time_s)))
    delays = np.arange(0.0, 1.0, max(step, 1e-3))
    given_s, given_kPa = log.given
    errors = []
    for delay in delays:
        place = np.searchsorted(given_s, log.time_s - delay + 1e-9, side="right") - 1
        delayed = np.where((place >= 0)[:, None], given_kPa[np.maximum(place, 0)], 0.0)
        errors.append(float(np.mean((log.sensed_kPa - delayed)[known] ** 2)))
    return {
        "rms_kPa": float(np.sqrt(np.mean(difference**2))),
        "delay_s": float(delays[int(np.argmin(errors))]),
    }
