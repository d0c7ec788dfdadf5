"""Fit the simulation to measurements of the real robot.

From measured bends of one leg against pressure (--bends) the simulated pressures of equal bend are
found and a line is fitted, as in the paper; from pairs of pressures found before (--pairs)
the line alone. From the logs of trials on a rig (--air, a folder of `pneumorph deploy`) the two
conductances of each regulator, for filling and venting, are fitted to what its sensor read; supply
and volumes are those of --physics.air. From trials with the marker's tracks in them (--trials)
modulus, damping and friction are fitted to the paths as well.

Tables are CSV with units in the header: pressure_kPa,bend_deg for bends (psi, bar, rad ... are
converted), real_pressure_kPa,simulated_pressure_kPa for pairs.

Writes calibration.json, which --calibration of every other verb reads, and figures of the fits.

Example: pneumorph calibrate --bends bend_test.csv --out runs/calibration
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.trial_figures import save_calibration_figures
from pneumorph.study.fitted_calibration import (
    CalibrationSettings,
    FittedCalibration,
    calibrate,
)


@dataclass(frozen=True)
class CalibrateOptions:
    """What was measured, and the simulated side."""

    measured: Annotated[CalibrationSettings, flat] = field(default_factory=CalibrationSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def run(options: CalibrateOptions, folder: RunFolder) -> FittedCalibration:
    """Fit what was measured and draw it."""
    fitted = calibrate(options.measured, options.robot, folder)
    save_calibration_figures(fitted, folder.path)
    return fitted.found


VERB = Verb(CalibrateOptions, run)
