"""Refuse a calibration of another leg than the one that walks, or in other units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from pneumorph.catalogue.module import Module
from pneumorph.catalogue.paper_leg import LegName, pressure_map
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA

WIDEST_RATIO = 2.5
"""Pressures of a measured line over those of the leg's usual one, or the other way round, at the
highest command. Lines of one leg are some tenths apart; those of the published leg and of the other
two that ship, more than three times."""


def check_calibration(calibration: Calibration, modules: Sequence[Module]) -> None:
    """Refuse the pressures of a calibration that was fitted to the bends of another leg, or that no
    leg like these is inflated with.

    Args:
        calibration: What was measured.
        modules: What is mounted.

    Raises:
        ValueError: Either is the case; names both legs.
    """
    file = "the calibration" if calibration.path is None else f"calibration {calibration.path}"
    names = " or ".join(module.name for module in modules)
    fitted = calibration.source.get("pressure", {}).get("bent")
    if fitted is not None:
        bent = [module for module in modules if module.bending_digest == fitted["digest"]]
        if not bent:
            raise ValueError(
                f"{file} was fitted to the bends of {fitted['name']}, expected those of {names}, "
                "which walks: legs of another mesh or material take other pressures; choose that "
                "leg, or calibrate this one"
            )
        modules = bent
    asked = float(calibration.pressure_map.simulated(HIGHEST_COMMAND_KPA))
    for module in modules:
        if module.pressure_map is None:
            continue
        own = float(module.pressure_map.simulated(HIGHEST_COMMAND_KPA))
        if own / WIDEST_RATIO <= asked <= own * WIDEST_RATIO:
            continue
        if fitted is not None:
            cause = (
                "the measured pressures may be in another unit than their table says, or the bends "
                "not in degrees; measure again, or correct the table"
            )
        else:
            usual = {name: float(pressure_map(name).simulated(HIGHEST_COMMAND_KPA))
                     for name in get_args(LegName)}  # fmt: skip
            nearest = min(usual, key=lambda name: abs(usual[name] - asked))
            cause = (
                f"it may have been fitted to another, such as the {nearest} leg, which takes "
                f"{usual[nearest]:.0f} kPa; choose the leg that it is of, or calibrate this one"
            )
        raise ValueError(
            f"{file} inflates {module.name} with {asked:.3g} kPa for {HIGHEST_COMMAND_KPA:g} kPa "
            f"of the real leg, expected some {own:.0f} kPa: {cause}"
        )
