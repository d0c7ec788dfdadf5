"""What tells legs apart that bend otherwise, for calibrations that were fitted to their bends."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.module import USUAL_SHEET_MM
from pneumorph.catalogue.paper_leg import LegName, leg_kind, load_default_leg, paper_leg

LEGS: tuple[LegName, ...] = ("published", "hyperelastic", "measured")


def digest(name: LegName, thickness_mm: float | None = None) -> str:
    """Of a reduction of a leg that ships, said to be of a sheet of another thickness."""
    part = load_default_leg(name)
    if thickness_mm is not None:
        made_of = replace(leg_kind(name).materials, sheet_thickness_mm=thickness_mm)
        said = {"materials": settings_to_dict(made_of)}
        part = replace(part, metadata={**part.metadata, **said})
    return paper_leg(name, part=part).bending_digest


@pytest.mark.parametrize("name", LEGS)
def test_legs_of_sheets_of_another_thickness_are_told_apart(name: LegName) -> None:
    """One that is as usual is that of earlier versions, which did not say it."""
    usual_mm = leg_kind(name).materials.sheet_thickness_mm
    assert usual_mm == USUAL_SHEET_MM[name == "measured"]
    found = [digest(name, factor * usual_mm) for factor in (1.0, 3.0, 5.0)]
    assert digest(name) == found[0]
    assert len(set(found)) == 3


def test_digests_of_legs_that_ship_are_those_that_calibrations_were_kept_with() -> None:
    kept = {"published": "3de0f21d119f", "hyperelastic": "8fb4138e7656", "measured": "4132df52ed22"}
    assert {name: paper_leg(name).bending_digest[:12] for name in LEGS} == kept
