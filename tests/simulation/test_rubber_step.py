"""The compiled stepper takes the reference's steps with parts of measured silicone."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, PHYSICS
from helpers.one_leg import COMMAND, HUB, POSE, motion_of, thrown
from helpers.synthetic_part import (
    rubber_reduced_part,
    synthetic_part,
    synthetic_reduced_part,
    vibration_modes,
)
from scipy.optimize import brentq

from pneumorph.fem.material import Material
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_step import reference_step, unknowns_of

OBJECTIVE = {"damping": "objective", "stiffness_damping_s": 0.004}
RELAXING = rubber_reduced_part(6, pressures=3)
ELASTIC = replace(RELAXING, relaxation_weight=np.zeros(0), relaxation_time=np.zeros(0))


def freshly_thrown(
    part: ReducedPart, motion: tuple[np.ndarray, np.ndarray, np.ndarray], **settings: object
) -> BatchedSimulator:
    """With a fresh stiffness in every step, as the reference has it."""
    return thrown(part, motion, tangent_tolerance_mm_per_s=0.0, **settings)


def assert_steps_equal(
    simulator: BatchedSimulator, count: int, tolerance: float, command: np.ndarray = COMMAND
) -> None:
    """New velocities and all that they move; springs, which are strains, beside the largest."""
    robot = simulator.robots[0]
    for _ in range(count):
        expected = reference_step(robot, simulator.physics, simulator.state(0), command)
        simulator.advance(command[None], 1)
        assert simulator.status[0] == RobotStatus.RUNNING
        got = simulator.state(0)
        largest = np.abs(unknowns_of(robot, expected)).max()
        for each in fields(ReducedState):
            if each.name == "memory":
                continue
            scale = largest
            if each.name == "springs":
                scale = np.abs(expected.springs).max(initial=0.0) + 1e-9
            apart = np.abs(getattr(got, each.name) - getattr(expected, each.name))
            assert apart.max(initial=0.0) < tolerance * scale, each.name


# As in test_reference_step.py; the bulk modulus, 50 mu, costs single precision a digit.
TOLERANCE = {"double": 1e-10, "single": 1e-2}


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_a_relaxing_step_equals_the_reference(precision, instruction_set):
    simulator = freshly_thrown(
        RELAXING,
        motion_of(RELAXING, 0.5),
        element_precision=precision,
        instruction_set=instruction_set,
        **OBJECTIVE,
    )
    assert simulator.read("springs").shape == (1, 1, 2, len(RELAXING.tetrahedron_measure), 6)
    drawn = 0.05 * np.random.default_rng(2).normal(size=simulator.read("springs").shape)
    simulator.write(0, "springs", drawn.ravel())
    np.testing.assert_allclose(simulator.read("springs"), drawn, atol=1e-7)
    assert_steps_equal(simulator, 3, TOLERANCE[precision])


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_a_step_with_a_sheet_seen_by_its_stress_equals_the_reference(precision, instruction_set):
    part = rubber_reduced_part(6, pressures=3, stretches=5)
    simulator = freshly_thrown(
        part,
        motion_of(part, 0.5),
        element_precision=precision,
        instruction_set=instruction_set,
        **OBJECTIVE,
    )
    assert_steps_equal(simulator, 3, TOLERANCE[precision])


@pytest.mark.parametrize("damping", ["objective", "published"])
def test_a_sheet_seen_by_its_stress_is_seen_beside_any_solid(damping):
    """No pressures, no branches and another law: the stretches alone bring the leg to the kernel
    that knows them."""
    model = synthetic_part((4, 4, 4), "st_venant_kirchhoff")
    number = 3 * model.element_groups[1].element_count
    fields = np.linalg.qr(np.random.default_rng(8).normal(size=(number, 5)))[0]
    part = assemble_reduced_part(model, vibration_modes(model, 6), stress_fields=fields)
    simulator = freshly_thrown(
        part, motion_of(part, 0.5), element_precision="double", damping=damping
    )
    assert_steps_equal(simulator, 3, TOLERANCE["double"])


@pytest.mark.parametrize("mode_count", [8, 14, 20, 30, 38])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_every_mode_count_has_a_kernel_of_silicone_that_is_right(mode_count, precision):
    part = rubber_reduced_part(mode_count, order="linear", pressures=5)
    motion = motion_of(part, 0.2)
    simulator = freshly_thrown(part, motion, element_precision=precision, **OBJECTIVE)
    assert_steps_equal(simulator, 2, TOLERANCE[precision])


@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("law", ["yeoh", "stable_neo_hookean", "st_venant_kirchhoff"])
def test_volumes_of_whole_elements_and_every_law_step_under_either_damping(law, damping):
    """Yeoh's tangent by its principal stretches among them; it stiffens and softens again."""
    material = Material(520.0, 0.45, law, dilatation="mean")
    if law == "yeoh":
        material = replace(material, yeoh_c2_over_c1=0.16, yeoh_c3_over_c1=-0.017)
    part = replace(ELASTIC, tetrahedron_material=material)
    assert_steps_equal(freshly_thrown(part, motion_of(part, 0.5), damping=damping), 2, 1e-10)


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_yeohs_law_with_a_volume_at_every_point_steps_far_from_rest(damping):
    part = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    material = Material(520.0, 0.45, "yeoh", 0.16, -0.017)
    part = replace(part, tetrahedron_material=material)
    bent, *motion = motion_of(part, 1.0)

    def volumes(size: float) -> np.ndarray:
        return np.linalg.det(part.tetrahedra.gradients(size * bent))

    # As far as the state drawn goes until an element has three tenths of its volume left.
    size = brentq(lambda size: volumes(size).min() - 0.3, 0.0, 20.0)
    assert volumes(size).max() > 1.2
    motion = (size * bent, *motion)
    assert_steps_equal(freshly_thrown(part, motion, damping=damping), 1, 1e-10)


def test_rubber_that_is_turned_inside_out_stops_its_robot_alone():
    part = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    part = replace(part, tetrahedron_material=Material(520.0, 0.45, "yeoh"))
    motion = motion_of(part, 11.0)
    assert np.linalg.det(part.tetrahedra.gradients(motion[0])).min() < 0.0
    for precision in ("single", "double"):
        simulator = thrown(part, motion, element_precision=precision, damping="objective")
        simulator.advance(COMMAND[None], 1)
        assert simulator.status[0] != RobotStatus.RUNNING


def test_unlike_legs_of_which_one_relaxes_step_as_the_reference():
    other = Pose(rotation_about("z", 170.0), np.array([-80.0, 10.0, 5.0]))
    stiff = synthetic_reduced_part(8, (6, 4, 4))
    single = replace(RELAXING, relaxation_weight=np.array([0.3]), relaxation_time=np.array([0.05]))
    mounts = (Mount(stiff, POSE, (1,)), Mount(RELAXING, other, (0,)), Mount(single, POSE, (1,)))
    physics = replace(PHYSICS, floor_height_mm=-1e6, pressure_rate_kPa_per_s=200.0, **OBJECTIVE)
    simulator = BatchedSimulator([Robot(HUB, mounts)], physics, FRESH, 1)
    simulator.write(0, "angular_velocity", np.array([0.3, -0.6, 0.9]))
    assert_steps_equal(simulator, 6, 1e-10, np.array([8.0, 4.0]))
    springs = simulator.state(0).springs
    assert np.abs(springs[1]).max() > 1e-5
    assert np.abs(springs[2, 0]).max() > 1e-5
    assert not springs[0].any()
    assert not springs[2, 1].any()


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_state_with_springs_goes_on_to_the_same_bits(precision):
    settings = {"element_precision": precision, **OBJECTIVE}
    first = thrown(RELAXING, motion_of(RELAXING, 0.3), **settings)
    first.advance(COMMAND[None], 7)
    state = first.state(0)
    second = thrown(RELAXING, motion_of(RELAXING, 0.0), **settings)
    second.set_state(0, state)
    for simulator in (first, second):
        simulator.advance(COMMAND[None], 5)
    for name in ("modes", "mode_rates", "position", "springs"):
        np.testing.assert_array_equal(first.read(name), second.read(name))
    second.reset()
    assert np.abs(second.read("springs")).max() < 1e-7  # rounding of the frames at rest
    with pytest.raises(ValueError, match="springs has 6 numbers"):
        second.write(0, "springs", np.zeros(6))


def test_held_under_pressure_a_leg_creeps_to_where_it_would_be_without_branches():
    """After twenty times its longest time a leg that relaxes has the relaxed one's equilibrium."""
    quick = replace(RELAXING, relaxation_time=np.array([0.1, 0.02]))
    held = Robot(replace(HUB, mass=1e9, second_moment=1e12 * np.eye(3)), ())
    ends = []
    for part, seconds in ((quick, 0.05), (quick, 4.0), (ELASTIC, 4.0)):
        robot = replace(held, mounts=(Mount(part, POSE, (1,)),))
        physics = replace(
            PHYSICS, floor_height_mm=-1e9, pressure_rate_kPa_per_s=1e9, gravity_mm_per_s2=0.0,
            mass_damping_per_s=2.0, **OBJECTIVE,
        )  # fmt: skip
        simulator = BatchedSimulator([robot], physics, FRESH, 1)
        simulator.advance(np.array([[0.0, 15.0]]), round(seconds / physics.time_step_s))
        ends.append(simulator.read("modes")[0, 0, :6])
    size = np.abs(ends[2]).max()
    assert np.abs(ends[1] - ends[2]).max() < 1e-3 * size
    assert np.abs(ends[0] - ends[2]).max() > 0.02 * size
