"""Contact points that give way beyond the modes: the reference, statics, and finite elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, GAIT, PART, PHYSICS, crawlers
from helpers.steps_with_contact import FRICTION_TOLERANCE, assert_steps_with_contact_equal

from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.reference_contact import contact_kinematics
from pneumorph.simulation.reference_step import modes_of

CONTACT = replace(FRESH, contact_tolerance_mm_per_s=FRICTION_TOLERANCE, contact_sweeps=1000)


def flexible(part: ReducedPart, mm_per_N: float) -> ReducedPart:
    """With a flexibility of points that feel each other over some 8 mm."""
    points = part.contact_points
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return replace(part, contact_flexibility=1e-3 * mm_per_N * np.exp(-((apart / 8.0) ** 2)))


FLEXIBLE = flexible(PART, 20.0)


def crawler(part: ReducedPart = FLEXIBLE) -> Robot:
    robot = crawlers()[0]
    return Robot(robot.hub, tuple(replace(mount, part=part) for mount in robot.mounts))


@pytest.mark.parametrize("ground", [Ground(), Ground(rough=RoughGround(4.0, 30.0, seed=3))])
def test_steps_with_sticking_and_sliding_points_equal_the_reference(ground: Ground) -> None:
    slope = 10.0 if ground.is_plane else 0.0
    physics = replace(PHYSICS, ground=ground, floor_slope_deg=slope, damping="objective")
    simulator = BatchedSimulator([crawler()], physics, CONTACT, 1)
    simulator.advance(np.zeros((1, 2)), 60)  # falls and settles
    moving = assert_steps_with_contact_equal(simulator, np.repeat(GAIT[:4], 6, axis=0))
    assert sum(moving) > 50  # pressed points; those that stick move by the modes too


def test_points_at_rest_are_pressed_in_by_what_they_carry() -> None:
    """Gap by the modes + R F = 0 where a point is pressed, and nowhere less; the solver ends within
    1e-8 mm/s of it, a step long."""
    physics = replace(PHYSICS, damping="objective", friction=0.8, mass_damping_per_s=5.0)
    simulator = BatchedSimulator([crawler()], physics, CONTACT, 1)
    simulator.advance(np.zeros((1, 2)), 600)
    robot, state, physics = simulator.robots[0], simulator.state(0), simulator.physics
    places, _ = contact_kinematics(robot, state.position, state.rotation, modes_of(robot, state))
    forces = (state.impulses[:, 0] / physics.time_step_s).reshape(3, -1)
    lift = forces @ FLEXIBLE.contact_flexibility
    gap = (places[:, 2] - physics.floor_height_mm).reshape(3, -1) + lift
    assert np.abs(gap[forces > 1.0]).max() < 1e-6
    assert gap.min() > -1e-6
    assert lift.max() > 0.3  # it is felt
    assert simulator.read("worst_penetration")[0] < 0.5  # what lands too fast, not what is lifted
    weight = (robot.hub.mass + 3 * FLEXIBLE.mass) * 9800.0
    assert forces.sum() == pytest.approx(weight, rel=1e-3)


def test_stiffer_and_larger_parts_give_way_less() -> None:
    """By the modulus, and by the size at the same modulus; a world's modulus is a part's."""
    for part, factor in (
        (scaled_part(FLEXIBLE, 2.0, 3.0), 2.0),
        (resized_part(FLEXIBLE, 1.5), 1.5),
    ):
        np.testing.assert_allclose(
            part.contact_flexibility, FLEXIBLE.contact_flexibility / factor, rtol=1e-12
        )
    world = World(1.2, 1.4, 0.8, 0.0, 8.0)
    own = scaled_part(FLEXIBLE, 1.4, 0.8)
    robot = crawler(own)
    hub = replace(robot.hub, mass=0.8 * robot.hub.mass, second_moment=0.8 * robot.hub.second_moment)
    physics = replace(PHYSICS, damping="objective", friction=1.2)
    sloping = replace(physics, floor_slope_deg=8.0)
    one = BatchedSimulator([crawler()], physics, CONTACT, 1, worlds=[world])
    other = BatchedSimulator([Robot(hub, robot.mounts)], sloping, CONTACT, 1)
    for simulator in (one, other):
        for command in GAIT[:2]:
            simulator.advance(command[None], 20)
    np.testing.assert_allclose(one.read("position"), other.read("position"), atol=1e-4)


def test_what_is_flexible_is_another_part() -> None:
    assert FLEXIBLE.digest() != PART.digest()
    with pytest.raises(ValueError, match=r"contact_flexibility must have shape \(\d+, \d+\)"):
        replace(PART, contact_flexibility=np.zeros((2, 2)))
