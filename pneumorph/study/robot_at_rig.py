"""What a rig and a gait take from the robot at hand: its air, and its pressures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import SEARCH_STEP_S
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.physics.open_loop_gait import OpenLoopGait, sample_commands, step_count
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design
from pneumorph.study.gait_source import recalibrated

CUT_FACTOR = 1.5
"""A gait that with a calibration asks for more than this times the limit is refused, not cut."""


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
    gait: OpenLoopGait,
    trained: PressureMap,
    measured: PressureMap,
    rig: RigSettings,
    folder: RunFolder,
) -> tuple[OpenLoopGait, dict[str, Any]]:
    """The gait with the measured robot's pressures, and where the limit cuts it off.

    Args:
        gait: The gait.
        trained: Pressure map it was made with.
        measured: Pressure map of the robot at hand.
        rig: Whose channels have limits.
        folder: Told of a cut.

    Returns:
        The gait, and fields of a `DeployedGait` that say how it was cut.

    Raises:
        ValueError: So much would be cut off that it would be another gait.
    """
    if trained == measured:
        return gait, {}
    highest = min(HIGHEST_COMMAND_KPA, *(channel.highest_kPa for channel in rig.channels))
    meant = recalibrated(gait, trained, measured, math.inf)
    count = step_count(meant.duration_s, SEARCH_STEP_S)
    needed = float(sample_commands(meant, SEARCH_STEP_S, count).max())
    if needed > CUT_FACTOR * highest:
        raise ValueError(
            f"with this calibration the gait asks for {needed:.1f} kPa, expected at most "
            f"{CUT_FACTOR:g} times the limit of {highest:g} kPa, where little is cut off; the gait "
            f"was made for p_sim = {trained.slope:g} p {trained.intercept_kPa:+g} kPa, the "
            f"calibration is {measured.slope:g} p {measured.intercept_kPa:+g} kPa: one of them may "
            "be of another leg (--leg)"
        )
    if needed <= highest:
        return recalibrated(gait, trained, measured, highest), {}
    folder.progress.say(
        f"with this calibration the gait asks for {needed:.1f} kPa: it is cut off at {highest:g} "
        "kPa"
    )
    cut = {"highest_meant_kPa": needed, "cut_off_at_kPa": highest}
    return recalibrated(gait, trained, measured, highest), cut
