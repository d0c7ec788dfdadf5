"""Fit the simulation to measurements of the real robot.

From measured bends of one leg against pressure (--bends) the simulated pressures of equal bend are
found and a line is fitted, as in the paper; from pairs of pressures found before (--pairs)
the line alone. From trials on a rig (--trials, a folder of `pneumorph deploy` with the marker's
tracks in it) modulus, damping and friction are fitted to the paths as well.

Tables are CSV with units in the header: pressure_kPa,bend_deg for bends (psi, bar, rad ... are
converted), real_pressure_kPa,simulated_pressure_kPa for pairs.

Writes calibration.json, which --calibration of every other verb reads, and calibration.png.

Example: pneumorph calibrate --bends bend_test.csv --out runs/calibration
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_atomically
from pneumorph.command.robots import Model, RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder, read_summary
from pneumorph.command.verb import Verb
from pneumorph.hardware.bend_test import (
    PressurePairs,
    equal_bend_pairs,
    read_bends,
    read_pairs,
    simulated_bend_curve,
)
from pneumorph.hardware.calibration import Calibration
from pneumorph.hardware.line_fit import LineFit, fit_line
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.parameter_fit import (
    ParameterFit,
    ParameterFitSettings,
    Parameters,
    fit_parameters,
)
from pneumorph.hardware.trial import read_trial, trial_folders
from pneumorph.pressure import PressureMap
from pneumorph.report.calibration_figure import calibration_figure
from pneumorph.report.path_fit_figure import path_fit_figure
from pneumorph.report.style import save_figure
from pneumorph.robot.design import Design
from pneumorph.robot.scaled_part import scaled_robot
from pneumorph.simulation.reduced_robot import ReducedRobot

flat = tyro.conf.arg(name="")

CALIBRATION_FILE = "calibration.json"
PAIRS_FILE = "pairs.csv"


@dataclass(frozen=True)
class CalibrateOptions:
    """What was measured, and the simulated side."""

    bends: Path | None = None
    """Measured bends of one leg held at its root: pressure_kPa,bend_deg."""
    pairs: Path | None = None
    """Pairs of equal bend: real_pressure_kPa,simulated_pressure_kPa."""
    trials: Path | None = None
    """Folder of a deployment whose trials modulus, damping and friction are fitted to."""
    trial_count: int = 5
    """How many of the trials to fit to."""
    model: Model = "reduced"
    """Leg whose bend is compared: the reduced one or its finite elements (minutes)."""
    largest_simulated_kPa: float = 450.0
    """The simulated leg is bent up to this pressure or to where it fails [kPa]."""
    fit: ParameterFitSettings = field(default_factory=ParameterFitSettings)
    video: VideoSettings = field(default_factory=VideoSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        if self.bends is not None and self.pairs is not None:
            raise ValueError("both bends and pairs were given, expected one: they fit one line")
        if self.trial_count < 1:
            raise ValueError(f"trial_count is {self.trial_count}, expected at least 1")


def calibrate(options: CalibrateOptions, folder: RunFolder) -> dict[str, Any]:
    """Fit what was measured and write the calibration file."""
    start = time.monotonic()
    if options.bends is None and options.pairs is None and options.trials is None:
        raise ValueError(
            "nothing to calibrate from, expected --bends FILE, --pairs FILE or --trials FOLDER"
        )
    workshop = Workshop(options.robot)
    calibration = workshop.calibration or Calibration(workshop.simulation.pressure_map)
    if options.bends is not None or options.pairs is not None:
        calibration = _with_line(calibration, options, workshop, folder)
    if options.trials is not None:
        calibration = _with_parameters(calibration, options, workshop, folder)
    path = calibration.save(folder / CALIBRATION_FILE)
    content = calibration.content()
    return {
        "calibration": str(path),
        "digest": calibration.digest(),
        **{name: content[name] for name in content if name != "source"},
        "damping": options.robot.simulation.damping,
        **workshop.leg_used(options.model),
        "wall_s": time.monotonic() - start,
    }


def _with_line(
    calibration: Calibration, options: CalibrateOptions, workshop: Workshop, folder: RunFolder
) -> Calibration:
    if options.pairs is not None:
        measured, pairs = options.pairs, read_pairs(options.pairs)
    else:
        assert options.bends is not None
        measured = options.bends
        pairs = _pairs_of_bends(options, workshop, folder)
        _write_pairs(folder / PAIRS_FILE, pairs)
    line: LineFit = fit_line(pairs.real_kPa, pairs.simulated_kPa)
    fitted = PressureMap(line.slope, line.intercept)
    figure = calibration_figure(pairs.real_kPa, pairs.simulated_kPa, fitted, line.r_squared)
    save_figure(figure, folder / "calibration.png")
    return replace(
        calibration,
        pressure_map=fitted,
        intervals={
            **calibration.intervals,
            "slope": line.slope_interval,
            "intercept_kPa": line.intercept_interval,
        },
        fit={
            **calibration.fit,
            "pressure": {
                "r_squared": line.r_squared,
                "rms_kPa": line.rms,
                "point_count": line.point_count,
            },
        },
        source={**calibration.source, "pressure": _provenance(measured, workshop)},
    )


def _pairs_of_bends(
    options: CalibrateOptions, workshop: Workshop, folder: RunFolder
) -> PressurePairs:
    assert options.bends is not None
    pressure, bend = read_bends(options.bends)
    folder.progress.stage(f"bending the {options.model} leg")
    mesh = workshop.full_leg.mesh
    workshop.leg.check_mesh(mesh)
    curve = simulated_bend_curve(
        workshop.leg if options.model == "reduced" else workshop.full_leg,
        mesh,
        options.largest_simulated_kPa,
        rotation="edge" if options.robot.simulation.damping == "published" else "polar",
        progress=folder.progress,
    )
    return equal_bend_pairs(pressure, bend, curve)


def _write_pairs(path: Path, pairs: PressurePairs) -> None:
    lines = ["real_pressure_kPa,simulated_pressure_kPa"]
    for real, simulated in zip(pairs.real_kPa, pairs.simulated_kPa, strict=True):
        lines.append(f"{real:.6g},{simulated:.8g}")
    write_atomically(path, lambda stream: stream.write(("\n".join(lines) + "\n").encode()))


def _with_parameters(
    calibration: Calibration, options: CalibrateOptions, workshop: Workshop, folder: RunFolder
) -> Calibration:
    assert options.trials is not None
    folders = trial_folders(options.trials)[: options.trial_count]
    trials = [read_trial(each, options.video) for each in folders]
    design = Design.parse(read_summary(options.trials)["design"])
    settings = calibration.applied_to(options.robot.simulation)
    start = {
        "modulus_factor": calibration.modulus_factor or 1.0,
        "stiffness_damping_s": settings.stiffness_damping_s,
        "friction": settings.friction,
    }
    folder.progress.stage(f"fitting {', '.join(options.fit.names)} to {len(trials)} trials")
    simulate = _path_simulator(workshop, design, calibration)
    fitted: ParameterFit = fit_parameters(
        trials,
        simulate,
        start,
        settings.time_step_s,
        options.fit,
        folder.progress,
    )
    track, step_s = trials[0].track, settings.time_step_s
    driven = trials[0].driven_kPa(np.arange(0.0, float(track.time_s[-1]), step_s))
    figure = path_fit_figure(
        track.time_s,
        track.position_mm,
        step_s * np.arange(len(driven) + 1),
        simulate(start, driven),
        simulate({**start, **fitted.values}, driven),
        fitted.r_squared,
    )
    save_figure(figure, folder / "path_fit.png")
    quality = asdict(fitted)
    del quality["values"], quality["intervals"]
    return replace(
        calibration,
        modulus_factor=fitted.values.get("modulus_factor", calibration.modulus_factor),
        stiffness_damping_s=fitted.values.get(
            "stiffness_damping_s", calibration.stiffness_damping_s
        ),
        friction=fitted.values.get("friction", calibration.friction),
        intervals={**calibration.intervals, **fitted.intervals},
        fit={**calibration.fit, "trajectories": quality},
        source={
            **calibration.source,
            "trajectories": {
                **_provenance(options.trials, workshop),
                "trials": [trial.name for trial in trials],
                "design": str(design),
            },
        },
    )


def _path_simulator(
    workshop: Workshop, design: Design, calibration: Calibration
) -> Callable[[Parameters, np.ndarray], np.ndarray]:
    """Simulate a design under sensed pressures with given parameters."""
    from pneumorph.hardware.virtual_rig import UNLIMITED_KPA_PER_S

    nominal = workshop.robot(design)
    known = replace(
        calibration.applied_to(workshop.options.simulation),
        pressure_rate_kPa_per_s=UNLIMITED_KPA_PER_S,  # the sensed pressure is what there was
    )

    def simulate(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
        settings = replace(
            known,
            friction=values["friction"],
            stiffness_damping_s=values["stiffness_damping_s"],
            # Paths must change with the parameters as smoothly as they can.
            tangent_tolerance_mm_per_s=0.0,
        )
        # The workshop's leg has the calibrated modulus already; fits are relative to the model's.
        factor = values["modulus_factor"] / workshop.modulus_factor
        robot = ReducedRobot(scaled_robot(nominal, factor), settings)
        rest = np.zeros((15, settings.regulator_count))
        state, _ = robot.rollout(robot.initial_state(), rest, len(rest), False)
        _, trajectory = robot.rollout(state, driven_kPa, 1, False)
        places = np.full((len(driven_kPa) + 1, 2), np.nan)
        places[: len(trajectory.time_s)] = trajectory.tracked_point_mm[:, :2]
        return places

    return simulate


def _provenance(measured: Path, workshop: Workshop) -> dict[str, Any]:
    """What was measured, by name and content, and the leg that it was compared with."""
    content = measured.read_bytes() if measured.is_file() else b""
    return {
        "measured": str(measured),
        "sha256": hashlib.sha256(content).hexdigest() if content else None,
        "leg": workshop.leg.digest(),
        "damping": workshop.simulation.damping,
    }


VERB = Verb(CalibrateOptions, calibrate)
