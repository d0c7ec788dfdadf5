"""Robots that would begin inside the floor are refused; those that begin on or above it walk."""

from dataclasses import replace

import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.start_pose import StartPose

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


def test_a_world_whose_legs_point_down_presses_them_on_the_floor(spec):
    drooping = with_physics(replace(spec, mounting_angle_deg=3.0), floor_height_mm=-5.5)
    assert drooping.assembly(DESIGN).standing_points[:, 2].min() < -6.5
