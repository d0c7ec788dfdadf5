"""The margin of a leg is told by its forces alone, and obeys Coulomb's law."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.crawlers import GAIT, PART, PHYSICS, STEPPER, crawlers
from helpers.small_robot import small_robot

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.friction_margin import SLIP_MM_PER_S, friction_margin, point_contacts
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.study.analysis import leg_friction
from pneumorph.trajectory import Trajectory


def trajectory(force: np.ndarray, velocity: np.ndarray) -> Trajectory:
    """A recording of forces [mN] and velocities [mm/s], (frame, leg, point, 3)."""
    count = len(force)
    return Trajectory(
        time_s=np.arange(count) / 10.0,
        hub_position_mm=np.zeros((count, 3)),
        hub_rotation=np.tile(np.eye(3), (count, 1, 1)),
        tracked_point_mm=np.zeros((count, 3)),
        commanded_kPa=np.zeros((count, 3)),
        regulated_kPa=np.zeros((count, 3)),
        contact_count=np.zeros(count),
        contact_force_mN=force,
        contact_velocity_mm_per_s=velocity,
    )


def test_shares_are_those_of_the_forces() -> None:
    force, velocity = np.zeros((2, 2, 2, 3)), np.zeros((2, 2, 2, 3))
    # Leg 1 in frame 1: two points press 300 and 100 mN, and are pulled 120 mN along x and y.
    force[0, 0] = [[120.0, 0.0, 300.0], [0.0, 120.0, 100.0]]
    velocity[0, 0, 1] = [0.0, 5.0, 0.0]  # the second one slips
    force[1, 0] = [[60.0, 0.0, 100.0], [60.0, 0.0, 100.0]]  # at the limit of mu = 0.6
    margin = friction_margin(trajectory(force, velocity), 0.6)
    pull = math.hypot(120.0, 120.0) / (0.6 * 400.0)
    np.testing.assert_allclose(margin.used_share[:, 0], [pull, 1.0])
    np.testing.assert_allclose(margin.slipping_share[:, 0], [0.25, 0.0])
    assert np.isnan(margin.used_share[:, 1]).all()  # the other leg is in the air
    leg = margin.of_leg(0)
    assert leg["mean_load_mN"] == 300.0
    assert leg["used_share"] == pytest.approx((400 * pull + 200 * 1.0) / 600)
    assert leg["at_limit_share"] == pytest.approx(200 / 600)
    assert leg["in_air_share"] == 0.0
    in_air = margin.of_leg(1)
    assert in_air["in_air_share"] == 1.0
    assert in_air["used_share"] == 0.0


def test_a_standing_robot_presses_with_its_weight_and_slips_nowhere() -> None:
    physics = Physics()
    robot = paper_robot("published").assembly("1.0.0.2.2.0.0.1")
    _, rest = rollout(ReducedRobot(robot, physics), np.zeros((300, 3)), record_every=10)
    margin = friction_margin(rest, physics.friction)
    weight_mN = (robot.hub.mass + sum(mount.part.mass for mount in robot.mounts)) * 9800.0
    # After 3 s the fall has died out; what is left of it, and the disk, carry less than 1 %.
    np.testing.assert_allclose(margin.load_mN[-1].sum(), weight_mN, rtol=0.01)
    # Left and right legs of a symmetric robot press alike.
    np.testing.assert_allclose(margin.load_mN[-1], margin.load_mN[-1][::-1], rtol=0.02)
    assert np.nanmax(margin.slipping_share[-1]) == 0.0


def test_no_leg_uses_more_than_friction_can_give() -> None:
    physics = Physics(friction=0.4)
    robot = paper_robot("published").assembly("1.0.0.2.2.0.0.1")
    gait = HeldGait.evenly(np.array([[80.0, 0.0, 0.0], [80.0, 80.0, 0.0]]), 0.5)
    commands = sample_commands(gait, physics.time_step_s, 100)
    _, walked = rollout(ReducedRobot(robot, physics), commands, record_every=1)
    margin = friction_margin(walked, physics.friction)
    # Coulomb's law holds point by point, so their sum obeys it too, to the solver's tolerance and
    # the single precision of the recording.
    assert np.nanmax(margin.used_share) < 1.0 + 1e-4
    assert np.nanmax(margin.used_share) > 0.9  # and so little friction is used up
    assert np.nanmax(margin.slipping_share) > 0.5


def test_shares_on_a_slope_are_those_along_its_normal() -> None:
    """A point on ground that rises by 3 in 4 presses 500 mN and is held by 200 mN along the slope;
    sliding up the slope it has no speed off it."""
    normal, along = np.array([-0.6, 0.0, 0.8]), np.array([0.8, 0.0, 0.6])
    flat = trajectory((500.0 * normal + 200.0 * along)[None, None, None],
                      (7.0 * along)[None, None, None])  # fmt: skip
    walk = replace(flat, contact_normal=normal[None, None, None])
    margin = friction_margin(walk, 0.8)
    np.testing.assert_allclose(margin.load_mN, 500.0)
    np.testing.assert_allclose(margin.used_share, 200.0 / (0.8 * 500.0))
    np.testing.assert_allclose(point_contacts(walk).sliding_mm_per_s, 7.0)


@pytest.mark.parametrize("model", ["reduced", "full"])
def test_on_rough_ground_no_leg_uses_more_than_friction_gives(model: str, tmp_path: Path) -> None:
    """As on a level floor, by the normals that either model records; along the vertical a leg on a
    slope of 1 in 5 would use twice what a friction of 0.2 gives."""
    ground = Ground(rough=RoughGround(5.0, 40.0), length_mm=400.0, width_mm=400.0)
    physics = Physics(friction=0.2, regulator_count=2, floor_height_mm=0.0, ground=ground)
    if model == "full":
        robot = small_robot(physics)
    else:
        robot = ReducedRobot(crawlers()[0], replace(PHYSICS, friction=0.2, ground=ground), STEPPER)
    commands = np.tile([20.0, 5.0], (30, 1))
    _, walked = rollout(robot, commands, record_every=1, settling_steps=0)
    again = Trajectory.load(walked.save(tmp_path / "walk.npz"))
    assert again.contact_normal is not None
    np.testing.assert_array_equal(again.contact_normal, walked.contact_normal)
    assert 0.05 < np.abs(again.contact_normal[..., 0]).max() < 0.9
    # Coulomb's law holds to the solver's tolerance and the single precision of the recording.
    assert np.nanmax(friction_margin(again, 0.2).used_share) < 1.0 + 1e-3
    level = replace(again, contact_normal=None)
    assert np.nanmax(friction_margin(level, 0.2).used_share) > 1.05


def test_each_surface_gives_its_own_friction() -> None:
    given = (("sheet", 0.3), ("skin", 0.6), ("hub", 0.1))
    spec, design = (
        paper_robot("published", physics=Physics(friction_by_surface=given)),
        "1.0.0.2.2.0.0.1",
    )
    gait = HeldGait.evenly(np.array([[80.0, 0.0, 0.0], [80.0, 80.0, 0.0]]), 0.5)
    commands = sample_commands(gait, spec.physics.time_step_s, 100)
    _, walked = rollout(spec.reduced(design), commands, record_every=1)
    force = walked.contact_force_mN
    assert force is not None
    friction = leg_friction(Design.parse(design), walked, spec)
    assert np.shape(friction) == force.shape[:-1]
    assert set(np.unique(friction)) == {0.3, 0.6}
    margin = friction_margin(walked, friction)
    # As above; the coefficient of one surface for all would allow twice that or half of it.
    assert np.nanmax(margin.used_share) < 1.0 + 1e-4
    assert np.nanmax(margin.used_share) > 0.9
    assert (
        leg_friction(Design.parse(design), walked, paper_robot("published")) == Physics().friction
    )
    # Under pressure a point has between half and twice of what its surface has.
    law = replace(spec, physics=replace(spec.physics, friction_pressure=FrictionPressure(-0.3)))
    factor = leg_friction(Design.parse(design), walked, law) / np.asarray(friction)
    pressed = force[..., 2] > 0.0
    assert np.all(factor[~pressed] == 2.0)
    assert 0.5 <= factor[pressed].min() < factor[pressed].max() <= 2.0


def test_bad_input_is_refused() -> None:
    still = trajectory(np.zeros((2, 1, 1, 3)), np.zeros((2, 1, 1, 3)))
    with pytest.raises(ValueError, match=r"friction is 0\.0, expected a positive"):
        friction_margin(still, 0.0)
    object.__setattr__(still, "contact_force_mN", None)
    with pytest.raises(ValueError, match="holds no contact forces"):
        friction_margin(still, 1.0)


@pytest.mark.parametrize("model", ["reduced", "reduced on rough ground", "full"])
def test_points_slip_where_they_use_all_their_friction_and_nowhere_else(model: str) -> None:
    """By Coulomb's law, which the solvers obey to 0.01 mm/s: what sticks moves by no more, and what
    slips a hundred times as fast lies at its cone to that share. Points of the reduced robot give
    way by 5 mm/N, and its modes move where they stick. Of points that bear a hundredth of a leg."""
    ground = Ground(rough=RoughGround(2.0, 60.0)) if "rough" in model else Ground()
    if model == "full":
        physics = Physics(friction=0.5, regulator_count=2, floor_height_mm=0.0)
        robot, commands = small_robot(physics), np.tile([20.0, 5.0], (40, 1))
    else:
        apart = np.linalg.norm(PART.contact_points[:, None] - PART.contact_points[None], axis=2)
        part = replace(PART, contact_flexibility=5e-3 * np.exp(-((apart / 8.0) ** 2)))
        crawler = crawlers()[0]
        mounts = tuple(replace(mount, part=part) for mount in crawler.mounts)
        physics = replace(PHYSICS, friction=0.25, damping="objective", ground=ground)
        robot = ReducedRobot(replace(crawler, mounts=mounts), physics, STEPPER)
        commands = np.repeat(GAIT[:4], 20, axis=0)
    _, walked = rollout(robot, commands, record_every=1)
    pressing, held, sliding = (each[1:] for each in point_contacts(walked))
    loaded, slips = pressing > 10.0, sliding > SLIP_MM_PER_S
    used = np.linalg.norm(held, axis=-1) / np.maximum(physics.friction * pressing, 1e-9)
    sticks = used < 0.99
    assert np.count_nonzero(loaded & slips) > 20
    assert np.count_nonzero(loaded & sticks) > 20
    assert not np.any(loaded & slips & sticks)
    # Twice, for the single precision of the recording.
    assert sliding[loaded & sticks].max() < 2.0 * STEPPER.contact_tolerance_mm_per_s


def test_velocities_at_contact_do_not_depend_on_how_often_they_are_recorded() -> None:
    """They are those of the last step before a frame, in walks that are the same to the bit."""
    robot = ReducedRobot(crawlers()[0], replace(PHYSICS, friction=0.5), STEPPER)
    commands = np.repeat(GAIT[:3], 10, axis=0)
    fine, coarse = (rollout(robot, commands, record_every=every)[1] for every in (1, 7))
    places = [*range(0, 30, 7), 30]
    for name, values in coarse.arrays().items():
        if name != "skin_triangles":
            np.testing.assert_array_equal(values, fine.arrays()[name][places], err_msg=name)
    bare = rollout(robot, commands, record_every=7, record_nodes=False)[1]
    np.testing.assert_array_equal(bare.tracked_point_mm, coarse.tracked_point_mm)
