"""Two-chamber legs turn their robot to the side that they are mounted to bend away from."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.description_notes import forbidden_note
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.robot_to_make import described_robot_to_make
from pneumorph.fabrication.solid import surface_of
from pneumorph.fabrication.wall_thickness import wall_thickness_mm
from pneumorph.simulation.rollout import rollout
from pneumorph.study.module_catalogue import read_catalogue, shipped_catalogue

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_chambers.toml"


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return RobotDescription.read(EXAMPLE)


def yaw_deg(spec: RobotSpec, design: str, pressures_kPa: list[float]) -> float:
    """How far the hub has turned to the left after 0.3 s at real pressures, floating."""
    floating = replace(spec, physics=replace(spec.physics, gravity_mm_per_s2=0.0))
    commands = np.tile(pressures_kPa, (30, 1))
    _, walked = rollout(floating.reduced(design), commands, record_every=30, settling_steps=0)
    turned = walked.hub_rotation[-1]
    # Four legs alike: the hub neither tilts nor drifts sideways, but for rounding.
    assert abs(turned[2, :2]).max() < 1e-6
    assert abs(walked.hub_position_mm[-1, :2] - walked.hub_position_mm[0, :2]).max() < 1e-4
    return float(np.degrees(np.arctan2(turned[1, 0], turned[0, 0])))


def test_legs_turn_it_to_the_side_that_they_bend_to(robot: RobotDescription) -> None:
    """The robot whose legs bend to the other side is its mirror image, with left and right chambers
    exchanged, and so are the turns, to the error of its legs' reduction, a percent of the bend. A
    floating hub turns the other way than its legs."""
    spec, pressures = robot.spec(), [60.0, 30.0, 0.0, 0.0]
    bent_left = yaw_deg(spec, "1+2.0.1+2.0.1+2.0.1+2.0", pressures)
    bent_right = yaw_deg(spec, "0.2+1.0.2+1.0.2+1.0.2+1", pressures)
    assert bent_left < -0.5
    assert bent_right == pytest.approx(-bent_left, rel=1e-2)


def test_its_catalogue_has_its_leg() -> None:
    """By the name, and with the physics, that the robot's file says; nothing has to be built."""
    described = RobotDescription.read(EXAMPLE)
    (module,) = described.modules.values()
    leg = read_catalogue(shipped_catalogue())[str(module.catalogue)]
    assert leg.leg == described.physics.based_on
    assert leg.mesh.leg.middle_wall_mm > 0.0
    assert described.spec().modules[0].reduced.cavity_count == 2


def test_robots_that_are_turned_by_a_quarter_count_once(robot: RobotDescription) -> None:
    """Counted by Burnside's lemma: the mean, over the four turns, of the robots that each leaves as
    they are. Of these the sides that legs bend to and the names of eight chambers' regulators are
    told apart by the same turn."""

    def named(chambers: tuple[int, ...]) -> tuple[int, ...]:
        names: dict[int, int] = {}
        return tuple(names.setdefault(each, len(names)) for each in chambers)

    sides = list(product(range(2), repeat=4))
    regulators = {named(chambers) for chambers in product(range(4), repeat=8)}
    kept = 0
    for turn in range(4):
        same_sides = sum(each == each[turn:] + each[:turn] for each in sides)
        same_names = sum(each == named(each[2 * turn :] + each[: 2 * turn]) for each in regulators)
        kept += same_sides * same_names
    assert len(robot.space) == kept / 4 == 11298
    assert all(len(each.regulators) == 2 for each in robot.space.first.fittings)


def test_its_hub_is_printed_of_the_usual_material(robot: RobotDescription) -> None:
    """Its file says a mass alone; what is built of it is weighed beside that."""
    settings = FabricationSettings()
    made = described_robot_to_make(robot.usual_design, robot, robot.spec(), settings)
    assert made.hub.density_g_per_ml == settings.hub.density_g_per_ml
    assert made.hub.simulated_mass_g == pytest.approx(30.0858)


def test_legs_in_one_place_are_not_built_and_walk_with_a_word(robot: RobotDescription) -> None:
    """A site to each side of a place, of which one carries a leg."""
    both = "1+1.1+1.0.2+2.0.1+1.0.2+2"
    with pytest.raises(ValueError, match="has legs at front left, bends left and front left, ben"):
        described_robot_to_make(both, robot, robot.spec(), FabricationSettings())
    note = forbidden_note(robot, both)
    assert note is not None
    assert "exclusions allow one leg at most at front left, bends left and" in note
    assert forbidden_note(robot, robot.usual_design) is None


def test_its_hub_weighs_in_print_what_it_does_in_the_simulation(robot: RobotDescription) -> None:
    """Within a twentieth, half of what `fabricate` warns of; thinner walls would not print."""
    pytest.importorskip("netgen.occ")
    made = described_robot_to_make(
        "1+2.0.0.3+4.1+2.0.3+4.0", robot, robot.spec(), FabricationSettings()
    )
    assert made.hub.solid is not None
    printed_g = 1e-3 * made.hub.density_g_per_ml * sum(each.mass for each in made.hub.solid.solids)
    assert printed_g == pytest.approx(made.hub.simulated_mass_g, rel=0.05)
    thinnest = wall_thickness_mm(surface_of(made.hub.solid, 8.0), 5.0).min()
    assert thinnest > FabricationSettings().hub.smallest_wall_mm
