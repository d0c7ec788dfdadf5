"""Modulus, friction and damping, fitted to tracked paths of trials."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.idle_numbers import idle_numbers
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.parameter_fit import ParameterFit, fit_parameters
from pneumorph.hardware.trial import read_trial, trial_folders
from pneumorph.physics.calibration import Calibration
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.calibration_provenance import provenance
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.path_simulator import path_simulator


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
        folder: Tells how far the fit is.

    Raises:
        ValueError: Trials without tracks, or too few of them for the numbers asked for.
        FileNotFoundError: A trial's file is missing.
    """
    assert settings.trials is not None
    folders = trial_folders(settings.trials)[: settings.trial_count]
    trials = [read_trial(each, settings.video) for each in folders]
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
    track, step_s = trials[0].track, physics.time_step_s
    driven = trials[0].driven_kPa(np.arange(0.0, float(track.time_s[-1]), step_s))
    path = FittedPath(
        track,
        step_s * np.arange(len(driven) + 1),
        simulate(start, driven),
        simulate({**start, **found.values}, driven),
    )
    quality = asdict(found)
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
