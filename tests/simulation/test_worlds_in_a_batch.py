"""Robots of one batch, each in its own world, without copies of their parts."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import GAIT, PART, PHYSICS, STEPPER, crawlers
from helpers.one_leg import COMMAND, HUB, POSE
from helpers.synthetic_part import rubber_reduced_part

from pneumorph.physics.air import Air
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics
from pneumorph.reduction.fewer_modes import with_fewer_modes
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.robot import Mount, Robot
from pneumorph.robot.scaled_part import scaled_part, scaled_robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import (
    reduction_digests,
    robot_in_world,
    simulator_in_worlds,
)

AS_IS = World(1.2, 1.0, 1.0, 0.0, 0.0)
HEAVY = World(0.8, 1.3, 0.6, 0.0, 2.0, damping_factor=0.5)
RUBBER = rubber_reduced_part(6, pressures=3)
RELAXING = replace(PHYSICS, damping="objective", stiffness_damping_s=0.004)


def walked(simulator: BatchedSimulator, steps: int = 20) -> dict[str, np.ndarray]:
    for command in GAIT[:4]:
        simulator.advance(np.tile(command, (len(simulator.robots), 1)), steps)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    names = ("position", "rotation", "velocity", "regulated", "impulses", "modes")
    return {name: simulator.read(name) for name in names}


@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("change", ["modulus_factor", "mass_factor", "damping_factor", "all"])
def test_a_robot_in_a_world_moves_as_one_whose_parts_are_scaled(damping: str, change: str) -> None:
    """The parts scaled beforehand are written in other units; the motion is the same, to what
    rounding of double precision grows to in 80 steps of walking. So are impulses; friction that
    depends on them notices what they are over."""
    world = HEAVY if change == "all" else replace(AS_IS, **{change: getattr(HEAVY, change)})
    law = FrictionPressure(-0.3, 1e-3)
    physics = replace(PHYSICS, damping=damping, friction_pressure=law)
    robots = [on_springs(robot) for robot in crawlers()]
    shared = walked(BatchedSimulator(robots, physics, STEPPER, 1, [world] * 3))
    scaled = [scaled_robot(robot, world.modulus_factor, world.mass_factor) for robot in robots]
    alone = walked(BatchedSimulator(scaled, world.applied_to(physics), STEPPER, 1))
    plain = walked(BatchedSimulator(robots, physics, STEPPER, 1))
    assert np.abs(shared["position"] - plain["position"]).max() > 0.01
    alone["modes"] /= np.sqrt(world.mass_factor)
    for name, expected in alone.items():
        tolerance = 1e-5 * np.abs(expected).max()
        np.testing.assert_allclose(shared[name], expected, rtol=0, atol=tolerance, err_msg=name)


def on_springs(robot: Robot) -> Robot:
    """Mounts that give, and contact points that know their areas, whatever those are."""
    part = robot.mounts[0].part
    points = len(part.contact_points)
    part = replace(
        part,
        linear_stiffness=0.3 * part.stiffness(np.zeros(part.mode_count)),
        contact_surface=np.full(points, "skin"),
        contact_area_mm2=np.full(points, 5.0),
    )
    return replace(robot, mounts=tuple(replace(mount, part=part) for mount in robot.mounts))


def thrown(part: ReducedPart, physics: Physics, world: World | None = None) -> BatchedSimulator:
    """One leg and a hub in the air, under pressure."""
    flying = replace(physics, floor_height_mm=-1e6, pressure_rate_kPa_per_s=1e9)
    robot = Robot(HUB, (Mount(part, POSE, (1,)),))
    simulator = BatchedSimulator([robot], flying, STEPPER, 1, None if world is None else [world])
    simulator.advance(COMMAND[None], 12)
    return simulator


def test_what_relaxes_is_scaled_as_the_part_would_be() -> None:
    """To rounding: the springs' stress and their resistance in the step's matrix. The springs
    themselves are strains, which no factor changes the units of."""
    world = replace(AS_IS, modulus_factor=1.2, damping_factor=3.0)
    shared = thrown(RUBBER, RELAXING, world)
    scaled = thrown(scaled_part(RUBBER, 1.2, 1.0, 3.0), world.applied_to(RELAXING))
    plain = thrown(RUBBER, RELAXING)
    for name in ("modes", "mode_rates", "springs"):
        largest = np.abs(scaled.read(name)).max()
        assert np.abs(plain.read(name) - scaled.read(name)).max() > 0.01 * largest
        apart = np.abs(shared.read(name) - scaled.read(name)).max()
        assert apart < 1e-9 * largest, name


def test_side_by_side_is_as_alone_and_goes_on_elsewhere() -> None:
    """To the bit, for any number of threads; a world as it stands changes no bit."""
    worlds = [AS_IS, HEAVY, replace(HEAVY, mass_factor=1.7, floor_slope_deg=-1.0)]
    together = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 2, worlds)
    expected = walked(together)
    assert len({id(part) for part in together._parts}) == 1
    for number, (robot, world) in enumerate(zip(crawlers(), worlds, strict=True)):
        alone = BatchedSimulator([robot], PHYSICS, STEPPER, 1, [world])
        own = walked(alone)
        for name, values in own.items():
            np.testing.assert_array_equal(
                values[0], expected[name][number][: len(values[0])], err_msg=name
            )
        again = BatchedSimulator([robot], PHYSICS, STEPPER, 1, [world])
        again.set_state(0, alone.state(0))
        for each in (alone, again):
            each.advance(GAIT[5][None], 20)
        np.testing.assert_array_equal(alone.read("modes"), again.read("modes"))
        np.testing.assert_array_equal(alone.read("impulses"), again.read("impulses"))
    plain = walked(BatchedSimulator(crawlers()[:1], PHYSICS, STEPPER, 1))
    np.testing.assert_array_equal(plain["position"][0], expected["position"][0])


def test_robots_of_worlds_share_parts_and_start_anew_with_others() -> None:
    """Eight worlds, then eight others: the engine's copy of the part is made once."""
    drawn = Randomisation(damping_factor="U(0.5, 2)", mounting_angle_deg="N(0, 1)")
    rng = np.random.default_rng(0)
    worlds = [drawn.draw(rng) for _ in range(6)]
    robots = crawlers() * 2
    simulator = simulator_in_worlds(robots, worlds, PHYSICS, STEPPER, 1)
    engine = simulator.simulator._batch
    simulator.advance(np.tile(GAIT[0], (6, 1)), 10)
    first = simulator.forward_position_mm
    assert len(set(first.tolist())) == 6
    simulator.set_robots(robots, worlds[::-1])
    simulator.set_robots(robots, worlds)
    simulator.advance(np.tile(GAIT[0], (6, 1)), 10)
    np.testing.assert_array_equal(simulator.forward_position_mm, first)
    assert simulator.simulator._batch is engine


def test_air_is_each_worlds_own() -> None:
    physics = replace(PHYSICS, air=Air("orifice"))
    worlds = [replace(AS_IS, filling_factor=factor) for factor in (0.5, 2.0)]
    robot = crawlers()[0]
    simulator = BatchedSimulator([robot, robot], physics, STEPPER, 1, worlds)
    simulator.advance(np.full((2, 2), 12.0), 3)
    slow, quick = simulator.read("regulated")[:, 0]
    assert 0.0 < slow < 0.5 * quick


def test_a_number_of_worlds_that_is_not_the_robots_is_refused() -> None:
    with pytest.raises(ValueError, match="got 2 worlds for 3 robots, expected one for each"):
        BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1, [AS_IS] * 2)


def test_legs_that_point_down_turn_about_their_inner_ends() -> None:
    """An outer end 100 mm away is 100 sin(angle) lower, beside the hub nothing moves."""
    robot = crawlers()[0]
    assert robot_in_world(robot, AS_IS) is robot
    tilted = robot_in_world(robot, replace(AS_IS, mounting_angle_deg=2.0))
    for mount, usual in zip(tilted.mounts, robot.mounts, strict=True):
        inner = np.array([mount.part.rest_nodes[:, 0].min(), 0.0, 0.0])
        np.testing.assert_allclose(mount.pose.apply(inner), usual.pose.apply(inner), atol=1e-12)
        axis = usual.pose.rotation.T @ mount.pose.rotation @ np.array([100.0, 0.0, 0.0])
        np.testing.assert_allclose(axis, [99.939, 0.0, -3.490], atol=1e-3)
        assert mount.part is usual.part


def test_a_world_may_have_another_reduction(tmp_path) -> None:
    """Of one file, read once; drawn as often as the robot's own."""
    robot = crawlers()[0]
    own = robot.mounts[0].part
    softer = replace(own, tetrahedron_material=own.tetrahedron_material.stiffer(0.7))
    file = softer.save(tmp_path / "softer.npz")
    drawn = Randomisation("1.2", "1", "1", "0", "0", reductions=(file,))
    rng = np.random.default_rng(1)
    worlds = [drawn.draw(rng) for _ in range(200)]
    # 5 standard deviations of a coin thrown 200 times.
    assert abs(sum(bool(world.reduction) for world in worlds) - 100) < 35
    chosen = [next(w for w in worlds if bool(w.reduction) == other) for other in (False, True)]
    simulator = simulator_in_worlds([robot, robot], chosen, PHYSICS, STEPPER, 1)
    own, other = (r.mounts[0].part for r in simulator.simulator.robots)
    assert own is robot.mounts[0].part
    np.testing.assert_array_equal(other.tetrahedron_rest, softer.tetrahedron_rest)
    assert other.tetrahedron_material == softer.tetrahedron_material
    assert robot_in_world(robot, chosen[1]).mounts[0].part is other


def test_another_reduction_is_changed_as_the_robots_own_leg_is(tmp_path) -> None:
    """The file of a robot's own leg is that leg, calibrated, weighed and resized as it is."""
    robot = crawlers()[0]
    file = robot.mounts[0].part.save(tmp_path / "own.npz")
    world = replace(AS_IS, reduction=str(file))
    calibrated = scaled_part(scaled_part(robot.mounts[0].part, 1.0, 0.8), 1.3, 1.1, 0.9)
    changed = resized_part(calibrated, 1.2)
    robot = replace(robot, mounts=tuple(replace(each, part=changed) for each in robot.mounts))
    same = robot_in_world(robot, world).mounts[0].part
    assert same.mass == pytest.approx(changed.mass, rel=1e-12)
    modulus = same.tetrahedron_material.young_modulus_kPa
    assert modulus == pytest.approx(changed.tetrahedron_material.young_modulus_kPa, rel=1e-12)
    for name in ("modes", "rest_nodes", "first_moment", "cavity_volume_3", "linear_stiffness"):
        np.testing.assert_allclose(getattr(same, name), getattr(changed, name), rtol=1e-12)
    assert robot_in_world(robot, world).mounts[1].part is same
    drawn = Randomisation(reductions=(file,))
    assert reduction_digests(drawn) == {str(file): PART.digest()}
    assert list(drawn.numbers_of([AS_IS, world])["reduction"]) == [0.0, 1.0]
    assert "reduction" not in Randomisation().numbers_of([AS_IS])


def test_a_reduction_that_is_written_again_is_read_again(tmp_path) -> None:
    """As a run begins, which goes on with what it read. It was walked as it had been, and its old
    digest kept."""
    robot = crawlers()[0]
    file, own = tmp_path / "other.npz", robot.mounts[0].part
    world = replace(AS_IS, reduction=str(file))
    for second, factor in enumerate((0.7, 1.4), start=1):
        written = replace(own, tetrahedron_material=own.tetrahedron_material.stiffer(factor))
        written.save(file)
        os.utime(file, (second, second))  # clocks of files are coarse
        assert reduction_digests(Randomisation(reductions=(file,))) == {str(file): written.digest()}
        file.unlink()
        placed = robot_in_world(robot, world).mounts[0].part
        assert placed.tetrahedron_material == written.tetrahedron_material
        assert robot_in_world(robot, world).mounts[0].part is placed
    with pytest.raises(FileNotFoundError):
        reduction_digests(Randomisation(reductions=(file,)))


def test_another_reduction_has_as_few_modes_as_the_robots_own_leg(tmp_path) -> None:
    robot, count = crawlers()[0], PART.mode_count - 1
    known = replace(PART, snapshot_range=np.diag(1.0 + np.arange(PART.mode_count)))
    world = replace(AS_IS, reduction=str(known.save(tmp_path / "own.npz")))
    fewer = with_fewer_modes(known, count)
    robot = replace(robot, mounts=tuple(replace(each, part=fewer) for each in robot.mounts))
    same = robot_in_world(robot, world).mounts[0].part
    assert same.mode_count == count
    np.testing.assert_allclose(same.cavity_volume_3, fewer.cavity_volume_3, rtol=1e-12)
