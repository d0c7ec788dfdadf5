"""The line between simulated and real pressures, through pressures of equal bend."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_text
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.calibration_check import bent_leg, check_calibration
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.bend_test import (
    PressurePairs,
    equal_bend_pairs,
    read_bends,
    read_pairs,
    simulated_bend_curve,
)
from pneumorph.hardware.line_fit import LineFit, fit_line
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.study.calibration_provenance import provenance
from pneumorph.study.calibration_settings import CalibrationSettings

PAIRS_FILE = "pairs.csv"


def with_line(
    calibration: Calibration, settings: CalibrationSettings, spec: RobotSpec, folder: RunFolder
) -> tuple[Calibration, PressurePairs]:
    """The calibration with a line through measured bends or pairs, and the pairs of pressures.

    Raises:
        ValueError: The measurements make no line, or one that the leg's snapshots do not reach.
        FileNotFoundError: Their file is missing.
    """
    if settings.pairs is not None:
        measured, pairs = settings.pairs, read_pairs(settings.pairs)
        said = provenance(measured, spec)
    else:
        assert settings.bends is not None
        measured = settings.bends
        pairs = _pairs_of_bends(settings, spec, folder)
        said = {**provenance(measured, spec), "bent": bent_leg(spec.module)}
    line = _line(pairs, measured)
    intervals = {"slope": line.slope_interval, "intercept_kPa": line.intercept_interval}
    known = {name: ends for name, ends in intervals.items() if np.isfinite(ends).all()}
    if not known:
        folder.progress.say(
            f"{measured}: the line has no confidence intervals, expected readings at three or more "
            "pressures (1 % of their range apart): through two a line always goes"
        )
    others = {name: each for name, each in calibration.intervals.items() if name not in intervals}
    fitted = replace(
        calibration,
        pressure_map=PressureMap(line.slope, line.intercept),
        intervals={**others, **known},
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
    try:
        check_calibration(replace(fitted, path=None), spec.modules)
    except ValueError as error:
        if settings.pairs is None:
            raise ValueError(f"{measured}: {error}") from error
        # Of pairs it is not known which leg they are of.
        folder.progress.say(
            f"{measured}: {error}, or see whether its columns are as they are named"
        )
    if settings.pairs is None:
        _write_pairs(folder / PAIRS_FILE, pairs)
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
    try:
        pairs = equal_bend_pairs(pressure, bend, curve)
    except ValueError as error:
        raise ValueError(f"{settings.bends}: {error}") from error
    below = pressure[pressure < pairs.real_kPa.min()]
    if len(below):
        folder.progress.say(
            f"{len(below)} of {len(pressure)} measured bends are left out, those up to "
            f"{below.max():g} kPa: the leg is not inflated, or does not bend yet"
        )
    return pairs


def _write_pairs(path: Path, pairs: PressurePairs) -> None:
    lines = ["real_pressure_kPa,simulated_pressure_kPa"]
    for real, simulated in zip(pairs.real_kPa, pairs.simulated_kPa, strict=True):
        lines.append(f"{real:.6g},{simulated:.8g}")
    write_text(path, "\n".join(lines) + "\n")
