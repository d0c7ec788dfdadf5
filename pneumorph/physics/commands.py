"""What a regulator may be asked for: one check, wherever commands enter a model or a rig."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, check_range

RegulatorCount = Annotated[int, Bounds(1, 1000, why="one for each cavity of a robot is enough")]

HIGHEST_COMMAND_KPA = 90.0
"""Highest real pressure of a command [kPa] (paper, section IV); above it PneuNets form aneurysms.

Gaits and tasks may name a higher one as their ``maximum_pressure_kPa``, for simulations: the hard
limits of a rig's channels hold whatever a gait says."""

ROUNDING_KPA = 1e-9
"""What a straight line between allowed pressures may be beyond them by rounding [kPa]."""


def check_commands(
    commands_kPa: np.ndarray,
    highest_kPa: float = HIGHEST_COMMAND_KPA,
    lowest_kPa: float = 0.0,
    name: str = "commands_kPa",
) -> None:
    """Refuse commands that are not finite or out of range.

    Args:
        commands_kPa: Real pressures asked of regulators [kPa], any shape.
        highest_kPa: Highest that is allowed [kPa].
        lowest_kPa: Lowest that is allowed [kPa].
        name: What the message calls them.

    Raises:
        ValueError: One is not; names the one that is furthest out.
    """
    check_range(
        commands_kPa,
        lowest_kPa,
        highest_kPa + ROUNDING_KPA,
        name,
        "pressures are real ones in kPa, not simulated ones and not Pa or psi; a wave goes to "
        "twice its amplitude; to simulate higher ones, raise maximum_pressure_kPa",
    )
