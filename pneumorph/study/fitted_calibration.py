"""The simulation fitted to what was measured of a real robot: bends of a leg, paths of trials."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.hardware.bend_test import PressurePairs
from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.physics.calibration import Calibration
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_bench import DAMPING, MODULUS, with_bench, without
from pneumorph.study.fitted_line import with_line
from pneumorph.study.fitted_paths import FittedPath, with_parameters
from pneumorph.study.fitted_valves import with_air

CALIBRATION_FILE = "calibration.json"


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
        calibration, pairs = with_line(calibration, settings, spec, folder)
        calibration = without(MODULUS, calibration, say)
    if settings.air is not None:
        calibration, filled = with_air(calibration, settings, spec, folder)
    if settings.trials is not None:
        plain, before = replace(robot, calibration=None).spec(), calibration
        calibration, path = with_parameters(calibration, settings, spec, plain, folder)
        if calibration.modulus_factor != before.modulus_factor:
            calibration = without(MODULUS, calibration, say)
        if calibration.stiffness_damping_s != before.stiffness_damping_s:
            calibration = without(DAMPING, calibration, say)
    if settings.bench is not None:
        calibration = with_bench(calibration, settings, spec, say)
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
