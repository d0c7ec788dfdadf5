"""Refuse a calibration of another leg than the one that walks, or in other units."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, get_args

from pneumorph.catalogue.leg_kinds import LegName, pressure_map
from pneumorph.catalogue.module import Module
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.reduction.reduced_part import SAME_THICKNESS

WIDEST_RATIO = 2.5
"""Pressures of a measured line over those of the leg's usual one, or the other way round, at the
highest command. Lines of one leg are some tenths apart; those of the published leg and of the other
two that ship, more than three times."""


RELATIVE_TO = "relative_to"
"""Where ``bench`` of a calibration's source says which leg what was measured is relative to."""

_SAME_MASS = 1e-3
"""Relative difference of masses that are one: another reduction of a leg may round it."""


def bent_leg(leg: Module) -> dict[str, Any]:
    """What tells a leg from others that bend otherwise, for what is fitted to its bends: its name,
    ``digest`` and, where its reduction says it, the thickness of its sheet, ``sheet_mm``."""
    known = {} if leg.sheet_mm is None else {"sheet_mm": leg.sheet_mm}
    return {"name": leg.name, "digest": leg.bending_digest, **known}


def relative_to(numbers: Collection[str], modules: Sequence[Module]) -> dict[str, dict[str, Any]]:
    """What tells the leg that tests on a bench are relative to from others, by the number that was
    tested; of numbers that are relative to no leg nothing.

    Args:
        numbers: What was tested, as `World.numbers` has it.
        modules: What was mounted, calibrated or not: a single kind where one is tested.
    """
    found: dict[str, dict[str, Any]] = {}
    if "mass_factor" in numbers:
        (leg,) = modules
        found["mass_factor"] = {"name": leg.name, "mass_g": 1e3 * leg.reduced.mass}
    if "modulus_factor" in numbers:
        (leg,) = modules
        found["modulus_factor"] = bent_leg(leg)
    return found


def check_calibration(calibration: Calibration, modules: Sequence[Module]) -> None:
    """Refuse the pressures of a calibration that was fitted to the bends of another leg, or that no
    leg like these is inflated with, and what a bench found relative to another leg.

    Args:
        calibration: What was measured.
        modules: What is mounted.

    Raises:
        ValueError: Either is the case; names both legs.
    """
    file = "the calibration" if calibration.path is None else f"calibration {calibration.path}"
    _check_bench(calibration, modules, file)
    fitted = calibration.source.get("pressure", {}).get("bent")
    if fitted is not None:
        bent = [module for module in modules if _is_leg(module, fitted)]
        if not bent:
            known, names, what = _told_apart(fitted, modules)
            raise ValueError(
                f"{file} was fitted to the bends of {known}, expected those of {names}, "
                f"which walks: legs of another {what} take other pressures; choose that "
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


def calibration_note(calibration: Calibration, modules: Sequence[Module]) -> str | None:
    """What to say of a robot that has other legs beside the one that a calibration was measured on;
    None where all are that leg, or nothing is relative to one.

    Args:
        calibration: What was measured, of one of the modules as of `check_calibration`.
        modules: What is mounted.
    """
    fitted, bench = calibration.source.get("pressure", {}).get("bent"), _of_bench(calibration)
    told = []
    for what, leg, is_it in (
        ("pressures", fitted, _is_leg),
        ("the moduli of drawn worlds", bench.get("modulus_factor"), _is_leg),
        ("the masses of drawn worlds", bench.get("mass_factor"), _has_mass),
    ):
        others = [] if leg is None else [each.name for each in modules if not is_it(each, leg)]
        if leg is not None and others:
            told.append(f"{what} were measured of {leg['name']}, not of {' and '.join(others)}")
    if not told:
        return None
    file = "the calibration" if calibration.path is None else f"calibration {calibration.path}"
    return f"{file}: {'; '.join(told)}: they are taken for all of these"


def _check_bench(calibration: Calibration, modules: Sequence[Module], file: str) -> None:
    """Refuse a mass or a modulus that was measured relative to another leg: it would count twice,
    or be of something else. Files of earlier versions do not say to which.

    Raises:
        ValueError: None of the modules is that leg; names both.
    """
    legs = _of_bench(calibration)
    again = "or weigh and bend the legs again with these settings (calibrate --bench)"
    weighed = legs.get("mass_factor")
    if weighed is not None and not any(_has_mass(module, weighed) for module in modules):
        mass_g = [1e3 * module.reduced.mass for module in modules]
        now = " or ".join(f"{each:.4g} g ({module.name})"
                          for each, module in zip(mass_g, modules, strict=True))  # fmt: skip
        factor = calibration.measured["mass_factor"][0]
        raise ValueError(
            f"{file} has mass_factor {factor:.4g}, weighed relative to legs of "
            f"{weighed['mass_g']:.4g} g ({weighed['name']}), expected legs of that mass, and "
            f"there are such of {now}: if that is what was weighed, it would count twice; "
            f"leave out masses.leg_mass_g, or whatever else changed the mass, {again}"
        )
    bent = legs.get("modulus_factor")
    if bent is not None and not any(_is_leg(module, bent) for module in modules):
        known_as, names, what = _told_apart(bent, modules)
        factor = calibration.measured["modulus_factor"][0]
        raise ValueError(
            f"{file} has modulus_factor {factor:.4g}, measured relative to the moduli of "
            f"{known_as}, expected that leg, and {names} walks: legs of another {what} bend "
            f"otherwise; choose that leg, {again}"
        )


def _of_bench(calibration: Calibration) -> dict[str, Any]:
    """The legs that tests on a bench were relative to, by the number that was tested."""
    known = calibration.source.get("bench", {}).get(RELATIVE_TO, {})
    return {name: leg for name, leg in known.items() if name in calibration.measured}


def _has_mass(module: Module, weighed: Mapping[str, Any]) -> bool:
    """Whether a module weighs what was weighed."""
    mass_g: float = weighed["mass_g"]
    return abs(1e3 * module.reduced.mass - mass_g) <= _SAME_MASS * mass_g


def _is_leg(module: Module, said: Mapping[str, Any]) -> bool:
    """Whether a module is what `bent_leg` said; sheets are one where either does not say its own,
    as of files of earlier versions."""
    if module.bending_digest != said["digest"]:
        return False
    own, bent = module.sheet_mm, said.get("sheet_mm")
    return own is None or bent is None or math.isclose(own, bent, rel_tol=SAME_THICKNESS)


def _told_apart(said: Mapping[str, Any], modules: Sequence[Module]) -> tuple[str, str, str]:
    """The leg that was bent, those that walk, and in what they differ, for an error."""
    if all(module.bending_digest != said["digest"] for module in modules):
        return said["name"], " or ".join(module.name for module in modules), "mesh or material"
    walk = [(module.name, module.sheet_mm) for module in modules]
    bent, *named = (
        name if sheet_mm is None else f"{name} with a sheet of {sheet_mm:g} mm"
        for name, sheet_mm in [(said["name"], said["sheet_mm"]), *walk]
    )
    return bent, " or ".join(named), "sheet"
