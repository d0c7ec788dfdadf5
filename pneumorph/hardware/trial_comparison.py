"""Trials on a rig beside the simulation: reward per step, backsliding, spread, transfer ratio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.environment.goal import Goal
from pneumorph.gait.walk import cycle_slides, step_rewards
from pneumorph.hardware.trial import Trial


@dataclass(frozen=True, eq=False)
class TrialComparison:
    """One robot, simulated and measured. Axes: time, trial, step.

    Attributes:
        label: Its name.
        design: Its design.
        time_s: Instants at which paths are compared [s], (time,).
        simulated_cm: Forward travel of the simulation [cm], (time,).
        measured_cm: Forward travel of each trial [cm], (trial, time).
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].
        simulated_turned_deg: How far the simulation turned to the left [degrees]; None where that
            is not known.
        turned_deg: The same of the trials whose tracks tell [degrees].
    """

    label: str
    design: str
    time_s: np.ndarray
    simulated_cm: np.ndarray
    measured_cm: np.ndarray
    step_s: float
    cycle_s: float
    simulated_turned_deg: float | None = None
    turned_deg: tuple[float, ...] = ()

    @property
    def simulated_distance_cm(self) -> float:
        """Travel of the simulation [cm]."""
        return float(self.simulated_cm[-1])

    @property
    def distances_cm(self) -> np.ndarray:
        """Travel of each trial [cm], (trial,)."""
        return self.measured_cm[:, -1]

    @property
    def mean_distance_cm(self) -> float:
        """Mean over trials [cm]."""
        return float(np.mean(self.distances_cm))

    @property
    def spread_cm(self) -> float | None:
        """Standard deviation over trials [cm]; None for a single one."""
        return float(np.std(self.distances_cm, ddof=1)) if len(self.distances_cm) > 1 else None

    @property
    def transfer_ratio(self) -> float | None:
        """Measured over simulated distance; None where the simulation goes nowhere."""
        if abs(self.simulated_distance_cm) < 1e-6:
            return None
        return self.mean_distance_cm / self.simulated_distance_cm

    def rewards_per_step_cm(self) -> tuple[np.ndarray, np.ndarray]:
        """Travel in each step: of the simulation (step,), and of each trial (trial, step) [cm]."""
        simulated = step_rewards(self.time_s, self.simulated_cm, self.step_s)
        return simulated, step_rewards(self.time_s, self.measured_cm.T, self.step_s).T

    def backsliding_cm(self) -> tuple[float, np.ndarray]:
        """Mean slide back per cycle: of the simulation, and of each trial (trial,) [cm]."""
        cycle_s = min(self.cycle_s, float(self.time_s[-1]))
        simulated = cycle_slides(self.time_s, self.simulated_cm, cycle_s)
        measured = cycle_slides(self.time_s, self.measured_cm.T, cycle_s)
        return float(simulated.mean()), measured.mean(axis=0)

    def summary(self) -> dict[str, Any]:
        """Everything as numbers, for a summary."""
        simulated_steps, measured_steps = self.rewards_per_step_cm()
        simulated_slide, measured_slides = self.backsliding_cm()
        difference = self.measured_cm.mean(axis=0) - self.simulated_cm
        return {
            "label": self.label,
            "design": self.design,
            "simulated_distance_cm": self.simulated_distance_cm,
            "distances_cm": self.distances_cm.tolist(),
            "mean_distance_cm": self.mean_distance_cm,
            "spread_cm": self.spread_cm,
            "transfer_ratio": self.transfer_ratio,
            "simulated_reward_per_step_cm": simulated_steps.tolist(),
            "mean_reward_per_step_cm": measured_steps.mean(axis=0).tolist(),
            "simulated_backsliding_cm": simulated_slide,
            "mean_backsliding_cm": float(measured_slides.mean()),
            "path_rms_cm": float(np.sqrt(np.mean(difference**2))),
            "simulated_turned_deg": self.simulated_turned_deg,
            "mean_turned_deg": float(np.mean(self.turned_deg)) if self.turned_deg else None,
        }


def compare_trials(
    label: str,
    design: str,
    simulated_time_s: np.ndarray,
    simulated_cm: np.ndarray,
    trials: Sequence[Trial],
    step_s: float = 1.0,
    cycle_s: float = 4.0,
    sample_s: float = 0.05,
    simulated_turned_deg: np.ndarray | None = None,
) -> TrialComparison:
    """Put a simulated path and measured trials on common instants.

    Args:
        label: Name of the robot.
        design: Its design.
        simulated_time_s: Times of the simulation [s], (frame,).
        simulated_cm: Forward travel of the simulation [cm], (frame,).
        trials: The trials.
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].
        sample_s: Distance of the instants [s].
        simulated_turned_deg: Turn of the simulation to the left [degrees], (frame,).

    Raises:
        ValueError: No trial, or paths shorter than one step.
    """
    if not trials:
        raise ValueError(f"{label} has no trials, expected at least one")
    end = min(float(simulated_time_s[-1]), *(float(t.track.time_s[-1]) for t in trials))
    # A camera's last frame lies up to a frame before the end.
    end = min(float(simulated_time_s[-1]), end + sample_s)
    if end < step_s:
        raise ValueError(
            f"{label}: simulation and tracks have {end:g} s in common, expected at least one step "
            f"of {step_s:g} s; times of a track count from the gait's start"
        )
    time_s = np.linspace(0.0, end, round(end / sample_s) + 1)
    measured = [trial.track.achieved(Goal("turn_left"), end) for trial in trials]
    return TrialComparison(
        label,
        design,
        time_s,
        np.interp(time_s, simulated_time_s, simulated_cm),
        np.array([trial.track.forward_cm(time_s) for trial in trials]),
        step_s,
        cycle_s,
        None
        if simulated_turned_deg is None
        else float(np.interp(end, simulated_time_s, simulated_turned_deg)),
        tuple(turned for turned in measured if turned is not None),
    )


def pressure_tracking(trial: Trial) -> dict[str, float | None]:
    """How well sensed pressures follow commanded ones.

    Returns:
        Root mean square difference [kPa], and the delay [s] that makes it least (of whole samples
        up to one second); None without sensors.
    """
    log = trial.pressures
    known = np.isfinite(log.sensed_kPa)
    if known.sum() < 2:
        return {"rms_kPa": None, "delay_s": None}
    difference = (log.sensed_kPa - log.commanded_kPa)[known]
    step = float(np.median(np.diff(log.time_s)))
    delays = np.arange(0.0, 1.0, max(step, 1e-3))
    errors = []
    for delay in delays:
        place = np.searchsorted(log.time_s, log.time_s - delay + 1e-9, side="right") - 1
        delayed = np.where((place >= 0)[:, None], log.commanded_kPa[np.maximum(place, 0)], 0.0)
        errors.append(float(np.mean((log.sensed_kPa - delayed)[known] ** 2)))
    return {
        "rms_kPa": float(np.sqrt(np.mean(difference**2))),
        "delay_s": float(delays[int(np.argmin(errors))]),
    }
