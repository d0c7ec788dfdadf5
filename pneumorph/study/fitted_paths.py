"""Modulus, friction and damping, fitted to tracked paths of trials."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.idle_numbers import idle_numbers
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.parameter_fit import BOUNDS, ParameterFit, fit_parameters
from pneumorph.hardware.trial import folders_to_fit, notes_of, read_trial
from pneumorph.physics.calibration import Calibration
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.calibration_provenance import provenance
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.path_simulator import path_simulator

LEAST_R_SQUARED = 0.5
"""A fit that explains less of the measured paths is none: it leaves more of them than it explains,
so they are of another motion, and the numbers and their intervals say nothing. On the virtual rig
right tracks come to 0.76 to 1.00; those turned by 90 degrees or more, of another design or of a
robot that stood still to 0.15 at most."""

AT_BOUND = 0.01
"""A value that is within this share of its bound lies at it."""


@dataclass(frozen=True, eq=False)
class FittedPath:
    """The first trial's path beside its simulations.

    Attributes:
        track: The path that was measured.
        time_s: Instants of the simulations [s], (time,).
        start_mm: Simulated marker before the fit [mm], (time, 2).
        fitted_mm: And after it.
    """

    track: MarkerTrack
    time_s: np.ndarray
    start_mm: np.ndarray
    fitted_mm: np.ndarray


def with_parameters(
    calibration: Calibration,
    settings: CalibrationSettings,
    spec: RobotSpec,
    plain: RobotSpec,
    folder: RunFolder,
) -> tuple[Calibration, FittedPath]:
    """The calibration with numbers fitted to the tracked paths of a deployment's trials, and the
    first path beside its simulations.

    Args:
        calibration: What is known before.
        settings: The measurements, and what to fit.
        spec: The robot, for the provenance.
        plain: The same without a calibration, which the fit starts from.
        folder: Tells how far the fit is, and what to doubt of it.

    Raises:
        ValueError: Trials without tracks, too few of them for the numbers asked for, or paths that
            no numbers explain.
        FileNotFoundError: A trial's file is missing.
    """
    assert settings.trials is not None
    folders, early = folders_to_fit(settings.trials)
    trials = [read_trial(each, settings.video) for each in folders[: settings.trial_count]]
    told = [*early, *notes_of(trials)]
    for note in told:
        folder.progress.say(note)
    design = Design.parse(FinishedRun.read(settings.trials).of_summary("design", str))
    physics = calibration.applied_to(plain.physics)
    start = {
        "modulus_factor": calibration.modulus_factor or 1.0,
        "stiffness_damping_s": physics.stiffness_damping_s,
        "friction": physics.friction,
    }
    idle = idle_numbers(plain, Randomisation())
    there = {name: value for name, value in start.items() if name not in idle}
    asked = settings.fit if settings.fit.names else settings.fit.resolved(there)
    folder.progress.stage(f"fitting {', '.join(asked.names)} to {len(trials)} trials")
    simulate = path_simulator(plain, design, calibration)
    found: ParameterFit = fit_parameters(
        trials, simulate, start, physics.time_step_s, asked, folder.progress
    )
    _refuse_unexplained(found)
    notes = fit_notes(found)
    for note in notes:
        folder.progress.say(note)
    track, step_s = trials[0].track, physics.time_step_s
    driven = trials[0].driven_kPa(np.arange(0.0, trials[0].logged_s, step_s))
    path = FittedPath(
        track,
        step_s * np.arange(len(driven) + 1),
        simulate(start, driven),
        simulate({**start, **found.values}, driven),
    )
    quality = {**asdict(found), "notes": [*told, *notes]}
    del quality["values"], quality["intervals"]
    said = {
        **provenance(settings.trials, spec),
        "trials": [trial.name for trial in trials],
        "design": str(design),
    }
    fitted = replace(
        calibration,
        **{name: found.values.get(name, getattr(calibration, name)) for name in start},
        intervals={**calibration.intervals, **found.intervals},
        fit={**calibration.fit, "trajectories": quality},
        source={**calibration.source, "trajectories": said},
    )
    return fitted, path


def _refuse_unexplained(found: ParameterFit) -> None:
    """Refuse a fit that explains too little.

    Raises:
        ValueError: It does.
    """
    if found.r_squared >= LEAST_R_SQUARED:
        return
    raise ValueError(
        f"the fit explains too little of the measured paths: r_squared is {found.r_squared:.2f}, "
        f"expected {LEAST_R_SQUARED:g} or more; simulated and measured paths are "
        f"{found.start_rms_mm:.1f} mm apart before the fit and {found.rms_mm:.1f} mm after it, and "
        "nothing is written; likely cause: heading, scale or start of a track is wrong "
        "(--video.heading-deg, --video.units-per-mm, --video.start-s), another design or gait "
        "walked than was deployed, or the robots hardly moved"
    )


def fit_notes(found: ParameterFit) -> list[str]:
    """What to doubt of a fit: values that lie at their bounds, and an end that was not reached."""
    notes = []
    for name, value in found.values.items():
        low, high = BOUNDS[name]
        if low * (1.0 + AT_BOUND) < value < high * (1.0 - AT_BOUND):
            continue
        notes.append(
            f"{name} is {value:.4g}, at the bound of the {low:g} to {high:g} in which it is looked "
            "for, so its interval means nothing: the paths ask for something else that differs, or "
            "say nothing of it"
        )
    if not found.converged:
        notes.append(
            "least squares did not come to their end; more of them may fit better "
            "(--fit.evaluation-limit)"
        )
    return notes
