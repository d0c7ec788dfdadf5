"""A mounting angle points a leg further down, to whichever side it points and however it rolls."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.boxes import box_robot

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_identity import tilts_rolled_legs
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.robot.design import Design
from pneumorph.robot.mounting_angle import tilted
from pneumorph.robot.robot import Robot
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import robot_in_world
from pneumorph.study.full_order_identity import certified_walk_identity

NODES = np.array([[-4.0, -1.0, 0.0], [-4.0, 1.0, 2.0], [30.0, 1.0, -2.0], [30.0, -1.0, 3.0]])
INNER_END = np.array([-4.0, 0.0, 0.0])
CHAMBERS = Path(__file__).parents[2] / "examples" / "two_chambers.toml"
ROLLED = "1+2.0.2+2.0.0.1+1.0.1+2"
SIDES = [0.0, 38.0, 90.0, 135.0, 180.0, 225.0, -90.0, 315.0]


def mounted(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Pose:
    turn = rotation_about("z", yaw_deg) @ rotation_about("y", pitch_deg)
    return Pose(turn @ rotation_about("x", roll_deg), np.array([40.0, -7.0, 36.0]))


def down_deg(pose: Pose) -> float:
    return float(np.degrees(np.arcsin(-pose.rotation[2, 0])))


def assert_only_further_down(before: Pose, after: Pose, angle_deg: float) -> None:
    assert down_deg(after) - down_deg(before) == pytest.approx(angle_deg, abs=1e-9)
    aside_deg = (after.yaw_deg - before.yaw_deg + 180.0) % 360.0 - 180.0
    assert aside_deg == pytest.approx(0.0, abs=1e-8)
    assert after.roll_deg == pytest.approx(before.roll_deg, abs=1e-8)


@pytest.mark.parametrize("roll_deg", [45.0, -45.0, 90.0, -120.0, 180.0, 1e-3])
@pytest.mark.parametrize("yaw_deg", SIDES)
def test_a_rolled_leg_points_down_and_not_aside(yaw_deg: float, roll_deg: float) -> None:
    for pitch_deg in (15.0, 0.0, -20.0):
        before = mounted(yaw_deg, pitch_deg, roll_deg)
        for angle_deg in (5.0, -3.0):
            after = tilted(before, NODES, angle_deg)
            assert_only_further_down(before, after, angle_deg)
            np.testing.assert_allclose(after.apply(INNER_END), before.apply(INNER_END), atol=1e-12)


@pytest.mark.parametrize("yaw_deg", SIDES)
def test_a_leg_that_is_not_rolled_turns_about_its_own_y_axis_to_the_bit(yaw_deg: float) -> None:
    """As it always did: kept walks of such legs stay the same."""
    turn = rotation_about("y", 2.7)
    for pitch_deg in (15.0, 0.0, -20.0):
        before = mounted(yaw_deg, pitch_deg, 0.0)
        expected = before.compose(Pose(turn, INNER_END - turn @ INNER_END))
        after = tilted(before, NODES, 2.7)
        np.testing.assert_array_equal(after.rotation, expected.rotation)
        np.testing.assert_array_equal(after.translation, expected.translation)
        assert_only_further_down(before, after, 2.7)


@pytest.mark.parametrize("pitch_deg", [90.0, -90.0])
@pytest.mark.parametrize("roll_deg", [0.0, 45.0, 180.0])
def test_a_leg_that_points_straight_down_or_up_keeps_its_own_y_axis(
    pitch_deg: float, roll_deg: float
) -> None:
    before = mounted(60.0, pitch_deg, roll_deg)
    after = tilted(before, NODES, 4.0)
    np.testing.assert_array_equal(after.rotation, before.rotation @ rotation_about("y", 4.0))


def test_rolled_legs_of_reduced_robots_point_down_in_a_world() -> None:
    """Each side of the shipped robot, whose sites are rolled by 45 degrees one way or the other."""
    spec = RobotDescription.read(CHAMBERS).spec()
    world = replace(World.nominal(spec.physics), mounting_angle_deg=5.0)
    usual = spec.assembly(ROLLED)
    for tilted_robot in (spec.in_world(world).assembly(ROLLED), robot_in_world(usual, world)):
        assert isinstance(tilted_robot, Robot)
        for before, after in zip(usual.mounts, tilted_robot.mounts, strict=True):
            assert abs(before.pose.roll_deg) == pytest.approx(45.0)
            assert_only_further_down(before.pose, after.pose, 5.0)


def test_rolled_legs_of_full_robots_point_down_as_those_of_reduced_ones() -> None:
    spec = box_robot()
    sites = tuple(
        replace(site, pose=site.pose.compose(Pose(rotation_about("x", roll_deg))))
        for site, roll_deg in zip(spec.sites, (45.0, -90.0), strict=True)
    )
    # The boxes begin on the floor, which tilted ones may reach into.
    robot = replace(spec, sites=sites, mounting_angle_deg=5.0).full("1.2")
    for leg, site in zip(robot.legs, sites, strict=True):
        attached = leg.part.rest_nodes[leg.part.mesh.node_set("attachment")]
        pose = tilted(site.pose, leg.part.rest_nodes, 5.0)
        assert_only_further_down(site.pose, pose, 5.0)
        np.testing.assert_allclose(leg.attachment_in_hub, pose.apply(attached), atol=1e-12)


def test_what_was_kept_of_rolled_legs_in_a_tilted_world_is_walked_again() -> None:
    """Earlier versions turned these about their own axes; all else is found."""
    spec = box_robot()
    turned = Pose(rotation_about("x", 45.0))
    sites = tuple(replace(site, pose=site.pose.compose(turned)) for site in spec.sites)
    rolled, level = replace(spec, sites=sites), World.nominal(spec.physics)
    worlds = [level, replace(level, mounting_angle_deg=1.0)]
    assert tilts_rolled_legs(rolled, worlds)
    assert tilts_rolled_legs(replace(rolled, mounting_angle_deg=1.0), [])
    assert not tilts_rolled_legs(rolled, [level])
    assert not tilts_rolled_legs(spec, worlds)
    for each, told in ((rolled, True), (spec, False)):
        identity = certified_walk_identity(each, Design.parse("1.2"), 0, worlds[1])
        assert ("rolled" in identity) is told
