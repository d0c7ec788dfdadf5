"""The compiled stepper takes the steps of the reference in NumPy."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, GAIT, PART, PHYSICS, crawlers
from helpers.one_leg import COMMAND, HUB, POSE, motion_of, thrown
from helpers.steps_with_contact import (
    FRICTION_TOLERANCE,
    assert_steps_with_contact_equal,
    step,
)
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.air import Air
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_step import (
    reference_step,
    step_equations,
    step_system,
    unknowns_of,
)

LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")


def assert_free_steps_equal(simulator, count, tolerance):
    """Without contact: new velocities and everything they move, relative to those velocities."""
    for _ in range(count):
        expected, got = step(simulator, COMMAND)
        largest = np.abs(unknowns_of(simulator.robots[0], expected)).max()
        for each in fields(ReducedState):
            if each.name != "memory":
                apart = np.abs(getattr(got, each.name) - getattr(expected, each.name))
                assert apart.max(initial=0.0) < tolerance * largest, each.name


def assert_one_free_step_equals(part, size, precision="double", motion=None, **settings):
    """One leg, thrown.

    Double precision: both sum a few thousand products, each rounded by 1e-16, and solve for some
    ten unknowns, which a damping a hundred times stiffer than masses are inert makes a hundred
    times worse. Single: each of a few hundred sums rounds to 6e-8, strains are 1e-2, and the
    damping of stiff modes is a difference of nearly equal forces; a wrong tile or a lost row would
    be wrong by tenths.
    """
    simulator = thrown(
        part, motion or motion_of(part, size), element_precision=precision, **settings
    )
    assert_free_steps_equal(simulator, 1, {"double": 1e-11, "single": 1e-3}[precision])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_a_free_step_equals_the_reference(law, damping, instruction_set):
    part = PART if law == "corotational" else synthetic_reduced_part(6, (4, 4, 4), law)
    assert_one_free_step_equals(part, 0.3, damping=damping, instruction_set=instruction_set)


@pytest.mark.parametrize("law", LAWS[1:])
@pytest.mark.parametrize("damping", ["published", "objective"])
def test_quadratic_elements_step_likewise_in_single_precision(law, damping):
    part = synthetic_reduced_part(6, (4, 4, 4), law, quadratic=True)
    assert_one_free_step_equals(part, 0.3, "single", damping=damping)


@pytest.mark.parametrize("mode_count", [8, 14, 20, 30, 38])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2"])
def test_every_mode_count_has_a_kernel_that_is_right(mode_count, precision, instruction_set):
    part = synthetic_reduced_part(mode_count=mode_count, cells=(6, 4, 4))
    assert_one_free_step_equals(part, 0.3, precision, instruction_set=instruction_set)


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_crushed_and_inverted_elements_step_as_well(damping):
    part = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    volume = np.linalg.det(part.tetrahedra.gradients(motion_of(part, 11.0)[0]))
    assert volume.min() < -0.1  # tangents are indefinite there
    assert volume.max() > 2.0
    assert_one_free_step_equals(part, 11.0, damping=damping)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_crushed_element_still_has_the_polar_rotation(precision):
    """A singular value of 0.003: Newton's iteration without scaling is far from orthogonal then.

    The tangent's constant part relies on the rotation's orthogonality; without it the step's matrix
    was not even positive definite.
    """
    direction = np.array([0.2, 1.0, -0.7, 0.5, -1.0, 0.8])

    def least(scale: float) -> float:
        return float(np.linalg.det(PART.tetrahedra.gradients(scale * direction)).min())

    low, high = 0.0, 1.0
    while least(high) > 0.0:
        high *= 1.1
    for _ in range(60):  # bisect for where the first element is flat
        middle = 0.5 * (low + high)
        low, high = (middle, high) if least(middle) > 0.0 else (low, middle)
    scale = 0.998 * low
    singular = np.linalg.svd(PART.tetrahedra.gradients(scale * direction))[1][:, 2].min()
    assert 0.0005 < singular < 0.005
    _, rates, velocity = motion_of(PART, 0.0)
    crushed = (scale * direction, rates, velocity)
    assert_one_free_step_equals(PART, 0.0, precision, crushed, damping="objective")


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_unlike_legs_on_one_hub_step_as_the_reference(damping):
    """Another number of modes, another law, a mount that gives way, two cavities on two regulators;
    the regulators take their time."""
    first = synthetic_reduced_part(8, (6, 4, 4))
    first = replace(first, linear_stiffness=10.0 * np.diag(np.arange(1.0, 9.0)))
    second = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    halves = {
        name: np.stack([0.3 * getattr(second, name)[0], 0.7 * getattr(second, name)[0]])
        for name in ("cavity_volume", "cavity_volume_1", "cavity_volume_2", "cavity_volume_3")
    }
    other = Pose(rotation_about("z", 170.0), np.array([-80.0, 10.0, 5.0]))
    mounts = (Mount(first, POSE, (1,)), Mount(replace(second, **halves), other, (0, 1)))
    physics = replace(PHYSICS, floor_height_mm=-1e6, damping=damping, pressure_rate_kPa_per_s=700.0)
    simulator = BatchedSimulator([Robot(HUB, mounts)], physics, FRESH, 1)
    simulator.write(0, "angular_velocity", np.array([0.3, -0.6, 0.9]))
    assert_free_steps_equal(simulator, 5, 1e-11)  # as for one leg, above
    assert np.all(np.abs(simulator.state(0).mode_rates).max(axis=1) > 0.1)  # they do move


AIR = Air(law="orifice", filling_mm3_per_s_kPa=(400.0, 300.0), venting_mm3_per_s_kPa=(900.0,))
"""Regulators of unlike valves, which get nowhere in a step."""


def test_air_moves_pressures_as_the_reference_does():
    """Filling, holding, venting; both walk the same cells, and round."""
    physics = replace(PHYSICS, floor_height_mm=-1e6, air=AIR)
    simulator = BatchedSimulator(crawlers()[:1], physics, FRESH, 1)
    seen = []
    for command in ([0.0, 12.0], [15.0, 20.0], [15.0, 3.0], [300.0, 0.0], [0.0, 0.0]):
        for _ in range(6):
            expected, got = step(simulator, np.array(command))
            np.testing.assert_allclose(got.regulated, expected.regulated, rtol=1e-13, atol=1e-13)
            seen.append(got.regulated)
    on_the_way = np.abs(np.diff(seen, axis=0)) > 1e-3
    assert on_the_way.sum(axis=0).min() > 4
    assert np.max(seen) > 15.0


CONTACT = replace(FRESH, contact_tolerance_mm_per_s=FRICTION_TOLERANCE, contact_sweeps=1000)


@pytest.mark.parametrize("linearised", ["start", "ahead"])
@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("law", ["corotational", "stable_neo_hookean"])
def test_steps_with_sticking_and_sliding_points_equal_the_reference(law, damping, linearised):
    part = PART if law == "corotational" else synthetic_reduced_part(6, (4, 4, 4), law)
    robot = crawlers()[0]
    robot = Robot(robot.hub, tuple(replace(mount, part=part) for mount in robot.mounts))
    physics = replace(PHYSICS, damping=damping, floor_slope_deg=10.0)
    simulator = BatchedSimulator([robot], physics, replace(CONTACT, linearised=linearised), 1)
    simulator.advance(np.zeros((1, 2)), 60)  # falls and settles
    stuck, slid = assert_steps_with_contact_equal(simulator, np.repeat(GAIT[:4], 6, axis=0))
    assert stuck > 10
    assert slid > 10


def test_a_tilted_hub_lands_on_its_rim_as_the_reference_does():
    """A hub that tips over lands on its rim, and stays tilted on the leg that hangs lower."""
    angles = 0.3 + np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    rim = np.stack([60.0 * np.cos(angles), 60.0 * np.sin(angles), np.zeros(8)], axis=1)
    hub = Hub(0.2, np.zeros(3), 0.2 * np.diag([900.0, 900.0, 30.0]), np.zeros(3), rim)
    leg = Mount(PART, Pose(np.eye(3), np.array([100.0, 0.0, -12.0])), (0,))
    physics = replace(PHYSICS, floor_height_mm=0.0, friction=0.4)
    simulator = BatchedSimulator([Robot(hub, (leg,))], physics, CONTACT, 1)
    start = replace(
        simulator.state(0),
        position=np.array([0.0, 0.0, 40.0]),
        rotation=rotation_about("x", 30.0) @ rotation_about("y", 12.0),
        velocity=np.array([80.0, -20.0, -300.0]),
        angular_velocity=np.array([-1.0, 3.0, 0.5]),
    )
    simulator.set_state(0, start)
    stuck, slid = assert_steps_with_contact_equal(simulator, np.zeros((30, 2)))
    assert stuck > 10
    assert slid > 5
    end = simulator.state(0)
    assert end.impulses[:8, 0].max() > 0.0  # the rim's
    assert end.impulses[8:, 0].max() > 0.0  # the leg's
    assert end.rotation[2, 0] > 0.02  # tilted


def test_a_step_without_points_near_the_floor_is_the_equations_solution():
    """The specification itself: (8), written out."""
    simulator = thrown(PART, motion_of(PART, 0.3))
    robot, physics, state = simulator.robots[0], simulator.physics, simulator.state(0)
    new = reference_step(robot, physics, state, COMMAND)
    velocity = unknowns_of(robot, state)
    pressure = physics.pressure_map.simulated(COMMAND)
    system = step_system(robot, physics, state, pressure)
    matrix, right = step_equations(system, velocity, physics)
    moved = unknowns_of(robot, replace(new, rotation=state.rotation))
    np.testing.assert_allclose(matrix @ moved, right, atol=1e-12 * np.abs(right).max())
