"""The simulation fitted to what was measured of a real robot: bends of a leg, paths of trials."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_atomically
from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.calibration_check import check_calibration
from pneumorph.catalogue.idle_numbers import idle_numbers
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.air_fit import fit_air, simulated_kPa
from pneumorph.hardware.bend_test import (
    PressurePairs,
    equal_bend_pairs,
    read_bends,
    read_pairs,
    simulated_bend_curve,
)
from pneumorph.hardware.deployment_log import LoggedPressures, read_log
from pneumorph.hardware.line_fit import LineFit, fit_line
from pneumorph.hardware.marker_track import MarkerTrack, VideoSettings
from pneumorph.hardware.parameter_fit import ParameterFit, ParameterFitSettings, fit_parameters
from pneumorph.hardware.trial import LOG_FILE, read_trial, trial_folders
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.bench_readings import (
    beyond_usual_worlds,
    measured_numbers,
    one_leg_notes,
    read_bench_readings,
)
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.path_simulator import path_simulator
from pneumorph.study.recorded_walk import Model

CALIBRATION_FILE = "calibration.json"
PAIRS_FILE = "pairs.csv"
MODULUS = "modulus_factor"

NORMAL_95 = 1.96
"""Standard deviations that a 95 % interval reaches to either side."""

LEAST_AIR_DEVIATION = 0.01
"""No valve is taken to be known better than this, however long its log: supply and temperature are
not the same on another day."""


@dataclass(frozen=True)
class CalibrationSettings(Checked):
    """Which measurements to fit to. Give one or more."""

    bends: Path | None = None
    """CSV table of the measured bends of one leg held at its root, with columns
    pressure_kPa,bend_deg."""
    pairs: Path | None = None
    """CSV table of real and simulated pressures that give the same bend, with columns
    real_pressure_kPa,simulated_pressure_kPa; instead of --bends."""
    trials: Path | None = None
    """Deployment folder; modulus, friction and damping are fitted to the tracked paths of its
    trials."""
    air: Path | None = None
    """Deployment folder; the filling and venting conductance of each regulator is fitted to its
    sensed pressures."""
    bench: Path | None = None
    """CSV table of bench tests, with columns test,reading; tests are named as in a certificate. Not
    together with --bends, --pairs or --trials: fit those first and pass their file as
    --calibration."""
    trial_count: Count = 5
    """Number of trials to fit to, the first ones."""
    model: Model = "reduced"
    """Model of the leg that is bent in the simulation: reduced, or finite elements (minutes)."""
    largest_simulated_kPa: Positive = 450.0
    """Highest simulated pressure of the bend, unless the simulation fails before [kPa]."""
    fit: ParameterFitSettings = field(default_factory=ParameterFitSettings)
    video: VideoSettings = field(default_factory=VideoSettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bends is not None and self.pairs is not None:
            raise ValueError("both bends and pairs were given, expected one: they fit one line")
        for name in ("bends", "pairs", "trials"):
            if self.bench is not None and getattr(self, name) is not None:
                raise ValueError(
                    f"both bench and {name} were given, expected one after the other: tests on a "
                    "bench are read against the robot that --calibration makes of the other"
                )


@dataclass(frozen=True)
class FittedCalibration:
    """What was fitted; a parameter that nobody has measured is None."""

    calibration: str
    """File of the calibration."""
    digest: str
    slope: float
    intercept_kPa: float
    modulus_factor: float | None
    stiffness_damping_s: float | None
    friction: float | None
    confidence_intervals_95: dict[str, tuple[float, float]]
    fit: dict[str, Any]
    """Figures of fit, such as ``r_squared``, of ``pressure``, ``air`` and ``trajectories``."""
    damping: str
    wall_s: float
    filling_mm3_per_s_kPa: tuple[float, ...] | None = None
    """Conductance that each regulator fills through."""
    venting_mm3_per_s_kPa: tuple[float, ...] | None = None
    """And that it vents through."""
    measured: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Numbers that worlds differ in, by tests on a bench: value and standard deviation."""
    leg: PartsSummary | None = None
    """The reduced leg; None where its finite elements were bent."""


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


@dataclass(frozen=True, eq=False)
class CalibrationStudy:
    """What was fitted, and to which measurements, for those who draw it.

    Attributes:
        found: The result.
        pairs: Pressures of equal bend; None where no line was fitted.
        path: A path of the trials; None where none were fitted to.
        filled: The first log that air was fitted to, and the fitted pressures at its samples [kPa],
            (sample, channel); None where none was.
    """

    found: FittedCalibration
    pairs: PressurePairs | None
    path: FittedPath | None
    filled: tuple[LoggedPressures, np.ndarray] | None = None


def calibrate(
    settings: CalibrationSettings, robot: RobotOptions, folder: RunFolder
) -> CalibrationStudy:
    """Fit what was measured and write the calibration file.

    Args:
        settings: What was measured.
        robot: The simulated side; what its own calibration says is kept where nothing is fitted.
        folder: Receives ``calibration.json`` and, of measured bends, ``pairs.csv``.

    Raises:
        ValueError: Nothing was measured, or too little for a fit.
        FileNotFoundError: A file of measurements is missing.
    """
    start = time.monotonic()
    measured = (settings.bends, settings.pairs, settings.trials, settings.air, settings.bench)
    if all(each is None for each in measured):
        raise ValueError(
            "nothing to calibrate from, expected --bends FILE, --pairs FILE, --trials FOLDER, "
            "--air FOLDER or --bench FILE"
        )
    spec = robot.spec()
    calibration = spec.calibration or Calibration(spec.physics.pressure_map)
    pairs, path, filled = None, None, None
    say = folder.progress.say
    if settings.bends is not None or settings.pairs is not None:
        calibration, pairs = _with_line(calibration, settings, spec, folder)
        calibration = _without_modulus(calibration, say)
    if settings.air is not None:
        calibration, filled = _with_air(calibration, settings, spec, folder)
    if settings.trials is not None:
        plain, known_factor = replace(robot, calibration=None).spec(), calibration.modulus_factor
        calibration, path = _with_parameters(calibration, settings, spec, plain, folder)
        if calibration.modulus_factor != known_factor:
            calibration = _without_modulus(calibration, say)
    if settings.bench is not None:
        calibration = _with_bench(calibration, settings, spec, say)
    file, air = calibration.save(folder / CALIBRATION_FILE), calibration.air
    found = FittedCalibration(
        calibration=str(file),
        digest=calibration.digest(),
        slope=calibration.pressure_map.slope,
        intercept_kPa=calibration.pressure_map.intercept_kPa,
        modulus_factor=calibration.modulus_factor,
        stiffness_damping_s=calibration.stiffness_damping_s,
        friction=calibration.friction,
        filling_mm3_per_s_kPa=None if air is None else air.filling_mm3_per_s_kPa,
        venting_mm3_per_s_kPa=None if air is None else air.venting_mm3_per_s_kPa,
        confidence_intervals_95=dict(calibration.intervals),
        fit=dict(calibration.fit),
        damping=spec.physics.damping,
        measured=dict(calibration.measured),
        wall_s=time.monotonic() - start,
        leg=spec.describe()["leg"] if settings.model == "reduced" else None,
    )
    return CalibrationStudy(found, pairs, path, filled)


def _with_line(
    calibration: Calibration, settings: CalibrationSettings, spec: RobotSpec, folder: RunFolder
) -> tuple[Calibration, PressurePairs]:
    if settings.pairs is not None:
        measured, pairs = settings.pairs, read_pairs(settings.pairs)
        said = _provenance(measured, spec)
    else:
        assert settings.bends is not None
        measured = settings.bends
        pairs = _pairs_of_bends(settings, spec, folder)
        _write_pairs(folder / PAIRS_FILE, pairs)
        bent = {"name": spec.module.name, "digest": spec.module.bending_digest}
        said = {**_provenance(measured, spec), "bent": bent}
    line = _line(pairs, measured)
    fitted = replace(
        calibration,
        pressure_map=PressureMap(line.slope, line.intercept),
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
        source={**calibration.source, "pressure": said},
    )
    if settings.pairs is None:  # of pairs it is not known which leg they are of
        try:
            check_calibration(replace(fitted, path=None), [spec.module])
        except ValueError as error:
            raise ValueError(f"{measured}: {error}") from error
    return fitted, pairs


def _line(pairs: PressurePairs, measured: Path) -> LineFit:
    """The line through pairs of pressures.

    Raises:
        ValueError: They are too few, all of one pressure, or fall; names their file.
    """
    try:
        line = fit_line(pairs.real_kPa, pairs.simulated_kPa)
    except ValueError as error:
        raise ValueError(f"{measured}: real_pressure: {error}") from error
    if not line.slope > 0.0:
        raise ValueError(
            f"{measured}: simulated_pressure changes by {line.slope:g} kPa for one of "
            "real_pressure, expected it to rise; the two columns may be of different orders"
        )
    return line


def _pairs_of_bends(
    settings: CalibrationSettings, spec: RobotSpec, folder: RunFolder
) -> PressurePairs:
    assert settings.bends is not None
    pressure, bend = read_bends(settings.bends)
    folder.progress.stage(f"bending the {settings.model} leg")
    mesh = spec.module.full.mesh
    spec.module.reduced.check_mesh(mesh)
    curve = simulated_bend_curve(
        spec.module.reduced if settings.model == "reduced" else spec.module.full,
        mesh,
        settings.largest_simulated_kPa,
        rotation=spec.physics.rotation,
        progress=folder.progress,
    )
    return equal_bend_pairs(pressure, bend, curve)


def _write_pairs(path: Path, pairs: PressurePairs) -> None:
    lines = ["real_pressure_kPa,simulated_pressure_kPa"]
    for real, simulated in zip(pairs.real_kPa, pairs.simulated_kPa, strict=True):
        lines.append(f"{real:.6g},{simulated:.8g}")
    write_atomically(path, lambda stream: stream.write(("\n".join(lines) + "\n").encode()))


def _with_air(
    calibration: Calibration, settings: CalibrationSettings, spec: RobotSpec, folder: RunFolder
) -> tuple[Calibration, tuple[LoggedPressures, np.ndarray]]:
    assert settings.air is not None
    folders = trial_folders(settings.air)[: settings.trial_count]
    logs = [read_log(each / LOG_FILE) for each in folders]
    design = Design.parse(FinishedRun.read(settings.air).of_summary("design", str))
    chambers = spec.chambers_mm3(design)
    folder.progress.stage(f"fitting valves to {len(logs)} logs")
    found = fit_air(logs, spec.physics.air, chambers)
    others = {n: v for n, v in calibration.measured.items() if n not in _AIR_FACTORS}
    idle = [str(number) for number, volume in enumerate(chambers, start=1) if volume == 0.0]
    if idle:
        folder.progress.say(
            f"{design} has no leg on regulator {', '.join(idle)}: its valves are as they were, and "
            "worlds stay as wide as they are drawn; deploy a design that uses all regulators to "
            "narrow them"
        )
    said = {
        **_provenance(settings.air, spec),
        "trials": [each.name for each in folders],
        "design": str(design),
        "chambers_mm3": list(chambers),
    }
    fitted = replace(
        calibration,
        air=found.air,
        intervals={**calibration.intervals, **found.intervals},
        fit={
            **calibration.fit,
            "air": {"rms_kPa": found.rms_kPa, "sample_count": found.sample_count},
        },
        measured=others if idle else {**others, **_factors_of_air(found.intervals)},
        source={**calibration.source, "air": said},
    )
    courses = [
        simulated_kPa(logs[0], channel, found.air, chamber)
        for channel, chamber in enumerate(chambers)
    ]
    return fitted, (logs[0], np.column_stack(courses))


_AIR_FACTORS = ("filling_factor", "venting_factor")
"""Of all valves in a world, relative to the conductances that a calibration has."""


def _factors_of_air(intervals: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """How well the conductances of the valve that is known least are known, relative to them."""
    found = {}
    for factor in _AIR_FACTORS:
        reaches = [
            math.log(high / low) / (2.0 * NORMAL_95)
            for name, (low, high) in intervals.items()
            if name.startswith(factor.removesuffix("_factor"))
        ]
        found[factor] = (1.0, max(LEAST_AIR_DEVIATION, *reaches))
    return found


def _without_modulus(calibration: Calibration, say: Callable[[str], None]) -> Calibration:
    """The calibration without what a bench test found of the modulus before: the robot that it was
    relative to has changed, and it would count twice."""
    if MODULUS not in calibration.measured:
        return calibration
    say(
        f"the {MODULUS} that a bench test found before was relative to the leg as it was: it is "
        "left out; measure it again beside this calibration"
    )
    others = {name: v for name, v in calibration.measured.items() if name != MODULUS}
    return replace(calibration, measured=others)


def _with_bench(
    calibration: Calibration,
    settings: CalibrationSettings,
    spec: RobotSpec,
    say: Callable[[str], None],
) -> Calibration:
    bench = settings.bench
    assert bench is not None
    readings = read_bench_readings(bench)
    found = measured_numbers(readings, spec)
    both = ", ".join(name for name in found if name in _AIR_FACTORS)
    if both and settings.air is not None:
        raise ValueError(
            f"{bench} has readings of {both}, which --air fits as well: they are relative to the "
            "valves before that fit; leave one of both out"
        )
    for told in one_leg_notes(readings):
        say(told)
    for name, (value, deviation) in found.items():
        if (before := calibration.measured.get(name)) is not None:
            say(
                f"{name} was {before[0]:.4g} +- {before[1]:.2g}: these readings replace it; give "
                "all readings in one file to have them count together"
            )
        say(f"measured {name}: {value:.4g} +- {deviation:.2g}")
        if (note := beyond_usual_worlds(name, value, deviation)) is not None:
            say(note)
    return replace(
        calibration,
        measured={**calibration.measured, **found},
        source={**calibration.source, "bench": _provenance(bench, spec)},
    )


def _with_parameters(
    calibration: Calibration,
    settings: CalibrationSettings,
    spec: RobotSpec,
    plain: RobotSpec,
    folder: RunFolder,
) -> tuple[Calibration, FittedPath]:
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
        **_provenance(settings.trials, spec),
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


def _provenance(measured: Path, spec: RobotSpec) -> dict[str, Any]:
    """What was measured, by name and content, and the leg that it was compared with."""
    content = measured.read_bytes() if measured.is_file() else b""
    return {
        "measured": str(measured),
        "sha256": hashlib.sha256(content).hexdigest() if content else None,
        "leg": spec.reduction_digest(),
        "damping": spec.physics.damping,
    }
