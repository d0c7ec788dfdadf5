"""Robots that would begin inside the floor, or far above it, are refused; others walk."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.floor_check import check_near_floor, check_payload_above_floor
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
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


@pytest.mark.parametrize("heading_deg", [0.0, 180.0])
@pytest.mark.parametrize(("x_mm", "floor_mm"), [(10.0, -10.0), (-40.0, -40.0)])
def test_a_payload_lies_above_the_ground_below_it(heading_deg, x_mm, floor_mm):
    """Feet at a height of -10 mm stand on a step of 30 mm, and others above what is before it."""
    points = np.array([[x, y, -10.0] for x in (-50.0, 50.0) for y in (-40.0, 40.0)])
    start = StartPose(lift_mm=3.0, heading_deg=heading_deg)
    ground = Ground(steps=Steps(30.0, start_mm=-20.0, run_mm=20.0))
    physics = Physics(floor_height_mm=-10.0, ground=ground, start=start)
    x_mm *= np.cos(np.deg2rad(heading_deg))
    for below_mm in (0.9, 1.1):
        place = np.array([x_mm, 0.0, floor_mm - 3.0 - below_mm])
        check_payload_above_floor(place, physics)  # of no design nothing is known
        if below_mm < 1.0:
            check_payload_above_floor(place, physics, points)
            continue
        with pytest.raises(ValueError, match=f"payload_mm .* and the floor at {floor_mm:g}, exp"):
            check_payload_above_floor(place, physics, points)


def test_what_is_rough_under_a_payload_does_not_count():
    """It is drawn in some worlds, in which the robot has to walk as in others."""
    points = np.array([[x, y, 0.0] for x in (-50.0, 50.0) for y in (-40.0, 40.0)])
    for seed in range(8):
        ground = Ground(rough=RoughGround(roughness_mm=8.0, seed=seed))
        physics = Physics(floor_height_mm=0.0, ground=ground)
        check_payload_above_floor(np.array([0.0, 0.0, -0.9]), physics, points)
        with pytest.raises(ValueError, match="the floor at 0, expected"):
            check_payload_above_floor(np.array([0.0, 0.0, -1.1]), physics, points)


BOX_MM = np.array([[x, y, z] for x in (-50, 50) for y in (-40, 40) for z in (0, 20)], dtype=float)
FEET_MM = np.array([[-60.0, 0.0, -90.0], [60.0, 0.0, -90.0]])


@pytest.mark.parametrize(
    ("physics", "fall_mm"),
    [
        (Physics(floor_height_mm=-330.0), 240.0),  # twice 120 mm, from toe to toe
        (Physics(floor_height_mm=-331.0), 241.0),
        (Physics(floor_height_mm=-2000.0, ground=Ground(rough=RoughGround(3.0))), 1910.0),
        (Physics(floor_height_mm=-361.0, ground=Ground(steps=Steps(15.0, count=2))), 241.0),
        (Physics(floor_height_mm=-331.0, start=StartPose(lift_mm=100.0)), 241.0),
        (Physics(floor_height_mm=-320.0, start=StartPose(roll_deg=180.0)), 300.0),
    ],
)
def test_a_floor_far_below_the_robot_is_refused(physics, fall_mm):
    if fall_mm <= 240.0:
        check_near_floor(BOX_MM, lambda: [FEET_MM], physics)
        return
    with pytest.raises(ValueError, match=rf"floor_height_mm is -\d+, {fall_mm:g} mm below the rob"):
        check_near_floor(BOX_MM, lambda: [FEET_MM], physics)


def test_what_is_to_fall_or_float_may_be_high_and_legs_are_read_where_they_matter():
    def unread() -> list[np.ndarray]:
        raise AssertionError("the hub alone is near the floor")

    for physics in (
        Physics(),
        Physics(start=StartPose(lift_mm=1e3)),
        Physics(floor_height_mm=-1e4, gravity_mm_per_s2=0.0),
        Physics(floor_height_mm=-1e4, ground=Ground(HeightMap(Path("of_any_zero.npy")))),
    ):
        check_near_floor(BOX_MM, unread, physics)


def test_robots_of_options_and_of_files_are_not_put_far_above_their_floor():
    far = RobotOptions.of("measured")
    with pytest.raises(ValueError, match=r"floor_height_mm is -2000, 1995 mm below the robot"):
        replace(far, physics=replace(far.physics, floor_height_mm=-2000.0)).spec()
    plate = RobotDescription.read(Path(__file__).parents[2] / "examples/plate.toml")
    with pytest.raises(ArtefactError, match=r"plate\.toml: .* is -2000, .* its longest side"):
        plate.spec(replace(plate.acting, floor_height_mm=-2000.0))
