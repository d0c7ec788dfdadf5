"""What a rig and a gait take from the robot at hand: its air, and its pressures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.vented_gait import VentedGait
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import SEARCH_STEP_S
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.physics.open_loop_gait import sample_commands, step_count
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design
from pneumorph.study.gait_source import recalibrated

CUT_FACTOR = 1.5
"""A gait that with a calibration asks for more than this times a channel's limit is refused, not
cut."""


def with_air(rig: RigSettings, spec: RobotSpec, design: Design | None) -> RigSettings:
    """The rig with what its file does not say of air: the simulation's, and the design's legs.

    A bend test has one leg, on whichever regulator.
    """
    air = rig.air if rig.air.law != "rate_limit" else spec.physics.air
    if air.law == "rate_limit" or rig.chambers_mm3:
        return replace(rig, air=air)
    if design is None:
        chambers = (float(spec.module.reduced.cavity_volume.sum()),) * len(rig.channels)
    else:
        chambers = _of_channels(spec.chambers_mm3(design), len(rig.channels))
    return replace(rig, air=air, chambers_mm3=chambers)


def _of_channels(chambers_mm3: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Volumes behind a rig's channels, of those behind a robot's regulators.

    Raises:
        ValueError: There are more or fewer channels than regulators with a leg.
    """
    if len(chambers_mm3) < count or any(chambers_mm3[count:]):
        raise ValueError(
            f"the robot has {len(chambers_mm3)} regulators, the rig {count} channels, expected one "
            "for each: give the rig's file as many [[channels]]"
        )
    return chambers_mm3[:count]


def calibrated(
    gait: VentedGait,
    trained: PressureMap,
    measured: PressureMap,
    rig: RigSettings,
    folder: RunFolder,
) -> tuple[VentedGait, dict[str, Any]]:
    """The gait with the measured robot's pressures, and where a channel's limit cuts it off.

    Args:
        gait: The gait.
        trained: `bending_map` of the robot it was made with.
        measured: That of the robot at hand.
        rig: Whose channels have limits, each its own.
        folder: Told of a cut.

    Returns:
        The gait, and fields of a `DeployedGait` that say how it was cut.

    Raises:
        ValueError: So much would be cut off that it would be another gait.
    """
    if trained == measured or gait.regulator_count != len(rig.channels):
        return gait, {}  # the schedule tells how many channels there must be
    highest = np.array([min(HIGHEST_COMMAND_KPA, each.highest_kPa) for each in rig.channels])
    meant = replace(gait, gait=recalibrated(gait.gait, trained, measured, math.inf))
    cut = replace(gait, gait=recalibrated(gait.gait, trained, measured, highest))
    count = step_count(meant.duration_s, SEARCH_STEP_S)
    needed = sample_commands(meant, SEARCH_STEP_S, count).max(axis=0)
    if (needed <= highest).all():
        return cut, {}
    worst = int(np.argmax(needed / highest))
    asked, limit = float(needed[worst]), float(highest[worst])
    if asked > CUT_FACTOR * limit:
        raise ValueError(
            f"with this calibration the gait asks for {asked:.1f} kPa, expected at most "
            f"{CUT_FACTOR:g} times the limit of channel {worst + 1}, {limit:g} kPa, where little "
            f"is cut off; the gait was made for p_sim = {trained.slope:g} p "
            f"{trained.intercept_kPa:+g} kPa, the calibration is {measured.slope:g} p "
            f"{measured.intercept_kPa:+g} kPa, each over its modulus factor: one of them may be of "
            "another leg (--leg)"
        )
    beyond = np.flatnonzero(needed > highest)
    told = ", ".join(f"{needed[n]:.1f} kPa (channel {n + 1}, {highest[n]:g} kPa)" for n in beyond)
    folder.progress.say(
        f"with this calibration the gait asks for more than a channel's limit and is cut off "
        f"there: {told}"
    )
    return cut, {"highest_meant_kPa": asked, "cut_off_at_kPa": limit}
