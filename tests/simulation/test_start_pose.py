"""Robots put on the floor elsewhere, turned and lifted, in both models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import GAIT, PHYSICS, crawlers
from helpers.small_robot import small_robot

from pneumorph.environment.equal_designs import check_equal_starts
from pneumorph.geometry.pose import Pose
from pneumorph.physics.ground import Ground, Steps
from pneumorph.physics.physics import Physics
from pneumorph.physics.start_pose import StartPose
from pneumorph.report.physics_words import physics_words
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.stepper_settings import StepperSettings

ELSEWHERE = StartPose(x_mm=130.0, y_mm=-70.0, heading_deg=50.0)
PLACED = ELSEWHERE.pose(np.zeros((0, 3)))
TIGHT = StepperSettings(
    element_precision="double",
    tangent_tolerance_mm_per_s=0.0,
    contact_tolerance_mm_per_s=1e-7,
    contact_sweeps=2000,
)
SMALL = Physics(floor_height_mm=0.0, regulator_count=2, damping="objective")
COMMANDS = np.tile([20.0, 5.0], (8, 1))


def walked(physics: Physics) -> BatchedSimulator:
    """The first crawler after three commands."""
    simulator = BatchedSimulator(crawlers()[:1], physics, TIGHT, 1)
    for command in GAIT[:3]:
        simulator.advance(command[None], 20)
    return simulator


def test_a_plane_has_no_place_and_no_direction() -> None:
    """Robots dropped nose down land and walk on the same way elsewhere, turned; friction is solved
    to 1e-7 mm/s, which 0.6 s make into less than 1e-5 mm."""
    dropped = StartPose(lift_mm=60.0, pitch_deg=20.0, roll_deg=10.0)
    elsewhere = replace(dropped, x_mm=130.0, y_mm=-70.0, heading_deg=50.0)
    usual, turned = (
        walked(replace(PHYSICS, friction=0.3, start=start)).state(0)
        for start in (dropped, elsewhere)
    )
    assert np.linalg.norm(usual.position[:2]) > 1.0
    pose = PLACED
    np.testing.assert_allclose(turned.position, pose.apply(usual.position), atol=1e-5)
    np.testing.assert_allclose(turned.rotation, pose.rotation @ usual.rotation, atol=1e-6)
    np.testing.assert_allclose(turned.modes, usual.modes, atol=1e-4)


@pytest.mark.parametrize("soft", [False, True])
def test_finite_elements_start_there_as_well(soft: bool) -> None:
    """As above; eight steps, contacts solved to 1e-7 mm/s."""
    ends = []
    for start in (StartPose(), ELSEWHERE):
        robot = small_robot(replace(SMALL, start=start), soft=soft)
        state, _ = robot.rollout(robot.initial_state(), COMMANDS)
        ends.append(state)
    usual, turned = ends
    assert turned.active_contacts > 0
    for x, y in zip(usual.positions, turned.positions, strict=True):
        np.testing.assert_allclose(y, PLACED.apply(x), atol=1e-6)


def test_a_start_further_forward_meets_a_step_earlier() -> None:
    """The same step, as far from the robot."""
    ground = Ground(steps=Steps(rise_mm=4.0, start_mm=260.0, run_mm=20.0))
    nearer = replace(ground, steps=replace(ground.steps, start_mm=60.0))
    moved = walked(replace(PHYSICS, ground=ground, start=StartPose(x_mm=200.0)))
    there = walked(replace(PHYSICS, ground=nearer))
    expected = there.tracked_point_mm[0] + [200.0, 0.0, 0.0]
    np.testing.assert_allclose(moved.tracked_point_mm[0], expected, atol=1e-4)
    away = walked(replace(PHYSICS, ground=ground)).tracked_point_mm[0]
    assert np.abs(there.tracked_point_mm[0] - away).max() > 0.05  # the step does something


def test_what_is_lifted_falls_freely() -> None:
    """Linearly implicit Euler: after n steps of h the fall is g h^2 n (n + 1) / 2."""
    still = replace(SMALL, mass_damping_per_s=0.0, start=StartPose(lift_mm=200.0, roll_deg=180.0))
    robot = small_robot(still)
    start = robot.initial_state()
    end, _ = robot.rollout(start, np.zeros((10, 2)))
    fallen = robot.tracked_point_mm(start) - robot.tracked_point_mm(end)
    np.testing.assert_allclose(fallen, [0.0, 0.0, 9800.0 * 1e-4 * 55.0], atol=1e-6)
    assert robot.hub.frame(end.hub)[0][2, 2] == pytest.approx(-1.0)


def test_every_reset_puts_them_back() -> None:
    simulator = walked(replace(PHYSICS, start=ELSEWHERE))
    assert simulator.heading_deg[0] != pytest.approx(50.0, abs=1e-9)
    simulator.reset()
    np.testing.assert_array_equal(simulator.read("position")[0], [130.0, -70.0, 0.0])
    assert simulator.heading_deg[0] == pytest.approx(50.0, abs=1e-9)


@pytest.mark.parametrize(
    "start", [StartPose(roll_deg=180.0), StartPose(pitch_deg=70.0, lift_mm=5.0)]
)
def test_a_turned_robot_starts_where_it_touches_a_level_floor(start: StartPose) -> None:
    """Whatever its legs; a lift is above that. Other grounds are put below it, as deep."""
    physics = replace(PHYSICS, start=start)
    simulator = BatchedSimulator(crawlers(), physics)
    heights = []
    for number, robot in enumerate(crawlers()):
        pose = Pose(simulator.read("rotation")[number], simulator.read("position")[number])
        heights.append(pose.apply(robot.standing_points)[:, 2].min() - physics.floor_height_mm)
    np.testing.assert_allclose(heights, start.lift_mm, atol=1e-9)
    robot = small_robot(replace(SMALL, start=start))
    points = np.concatenate(robot.contact_positions(robot.initial_state()))
    assert robot.floor.gap(points).min() == pytest.approx(start.lift_mm, abs=1e-9)
    steps = Ground(steps=Steps(rise_mm=4.0, start_mm=400.0))  # beyond its legs: level below it
    uneven = replace(physics, ground=steps)
    points = crawlers()[0].standing_points
    gaps = uneven.floor(points).gap(uneven.start_pose(points).apply(points))
    assert gaps.min() == pytest.approx(start.lift_mm, abs=1e-9)
    robot = small_robot(replace(SMALL, start=start, ground=steps))
    points = np.concatenate(robot.contact_positions(robot.initial_state()))
    assert robot.floor.gap(points).min() == pytest.approx(start.lift_mm, abs=1e-9)


@pytest.mark.parametrize(
    ("start", "mirror", "turned"),
    [
        (StartPose(x_mm=5.0, lift_mm=3.0), True, True),
        (StartPose(heading_deg=30.0), False, True),
        (StartPose(heading_deg=180.0), True, True),
        (StartPose(pitch_deg=40.0), True, False),
        (StartPose(roll_deg=90.0), False, False),
        (StartPose(roll_deg=-180.0), True, False),
    ],
)
def test_designs_are_one_only_where_they_start_alike(
    start: StartPose, mirror: bool, turned: bool
) -> None:
    for symmetry, alike in (("mirror", mirror), ("1 2 3 0", turned)):
        space = DesignSpace(
            location_count=4,
            maximum_legs=4,
            symmetries=(symmetry,),
            mirror="radial" if symmetry == "mirror" else "none",
        )
        if alike:
            check_equal_starts(space, start)
            continue
        with pytest.raises(ValueError, match=f"count as one under '{symmetry}', and robots start"):
            check_equal_starts(space, start)
    if mirror:
        check_equal_starts(DesignSpace(), start)
    else:
        with pytest.raises(ValueError, match=r"have mirror images, and robots start with heading"):
            check_equal_starts(DesignSpace(), start)
    reflection, turn = np.diag([1.0, -1.0, 1.0]), start.pose(np.zeros((0, 3))).rotation
    assert np.allclose(reflection @ turn @ reflection, turn) == start.has_mirror


def test_it_is_told_and_kept_apart() -> None:
    turned = replace(PHYSICS, start=ELSEWHERE)
    assert "starts at 130, -70, 0 mm, turned by 50 degrees" in physics_words(turned)
    assert "starts" not in physics_words(PHYSICS)
    assert "start" not in PHYSICS.described()
    assert turned.described()["start"]["heading_deg"] == 50.0


@pytest.mark.parametrize("moved", [False, True])
def test_a_turned_robot_of_a_world_starts_on_the_worlds_own_ground(moved: bool) -> None:
    """On rough ground of its own as it does alone in that world, also once it is put back, and
    beside one on the plane of the batch."""
    physics, robot = replace(PHYSICS, start=StartPose(pitch_deg=45.0)), crawlers()[0]
    plane = World.nominal(physics)
    worlds = [plane, replace(plane, ground_roughness_mm=0.5, ground_seed=5)]
    batch = BatchedSimulator([robot] * 2, physics, TIGHT, 1, worlds)
    if moved:
        batch.advance(np.zeros((2, 2)), 3)
        batch.reset()
    for number, world in enumerate(worlds):
        own = world.applied_to(physics)
        alone = BatchedSimulator([robot], own, TIGHT, 1)
        for name in ("position", "rotation"):
            np.testing.assert_array_equal(batch.read(name)[number], alone.read(name)[0])
        pose = Pose(batch.read("rotation")[number], batch.read("position")[number])
        gap = own.floor(robot.standing_points).gap(pose.apply(robot.standing_points))
        assert gap.min() == pytest.approx(0.0, abs=1e-9)
