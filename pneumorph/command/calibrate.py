"""Fit the simulation to measurements of the real robot.

--bends: from measured bends of one leg against pressure, finds the simulated pressures that give
the same bends and fits a line, as in the paper. --pairs: fits the line to pairs of pressures found
before. --air: from the logs of a deployment (a folder of `pneumorph deploy`), fits the two
conductances of each regulator, for filling and venting, to its sensor; supply and volumes are those
of --physics.air. --trials: from trials with the marker's tracks, fits modulus, friction and damping
to the paths. --bench: readings of tests that a certificate names; --randomisation then draws worlds
that agree.

Tables are CSV with units in the header: pressure_kPa,bend_deg for bends (psi, bar, rad ... are
converted), real_pressure_kPa,simulated_pressure_kPa for pairs; test,reading for --bench, in the
units that docs/hardware.md lists, such as: tilt of a leg,31.5

Writes calibration.json, which every verb that simulates robots reads with --calibration, and
figures of the fits.

Example: pneumorph calibrate --bends bend_test.csv --out runs/calibration
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.trial_figures import save_calibration_figures
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_calibration import FittedCalibration, calibrate


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
