"""What is resumed is of one hub and one height map, and of what earlier versions kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import leg_kind, load_default_leg, masses_of
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import paper_hub, paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_identity import (
    mounting_identity,
    reduction_digest,
    resume_identity,
)
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.simulation.randomisation import Randomisation, World

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"


@pytest.mark.parametrize("leg", ["measured", "published", "hyperelastic"])
def test_usual_robots_say_nothing_so_that_earlier_checkpoints_are_theirs(leg) -> None:
    usual = paper_robot(leg)
    assert resume_identity(usual) == {}
    line = usual.physics.pressure_map
    assert resume_identity(usual.calibrated(Calibration(line, modulus_factor=1.2))) == {}
    # The digest of a described robot's legs says its hub.
    assert resume_identity(RobotDescription.read(PLATE).spec()) == {}


@pytest.mark.parametrize("leg", ["measured", "published"])
def test_robots_of_other_hubs_are_told_apart(leg) -> None:
    usual = paper_robot(leg)
    model = masses_of(leg).model
    other = "published" if model == "cast" else "cast"
    hubs = [Masses(model, hub_mass_g=each) for each in (40.0, 41.0)] + [Masses(other)]
    told = [resume_identity(replace(usual, hub=paper_hub(each))) for each in hubs]
    assert len({each["hub_mass"] for each in told}) == 3
    assert told[0]["hub_mass"].startswith("40 g (")
    assert len({reduction_digest(replace(usual, hub=paper_hub(each))) for each in hubs}) == 1


def test_only_robots_that_are_put_on_the_floor_for_their_droop_say_so() -> None:
    """Usual legs end 7.4 mm above the floor and come down by 1.9 mm a degree: the usual deviation
    of a degree says nothing, so that what was kept of walks is theirs."""
    usual = paper_robot("measured")
    level = World.nominal(usual.physics)
    for own, drawn, says in ((0.0, -3.0, False), (0.0, 4.0, False), (0.0, 6.0, True),
                             (4.0, 2.0, True), (6.0, 0.0, True)):  # fmt: skip
        spec = replace(usual, mounting_angle_deg=own)
        world = replace(level, mounting_angle_deg=drawn)
        assert ("drooping" in mounting_identity(spec, [level, world])) == says, (own, drawn)
    for law, says in (("N(0, 1)", False), ("U(-6, 4)", False), ("U(3, 6)", True)):
        drawn = Randomisation(mounting_angle_deg=law)
        assert ("drooping" in resume_identity(usual, drawn)) == says, law
    high = replace(usual, physics=replace(usual.physics, start=StartPose(lift_mm=8.0)))
    deep = replace(level, mounting_angle_deg=6.0)
    assert mounting_identity(high, [deep]) == {}


def _moved(part: ReducedPart, count: int) -> ReducedPart:
    """With so many of its points on the skin as sheet."""
    names = part.contact_surface.copy()
    names[np.flatnonzero(names == "skin")[:count]] = "sheet"
    return replace(part, contact_surface=names)


def _with(part: ReducedPart, physics: Physics) -> RobotSpec:
    """The measured robot with another reduction."""
    masses = masses_of("measured")
    return paper_robot(module_of_leg("measured", part=part, masses=masses), physics, masses)


@pytest.mark.parametrize("name", ["long_wide", "short_narrow", "short_wide"])
def test_legs_of_the_catalogue_that_ships_say_nothing_of_their_points(
    name: str, tmp_path: Path
) -> None:
    """What was kept of their robots goes on."""
    file = tmp_path / "plate.toml"
    own = f'[modules.long]\ncatalogue = "{name}"'
    file.write_text(PLATE.read_text().replace('[modules.long]\nleg = "measured"', own))
    spec = RobotDescription.read(file).spec()
    assert spec.modules[0].reduced.digest() != load_default_leg("measured").digest()
    assert "contact_points" not in resume_identity(spec, measured_worlds())


def test_legs_whose_points_lie_on_other_surfaces_are_told_apart_where_friction_names_them() -> None:
    """Legs that ship say nothing, nor do others where only the hub's friction has a name."""
    usual = leg_kind("measured").physics
    named = replace(usual, friction_by_surface=(("skin", 0.4), ("sheet", 0.9)))
    ships = paper_robot("measured", named)
    module = ships.module
    level = World.nominal(named)
    assert resume_identity(ships) == mounting_identity(ships, [level]) == {}
    others = [_moved(module.reduced, count) for count in (1, 58)]
    assert {other.digest() for other in others} == {module.reduced.digest()}
    for identity in (resume_identity, lambda spec: mounting_identity(spec, [level])):
        told = [identity(_with(other, named)) for other in others]
        assert [list(each) for each in told] == [["contact_points"]] * 2
        assert told[0] != told[1]
        assert told[0] == identity(_with(others[0], named))
    bare = _with(others[0], usual)
    assert resume_identity(bare) == mounting_identity(bare, [level]) == {}
    # A whole robot's mesh says it.
    assert mounting_identity(_with(others[0], named), [level], "full") == {}


def test_surfaces_of_drawn_frictions_and_reductions_count_too(tmp_path: Path) -> None:
    usual = paper_robot("measured")
    other = _moved(usual.module.reduced, 5)
    file = other.save(tmp_path / "leg.npz")
    level = World.nominal(usual.physics)
    law = (("sheet", "U(0.2, 0.4)"),)
    in_world = replace(level, friction_by_surface=(("sheet", 0.3),))
    spec = _with(other, usual.physics)
    assert list(resume_identity(spec, Randomisation(friction_by_surface=law))) == ["contact_points"]
    assert list(mounting_identity(spec, [level, in_world])) == ["contact_points"]
    told = [
        resume_identity(usual, Randomisation(friction_by_surface=law, reductions=reductions))
        for reductions in ((), (file,))
    ]
    assert told[0] == {}
    assert list(told[1]) == ["contact_points"]
    assert mounting_identity(usual, [replace(in_world, reduction=str(file))]) != {}
    assert mounting_identity(usual, [replace(level, reduction=str(file))]) == {}


def test_areas_of_points_count_where_friction_depends_on_pressure() -> None:
    usual = leg_kind("measured").physics
    pressed = replace(usual, friction_pressure=FrictionPressure(exponent=-0.1, pressure_kPa=10.0))
    ships = paper_robot("measured", pressed)
    assert resume_identity(ships) == {}
    part = ships.module.reduced
    wider = replace(part, contact_area_mm2=2.0 * part.contact_area_mm2)
    assert wider.digest() == part.digest()
    assert list(resume_identity(_with(wider, pressed))) == ["contact_points"]
    assert resume_identity(_with(wider, usual)) == {}


def test_maps_of_one_name_are_told_apart(tmp_path: Path) -> None:
    file, told = tmp_path / "map.npy", []
    ground = Ground(map=HeightMap(file))
    spec = paper_robot("published", replace(leg_kind("published").physics, ground=ground))
    for height in (0.0, 1.0):
        np.save(file, np.full((4, 4), height))
        told.append(resume_identity(spec))
    assert told[0].keys() == {"map_digest"}
    assert told[0] != told[1]


@pytest.mark.parametrize(
    "ground", [Ground(), Ground(rough=RoughGround(4.0)), Ground(steps=Steps(rise_mm=5.0))]
)
def test_robots_that_are_lifted_above_uneven_ground_are_told_from_earlier_ones(ground) -> None:
    """Where worlds have a ground of their own, too; on a plane they start as they did."""
    usual = leg_kind("measured").physics
    told = {"lifted": "above the ground"}
    for start, is_lifted in ((StartPose(lift_mm=5.0), True), (StartPose(heading_deg=30.0), False)):
        spec = paper_robot("measured", replace(usual, ground=ground, start=start))
        uneven = told if is_lifted and not ground.is_plane else {}
        assert resume_identity(spec) == uneven
        assert resume_identity(spec, Randomisation()) == uneven
        assert mounting_identity(spec, [World.nominal(spec.physics)]) == uneven
        drawn = told if is_lifted else {}
        rough = replace(World.nominal(spec.physics), ground_roughness_mm=3.0)
        assert resume_identity(spec, Randomisation(ground_roughness_mm="U(0, 4)")) == drawn
        assert mounting_identity(spec, [World.nominal(spec.physics), rough]) == drawn
