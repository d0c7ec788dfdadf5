"""The way from the published simulation to the measured one changes one thing at a time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.artefact import read_json
from pneumorph.catalogue.leg_kinds import leg_kind, masses_of

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


def test_an_arc_holds_its_share_across_north(reality: Any) -> None:
    """Percentiles of 10, 30, 290 and 350 degrees would span half of what has no angle in it."""
    from expert_in_worlds import on_arc, shortest_arc

    arc = shortest_arc(np.array([10.0, 30.0, 290.0, 350.0]), 0.75)
    assert arc == [350.0, 30.0]
    assert on_arc(0.0, arc)
    assert on_arc(30.0, arc)
    assert not on_arc(110.0, arc)
    assert shortest_arc(np.array([10.0, 30.0, 290.0, 350.0]), 1.0) == [290.0, 30.0]
    assert not on_arc(110.0, [10.0, 30.0])
    assert on_arc(110.0, [110.0, 110.0])


def test_bands_are_of_the_worlds_and_contain_what_they_span(reality: Any) -> None:
    """Five worlds whose robots go 0 to 4 cm at 110 degrees, and best at 350 or 10."""
    from expert_in_worlds import PHASES_DEG, bands, measured_worlds

    from pneumorph.study.robustness import draw_worlds

    at = PHASES_DEG.index(110)
    made = []
    for k in range(5):
        distance = [0.0] * len(PHASES_DEG)
        distance[at], distance[-1 if k % 2 else 0] = float(k), 9.0
        slides = [1.0 + 0.1 * k] * len(PHASES_DEG)
        ratios = [2.0 if k == 4 else 1.0] * len(PHASES_DEG)
        made.append({"distance_cm": distance, "backsliding_cm": slides, "range_ratio": ratios})
    found = bands(made, draw_worlds(measured_worlds(), 5, 0))
    assert found["bands"]["distance_cm"] == pytest.approx([0.4, 2.0, 3.6])
    assert found["bands"]["best_phase_deg"] == [350.0, 10.0]
    assert found["bands"]["backsliding_cm"] == pytest.approx([1.04, 1.2, 1.36])
    # 4 to 5 cm begin beyond the band, 110 is not between 350 and 10, and 1.2 is in the middle.
    assert found["contained"] == {
        "distance_cm": False,
        "best_phase_deg": False,
        "backsliding_cm": True,
    }
    assert found["left_range_share"] == pytest.approx(0.2)
    assert [each["best_phase_deg"] for each in found["in_world"]] == [10, 350, 10, 350, 10]


def test_the_summary_that_is_kept_follows_from_its_bands(reality: Any) -> None:
    """Of the leg that ships today; its keys are those that others read."""
    from statements import summary

    kept = read_json(HERE / "summary.json", "JSON")
    found = summary(kept["expert"])
    assert found.keys() == kept.keys()
    counted = [each["contained"] for each in found["bends"]]
    assert counted == [each["contained"] for each in kept["bends"]]
    for ours, theirs in zip(found["bends"], kept["bends"], strict=True):
        assert ours["band_deg"] == pytest.approx(theirs["band_deg"], abs=1e-6)
    assert len(found["beam"]) == 9
    assert found["beam"] == kept["beam"]
    for name in ("bend_slope", "bend_mean_error_percent", "statements_contained"):
        assert found[name] == pytest.approx(kept[name])
    assert found["statements_total"] == 13
    assert found["expert_band_cm"] == kept["expert"]["measured"]["bands"]["distance_cm"]
