"""The conductances of valves, fitted to sensed pressures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.air_fit import fit_air, simulated_kPa
from pneumorph.hardware.deployment_log import LoggedPressures, read_log
from pneumorph.hardware.trial import LOG_FILE, folders_to_fit
from pneumorph.physics.calibration import Calibration
from pneumorph.robot.design import Design
from pneumorph.study.calibration_provenance import provenance
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.finished_run import FinishedRun

NORMAL_95 = 1.96
"""Standard deviations that a 95 % interval reaches to either side."""

LEAST_AIR_DEVIATION = 0.01
"""No valve is taken to be known better than this, however long its log: supply and temperature are
not the same on another day."""

AIR_FACTORS = ("filling_factor", "venting_factor")
"""Of all valves in a world, relative to the conductances that a calibration has."""


def with_air(
    calibration: Calibration, settings: CalibrationSettings, spec: RobotSpec, folder: RunFolder
) -> tuple[Calibration, tuple[LoggedPressures, np.ndarray]]:
    """The calibration with the valves of a deployment, its first log, and the fitted pressures at
    that log's samples [kPa], (sample, channel).

    Raises:
        ValueError: The logs do not tell of the valves.
        FileNotFoundError: A log is missing.
    """
    assert settings.air is not None
    folders, early = folders_to_fit(settings.air)
    for note in early:
        folder.progress.say(note)
    folders = folders[: settings.trial_count]
    logs = [read_log(each / LOG_FILE) for each in folders]
    design = Design.parse(FinishedRun.read(settings.air).of_summary("design", str))
    chambers = spec.chambers_mm3(design)
    folder.progress.stage(f"fitting valves to {len(logs)} logs")
    found = fit_air(logs, spec.physics.air, chambers)
    others = {n: v for n, v in calibration.measured.items() if n not in AIR_FACTORS}
    idle = [str(number) for number, volume in enumerate(chambers, start=1) if volume == 0.0]
    if idle:
        folder.progress.say(
            f"{design} has no leg on regulator {', '.join(idle)}: its valves are as they were, and "
            "worlds stay as wide as they are drawn; deploy a design that uses all regulators to "
            "narrow them"
        )
    said = {
        **provenance(settings.air, spec),
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


def _factors_of_air(intervals: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """How well the conductances of the valve that is known least are known, relative to them."""
    found = {}
    for factor in AIR_FACTORS:
        reaches = [
            math.log(high / low) / (2.0 * NORMAL_95)
            for name, (low, high) in intervals.items()
            if name.startswith(factor.removesuffix("_factor"))
        ]
        found[factor] = (1.0, max(LEAST_AIR_DEVIATION, *reaches))
    return found
