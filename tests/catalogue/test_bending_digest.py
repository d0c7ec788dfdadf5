"""What tells legs apart that bend otherwise, for calibrations that were fitted to their bends."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.calibration_check import bent_leg, check_calibration
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, load_default_leg
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.module import Module
from pneumorph.fem.material import LegMaterials
from pneumorph.physics.calibration import Calibration

LEGS: tuple[LegName, ...] = ("published", "hyperelastic", "measured")


def leg(name: LegName, factor: float, size_factor: float = 1.0) -> Module:
    """A leg that ships, said to be of a sheet so many times as thick."""
    part, materials = load_default_leg(name), leg_kind(name).materials
    made_of = replace(materials, sheet_thickness_mm=factor * materials.sheet_thickness_mm)
    said = {"materials": settings_to_dict(made_of)}
    part = replace(part, metadata={**part.metadata, **said})
    return module_of_leg(name, part=part, size_factor=size_factor)


def calibrations(name: LegName, said: dict[str, Any]) -> list[Calibration]:
    """A line that was fitted to the bends of what is said, and a modulus relative to it."""
    line = leg_kind(name).physics.pressure_map
    relative = {"bench": {"relative_to": {"modulus_factor": said}}}
    return [
        Calibration(line, source={"pressure": {"bent": said}}),
        Calibration(line, source=relative, measured={"modulus_factor": (0.9, 0.01)}),
    ]


@pytest.mark.parametrize("name", LEGS)
def test_digests_are_those_of_earlier_versions_whatever_the_sheet(name: LegName) -> None:
    """What they fitted to a leg of any sheet is that leg's still."""
    kept = {"published": "3de0f21d119f", "hyperelastic": "8fb4138e7656", "measured": "4132df52ed22"}
    for module in (module_of_leg(name), leg(name, 1.0), leg(name, 3.0)):
        assert module.bending_digest[:12] == kept[name]
        earlier = {"name": module.name, "digest": module.bending_digest}
        for calibration in calibrations(name, earlier):
            check_calibration(calibration, [module])


@pytest.mark.parametrize("name", LEGS)
def test_legs_of_sheets_of_another_thickness_are_told_apart_by_both(name: LegName) -> None:
    usual, thick = leg(name, 1.0), leg(name, 3.0)
    own_mm = leg_kind(name).materials.sheet_thickness_mm
    assert bent_leg(thick)["sheet_mm"] == 3.0 * own_mm
    for calibration in calibrations(name, bent_leg(thick)):
        for modules in ([thick], [usual, thick], [thick.with_fewer_modes(8)]):
            check_calibration(calibration, modules)
        with pytest.raises(
            ValueError,
            match=rf"leg that ships with a sheet of {3.0 * own_mm:g} mm, expected .*"
            rf"leg that ships with a sheet of {own_mm:g} mm.* legs of another sheet ",
        ):
            check_calibration(calibration, [usual])
    # Rounding is no other sheet, and one in another size has another.
    rounded = {**bent_leg(usual), "sheet_mm": own_mm * (1.0 + 1e-12)}
    check_calibration(calibrations(name, rounded)[0], [usual])
    assert leg(name, 1.0, 1.5).sheet_mm == pytest.approx(1.5 * own_mm)


def test_parts_that_do_not_know_their_sheet_do_not_say_it() -> None:
    """The published leg that ships knows none."""
    unknown = module_of_leg("published")
    assert "sheet_mm" not in bent_leg(unknown)
    for calibration in calibrations("published", bent_leg(unknown)):
        check_calibration(calibration, [leg("published", 3.0)])


def test_a_part_without_a_sheet_has_no_thickness_of_one() -> None:
    part = load_default_leg("measured")
    said = {"materials": settings_to_dict(LegMaterials()), "point_counts": {"membrane": 0}}
    bare = replace(part, metadata={**part.metadata, **said})
    assert bare.sheet_thickness_mm is None
