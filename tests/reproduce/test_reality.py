"""The way from the published simulation to the measured one changes one thing at a time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.artefact import read_json
from pneumorph.catalogue.paper_leg import leg_kind, masses_of

HERE = Path(__file__).parent.parent.parent / "reproduce" / "reality"
CHANGES = {
    "to_scale": {
        "materials.silicone.young_modulus_kPa",
        "materials.sheet.young_modulus_kPa",
        "masses.model",
        "physics.pressure_map.slope",
        "physics.pressure_map.intercept_kPa",
    },
    "law": {
        "leg",
        "materials.silicone",
        "materials.sheet",
        "materials.sheet_thickness_mm",
        "materials.mass_lumping",
        "materials.mass_kg",
        "hub_model",
        "physics.pressure_map.slope",
        "physics.pressure_map.intercept_kPa",
        "full_order.integrator",
        "full_order.newton_matrix",
        "full_order.displacement_tolerance_mm",
    },
    "damping": {
        "materials.relaxation",
        "physics.damping",
        "physics.mass_damping_per_s",
        "physics.stiffness_damping_s",
    },
    "air": {"physics.air.law", "physics.air.chamber_growth"},
    "friction": {"physics.friction", "physics.friction_by_surface"},
    "mesh": {"edge_mm"},
}
"""What each step may replace, and does; what is named as a whole may differ in any of its parts."""


@pytest.fixture(scope="module")
def reality() -> Iterator[Any]:
    """The script, which imports its neighbours."""
    sys.path.insert(0, str(HERE))
    try:
        import run as script

        yield script
    finally:
        sys.path.remove(str(HERE))
        for name in ("run", "expert_in_worlds", "statements"):
            sys.modules.pop(name, None)


def differences(before: Any, after: Any, name: str = "") -> set[str]:
    """Names of the settings that two have not in common."""
    if before == after:
        return set()
    if is_dataclass(before) and type(before) is type(after):
        return {
            found
            for each in fields(before)
            for found in differences(
                getattr(before, each.name),
                getattr(after, each.name),
                f"{name}.{each.name}".lstrip("."),
            )
        }
    return {name}


def _named(found: set[str], allowed: set[str]) -> set[str]:
    """The allowed names that the found ones are of, and the found ones that are of none."""
    return {
        next((each for each in allowed if one == each or one.startswith(f"{each}.")), one)
        for one in found
    }


def test_each_step_changes_what_its_name_says_and_nothing_else(reality: Any) -> None:
    steps = list(reality.STEPS.items())
    assert [name for name, _ in steps] == ["published", *CHANGES]
    for (_, before), (name, after) in pairwise(steps):
        found = differences(before.made_of, after.made_of)
        assert _named(found, CHANGES[name]) == CHANGES[name], name


def test_the_way_begins_and_ends_at_the_two_physics(reality: Any) -> None:
    """What ships by each name; the mesh that comes last is finer than the one that does."""
    for step, name in (("published", "published"), ("friction", "measured")):
        made_of, kind = reality.STEPS[step].made_of, leg_kind(name)
        assert made_of.leg == name
        assert made_of.physics == kind.physics
        assert made_of.materials == kind.materials
        assert made_of.full_order == kind.full_order
        assert made_of.hub_model == kind.hub_model
        assert made_of.masses == masses_of(name)
    assert reality.STEPS["mesh"].robots == ("expert",)
    walked = read_json(HERE / "steps.json", "JSON")
    for robot, walks in walked.items():
        assert robot in reality.ROBOTS
        assert set(walks) <= set(reality.STEPS)


@pytest.mark.parametrize("step", ["published", "to_scale", "law", "damping", "air", "friction"])
def test_robots_of_all_steps_can_be_built(reality: Any, step: str) -> None:
    """The ingredients go into the robot as they are."""
    made_of = reality.STEPS[step].made_of
    spec = made_of.robot()
    assert spec.physics == made_of.physics
    assert spec.full_order == made_of.full_order
    part = spec.module.full
    assert part.material == made_of.materials.silicone
    assert (part.branches is None) == (not made_of.materials.relaxation.weights)
    # A leg that is cast weighs the same by either mesh, within what the meshes' volumes differ by.
    cast = made_of.masses.model == "cast"
    assert part.mass_kg == pytest.approx(0.0468 if cast else 0.105, rel=2e-3)
