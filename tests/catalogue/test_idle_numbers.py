"""Which numbers of drawn worlds change nothing of a robot, and what is said of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.idle_numbers import idle_notes, idle_numbers
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World

ROBOT = paper_robot()


def ends(spec: RobotSpec, *worlds: World) -> np.ndarray:
    """Where the expert's robot is in each world after two legs were inflated for 0.4 s."""
    robot = spec.assembly(Design.parse("1.0.0.2.2.0.0.1"))
    simulator = spec.simulator_in_worlds([robot] * len(worlds), list(worlds))
    for _ in range(4):
        simulator.advance(np.full((len(worlds), 3), 40.0), 10)
    return np.array(simulator.forward_position_mm)


def test_friction_of_no_surface_changes_nothing_and_is_nobodys_to_measure() -> None:
    drawn = measured_worlds()
    world = drawn.draw(np.random.default_rng(1))
    idle = idle_numbers(ROBOT, drawn)
    assert idle == {"friction"}
    other = replace(world, friction=world.friction + 0.5)
    slippery = replace(world, friction_by_surface=(("sheet", 0.3), ("skin", 0.3), ("hub", 0.3)))
    one, same, another = ends(ROBOT, world, other, slippery)
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - another).max() > 1e-3


def test_friction_counts_where_a_surface_has_none_of_its_own() -> None:
    drawn = replace(measured_worlds(), friction_by_surface=(("skin", "U(0.4, 0.7)"),))
    assert "friction" not in idle_numbers(ROBOT, drawn)
    world = drawn.draw(np.random.default_rng(1))
    one, another = ends(ROBOT, world, replace(world, friction=world.friction + 0.5))
    assert np.abs(one - another).max() > 1e-3


def test_valves_and_surfaces_that_a_robot_has_not_are_idle() -> None:
    published = paper_robot("published")
    assert published.physics.air.law == "rate_limit"
    drawn = Randomisation(friction_by_surface=(("heel", "U(0.4, 0.7)"),))
    assert idle_numbers(published, drawn) == {"filling_factor", "venting_factor", "friction heel"}
    told = idle_notes(published, replace(drawn, filling_factor="U(0.5, 2)"))
    assert [note.split(" changes ")[0] for note in told] == [
        "randomisation.filling_factor",
        "randomisation.friction heel",
    ]


def test_friction_counts_where_legs_may_be_of_another_reduction() -> None:
    """Whose contact points may lie on surfaces without a name."""
    assert idle_numbers(ROBOT, measured_worlds((Path("other.npz"),))) == frozenset()


@pytest.mark.parametrize(
    "drawn",
    [measured_worlds(), Randomisation(), replace(measured_worlds(), friction="U(0.250, 1.2)")],
)
def test_nothing_is_said_of_friction_that_nobody_asked_for(drawn: Randomisation) -> None:
    assert idle_notes(ROBOT, drawn) == ()


def test_friction_that_was_asked_for_and_changes_nothing_is_told() -> None:
    asked = replace(measured_worlds(), friction="U(0.4, 0.7)")
    (note,) = idle_notes(ROBOT, asked)
    assert note.startswith(
        "randomisation.friction changes nothing: every surface (hub, sheet, skin)"
    )
    assert idle_notes(ROBOT, replace(asked, friction_by_surface=())) == ()


def test_friction_that_no_world_changes_is_told() -> None:
    """A hub of another surface, whose friction the physics name and the worlds do not."""
    given = replace(ROBOT.physics, friction_by_surface=(("birch", 0.3),))
    spec = replace(ROBOT, physics=given, hub=replace(ROBOT.hub, surface="birch"))
    (note,) = idle_notes(spec, measured_worlds())
    assert note.startswith("friction birch is 0.3 in all worlds")
    drawn = measured_worlds()
    birch = (*drawn.friction_by_surface, ("birch", "U(0.2, 0.5)"))
    told = idle_notes(spec, replace(drawn, friction_by_surface=birch))
    assert not any("in all worlds" in note for note in told)


def test_friction_of_the_physics_that_drawn_worlds_do_not_have_is_told() -> None:
    given = replace(ROBOT.physics, friction=0.3, friction_by_surface=(("hub", 0.4),))
    spec = replace(ROBOT, physics=given)
    told = idle_notes(spec, measured_worlds())
    assert [note.split(" of the physics")[0] for note in told] == [
        "friction 0.3",
        "friction hub 0.4",
    ]
    every = (*given.friction_by_surface, ("sheet", 0.5), ("skin", 0.5))
    named = replace(ROBOT, physics=replace(given, friction_by_surface=every))
    assert not any(note.startswith("friction 0.3") for note in idle_notes(named, measured_worlds()))
    asked = replace(ROBOT, physics=replace(ROBOT.physics, friction=1.2))
    assert idle_notes(asked, measured_worlds())[0].startswith("friction 1.2 of the physics")
    known = replace(measured_worlds(), friction="0.3", friction_by_surface=(("hub", "0.4"),))
    assert idle_notes(spec, known) == ()
