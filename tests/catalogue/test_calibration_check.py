"""Calibrations know the leg that they are of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part

from pneumorph.catalogue.calibration_check import (
    RELATIVE_TO,
    bent_leg,
    calibration_note,
    check_calibration,
    relative_to,
)
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.fem.material import Material
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart

PART = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
FILE = Path("measured.json")


def module(name: str, part: ReducedPart = PART, line: PressureMap | None = None) -> Module:
    full = synthetic_part((4, 4, 4))
    return Module(name, lambda: part, lambda *_: full, pressure_map=line)


def fitted_to(bent: Module) -> Calibration:
    said = {"bent": {"name": bent.name, "digest": bent.bending_digest}}
    return Calibration(source={"pressure": said}, path=FILE)


def test_a_line_of_another_legs_bends_is_refused_by_both_names() -> None:
    """Another reduction of the leg, or the leg under another modulus, is the same leg; one of
    another material or mesh is not."""
    own = module("own leg")
    stiffer = replace(PART, tetrahedron_material=Material(1300.0, 0.49))
    finer = synthetic_reduced_part(mode_count=4, cells=(6, 4, 4))
    again = replace(PART, membrane_weight=2.0 * PART.membrane_weight)
    for same in (own, own.scaled(1.3), module("own leg, reduced again", again)):
        check_calibration(fitted_to(same), [own])
    for other in (stiffer, finer):
        with pytest.raises(ValueError, match="json was fitted to the bends of other leg, expected"):
            check_calibration(fitted_to(module("other leg", other)), [own])
    # One of several modules was bent.
    check_calibration(fitted_to(own), [module("other leg", stiffer), own])


def test_a_line_without_a_leg_is_refused_where_it_asks_for_other_pressures() -> None:
    """At 90 kPa of the real leg the published one takes 347 kPa, the measured one 90."""
    measured = module("the measured leg", line=PressureMap(1.0, 0.0))
    with pytest.raises(ValueError, match=r"leg with 347 kPa for 90 kPa .* some 90 kPa.* published"):
        check_calibration(Calibration(PressureMap(), path=FILE), [measured])
    published = module("the published leg", line=PressureMap())
    with pytest.raises(ValueError, match=r"with 90 kPa .* expected some 347 kPa.* the measured"):
        check_calibration(Calibration(PressureMap(1.0, 0.0)), [published])
    # A real leg twice as soft, or as stiff, as the simulated one is still one.
    for slope in (0.5, 2.0):
        check_calibration(Calibration(PressureMap(slope, 0.0)), [measured])
    # Nothing is known of a part of one's own.
    check_calibration(Calibration(PressureMap()), [module("own leg")])


def test_a_line_of_the_legs_own_bends_in_other_units_is_refused() -> None:
    """Pressures in Pa under a header of kPa, or bends in radians under one of degrees."""
    measured = module("the measured leg", line=PressureMap(1.0, 0.0))
    for slope in (0.001, 0.02, 1000.0):
        line = replace(fitted_to(measured), pressure_map=PressureMap(slope, 0.0))
        with pytest.raises(ValueError, match=r"some 90 kPa: .* another unit .* not in degrees"):
            check_calibration(line, [measured])
    for slope in (0.5, 2.0):
        line = replace(fitted_to(measured), pressure_map=PressureMap(slope, 0.0))
        check_calibration(line, [measured])


def test_legs_beside_the_one_that_was_measured_are_told() -> None:
    own = module("own leg")
    stiffer = replace(PART, tetrahedron_material=Material(1300.0, 0.49))
    mixed = [own, module("other leg", stiffer)]
    line = fitted_to(own)
    assert calibration_note(line, [own, own.scaled(1.3)]) is None
    assert calibration_note(Calibration(PressureMap(), path=FILE), mixed) is None
    assert calibration_note(line, mixed) == (
        "calibration measured.json: pressures were measured of own leg, not of other leg: they are "
        "taken for all of these"
    )
    numbers = {"mass_factor": (1.1, 0.01), "modulus_factor": (0.9, 0.02)}
    bench = {"bench": {RELATIVE_TO: relative_to(numbers, [own])}}
    tested = Calibration(source=bench, measured=numbers)
    assert calibration_note(tested, [own]) is None
    heavy = [own, own.scaled(mass_factor=1.2)]
    assert calibration_note(tested, heavy) == (
        "the calibration: the masses of drawn worlds were measured of own leg, not of own leg: "
        "they are taken for all of these"
    )
    note = calibration_note(tested, mixed)
    assert note is not None
    assert "the moduli of drawn worlds were measured of own leg, not of other leg" in note
    assert "masses" not in note


def test_a_robot_of_several_kinds_tells_which_were_not_measured() -> None:
    spec = RobotDescription.read(Path(__file__).parents[2] / "examples/plate.toml").spec()
    long, short = spec.modules
    assert spec.calibration_notes == ()
    line = PressureMap(1.1, 0.0)
    of_long = spec.calibrated(Calibration(line, source={"pressure": {"bent": bent_leg(long)}}))
    (note,) = of_long.calibration_notes
    assert f"pressures were measured of {long.name}, not of {short.name}" in note
    assert RobotOptions().notes(None, of_long) == (note,)
    assert spec.calibrated(Calibration(line)).calibration_notes == ()
