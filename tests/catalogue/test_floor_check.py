"""Robots that would begin inside the floor are refused; those that begin on or above it walk."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.start_pose import StartPose
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import robot_in_world

DESIGN = "1.0.0.2.2.0.0.1"


@pytest.fixture(scope="module")
def spec() -> RobotSpec:
    return paper_robot()


def with_physics(spec: RobotSpec, **changes: object) -> RobotSpec:
    return replace(spec, physics=replace(spec.physics, **changes))


@pytest.mark.parametrize("made", ["assembly", "reduced", "full"])
def test_a_robot_inside_the_floor_is_refused_however_it_is_made(spec, made):
    high = with_physics(spec, floor_height_mm=0.0)
    with pytest.raises(ValueError, match=r"floor_height_mm is 0 .* -5\.424 mm .* 5\.42 mm inside"):
        getattr(high, made)(DESIGN)


def test_what_starts_on_the_floor_above_it_or_is_put_there_walks(spec):
    for physics in (
        {},
        {"floor_height_mm": -5.5},
        {"floor_height_mm": 0.0, "start": StartPose(lift_mm=8.0)},
        {"floor_height_mm": 0.0, "start": StartPose(roll_deg=180.0)},
        {"floor_height_mm": 0.0, "ground": Ground(rough=RoughGround(3.0))},
    ):
        assert with_physics(spec, **physics).assembly(DESIGN).mounts


@pytest.mark.parametrize("leg", ["published", "measured"])
@pytest.mark.parametrize("angle_deg", [5.0, 10.0])
def test_legs_that_droop_deep_carry_the_robot_from_the_start(leg, angle_deg):
    """Ten degrees began 11.5 mm inside the floor, which threw the published robot's hub up by 56
    mm: it was in the air when settling ended. Legs that touch the floor bear it, and it sinks."""
    spec = RobotOptions.of(leg).spec()
    drooping = with_physics(replace(spec, mounting_angle_deg=angle_deg), floor_height_mm=-5.5)
    simulator = drooping.simulator([DESIGN])
    start_mm = simulator.read("position")[0, 2]
    standing = drooping.assembly(DESIGN).standing_points[:, 2].min()
    assert start_mm == pytest.approx(-5.5 - standing)
    full = drooping.full(DESIGN)
    legs = zip(full.legs, full.initial_state().positions, strict=True)
    lowest = min((leg.contact_weights @ places)[:, 2].min() for leg, places in legs)
    assert lowest == pytest.approx(-5.5)
    simulator.advance(np.zeros((1, drooping.physics.regulator_count)), 15)
    assert simulator.read("active_contacts")[0] > 0
    assert simulator.read("position")[0, 2] < start_mm
    in_world = replace(World.nominal(spec.physics), mounting_angle_deg=angle_deg)
    level = with_physics(spec, floor_height_mm=-5.5)
    drawn = robot_in_world(level.assembly(DESIGN), in_world)
    together = BatchedSimulator([drawn], level.physics, level.stepper, 1, [in_world])
    assert together.read("position")[0, 2] == pytest.approx(start_mm)


def test_a_world_whose_legs_point_down_presses_them_on_the_floor(spec):
    drooping = with_physics(replace(spec, mounting_angle_deg=3.0), floor_height_mm=-5.5)
    points = drooping.assembly(DESIGN).standing_points
    assert points[:, 2].min() < -6.5
    # By as much as legs give way; beyond that they are put on the floor.
    for inside_mm, raised_mm in ((1.99, 0.0), (2.01, 2.01)):
        floor_mm = float(points[:, 2].min()) + inside_mm
        start = replace(drooping.physics, floor_height_mm=floor_mm).start_pose(points)
        assert start.translation[2] == pytest.approx(raised_mm)
