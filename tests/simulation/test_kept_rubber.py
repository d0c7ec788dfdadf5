"""Steps of measured silicone that keep the stiffness of an earlier step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, GAIT, PHYSICS, STEPPER
from helpers.one_leg import COMMAND, HUB, motion_of, thrown
from helpers.synthetic_part import rubber_reduced_part

from pneumorph.fem.material import Material
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reference_step import (
    modes_of,
    reference_step,
    step_equations,
    step_system,
    unknowns_of,
)

UNDAMPED = {"damping": "objective", "stiffness_damping_s": 0.0}
"""As measured: what damps is the silicone."""
DAMPED = {"damping": "objective", "stiffness_damping_s": 0.004}
RELAXING = rubber_reduced_part(6, pressures=3)


def solid_resistance(part: ReducedPart, physics: Physics, alpha: np.ndarray) -> np.ndarray:
    """What a step's matrix has of the solid's stiffness and its branches', (mode, mode) [kg]."""
    elements, h = part.tetrahedra, physics.time_step_s
    columns = elements.mode_gradient.reshape(-1, 9, part.mode_count)
    answers = elements.objective_tangent(elements.gradients(alpha)) @ columns
    own = np.einsum("pia,pib->ab", columns, answers)
    resistance: np.ndarray = h * (h + physics.stiffness_damping_s) * own
    if part.branches is not None:
        resistance = resistance + h**2 * part.branches.stiffness(alpha, h)
    return resistance


def assert_kept_steps_equal_the_reference(
    part: ReducedPart, tolerance: float, size: float = 0.5, **settings: object
):
    """Steps two and three keep the solid's stiffness of the first and predict what it lacks; sheet
    and volumes have theirs of the step."""
    simulator = thrown(part, motion_of(part, size), tangent_tolerance_mm_per_s=1e6, **settings)
    robot, physics = simulator.robots[0], simulator.physics
    pressure = physics.pressure_map.simulated(COMMAND)

    def resistance() -> np.ndarray:
        own = solid_resistance(part, physics, modes_of(robot, simulator.state(0))[0])
        return np.pad(own, ((6, 0), (6, 0)))

    kept = resistance()
    simulator.advance(COMMAND[None], 1)
    last_lack = np.zeros(len(kept))
    for _ in range(2):
        before = simulator.state(0)
        old = unknowns_of(robot, before)
        matrix, right = step_equations(step_system(robot, physics, before, pressure), old, physics)
        stale = matrix - resistance() + kept
        lack = (resistance() - kept) @ old
        expected = np.linalg.solve(stale, right - (2.0 * lack - last_lack))
        simulator.advance(COMMAND[None], 1)
        assert simulator.read("tangent_total")[0] == 1
        after = replace(simulator.state(0), rotation=before.rotation)
        apart = np.abs(unknowns_of(robot, after) - expected).max()
        assert apart < tolerance * np.abs(expected).max()
        # The prediction is seen.
        ignored = np.linalg.solve(stale, right)
        assert np.abs(ignored - expected).max() > 2.0 * tolerance * np.abs(expected).max()
        last_lack = lack


# As in test_rubber_step.py, without its digit for the bulk modulus: volumes are found afresh.
TOLERANCE = {"double": 1e-10, "single": 1e-3}


@pytest.mark.parametrize("damping", [UNDAMPED, DAMPED])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_steps_with_a_kept_stiffness_equal_the_reference(damping, precision, instruction_set):
    assert_kept_steps_equal_the_reference(
        RELAXING,
        TOLERANCE[precision],
        element_precision=precision,
        instruction_set=instruction_set,
        **damping,
    )


@pytest.mark.parametrize("mode_count", [8, 14, 20, 30, 38])
def test_every_mode_count_keeps_it_likewise(mode_count):
    part = rubber_reduced_part(mode_count, order="linear", pressures=9)
    settings = {"element_precision": "double", **DAMPED}
    assert_kept_steps_equal_the_reference(part, 1e-10, size=0.1, **settings)


@pytest.mark.parametrize("law", ["yeoh", "stable_neo_hookean", "st_venant_kirchhoff"])
def test_every_law_keeps_it_without_branches_as_well(law):
    material = Material(520.0, 0.45, law, dilatation="mean")
    if law == "yeoh":
        material = replace(material, yeoh_c2_over_c1=0.16, yeoh_c3_over_c1=-0.017)
    part = replace(RELAXING, relaxation_weight=np.zeros(0), relaxation_time=np.zeros(0))
    part = replace(part, tetrahedron_material=material)
    assert_kept_steps_equal_the_reference(part, 1e-10, element_precision="double", **DAMPED)


def test_a_try_that_is_refused_leaves_the_step_as_it_would_have_been():
    """Forces and springs of the try are those of the fresh step, and the springs move on once."""
    simulator = thrown(
        RELAXING,
        motion_of(RELAXING, 0.5),
        element_precision="double",
        tangent_tolerance_mm_per_s=1e-12,
        linearised="start",
        **UNDAMPED,
    )
    robot = simulator.robots[0]
    for _ in range(6):  # a try in the second, the fourth
        expected = reference_step(robot, simulator.physics, simulator.state(0), COMMAND)
        simulator.advance(COMMAND[None], 1)
        got = simulator.state(0)
        size = np.abs(unknowns_of(robot, expected)).max()
        assert np.abs(got.mode_rates - expected.mode_rates).max() < 1e-10 * size
        largest = np.abs(expected.springs).max()
        assert np.abs(got.springs - expected.springs).max() < 1e-10 * largest
    assert simulator.read("tangent_total")[0] == 6


def test_paths_stay_by_those_with_fresh_stiffnesses():
    """Paths of 1.6 s part by less than that time's worth of the tolerance, as in
    test_kept_stiffness.py, and a tighter tolerance keeps it less often."""
    physics = replace(PHYSICS, **UNDAMPED)
    mounts = []
    for number, angle in enumerate([20.0, 140.0, 260.0]):
        turn = rotation_about("z", angle)
        pose = Pose(turn @ rotation_about("y", 15.0), turn @ np.array([100.0, 0.0, 9.0]))
        mounts.append(Mount(RELAXING, pose, (number % 2,)))
    robot = Robot(replace(HUB, mass=0.3), tuple(mounts))
    shares = []
    for tolerance in (0.01, 0.1):
        keeping = replace(STEPPER, tangent_tolerance_mm_per_s=tolerance)
        simulators = [BatchedSimulator([robot], physics, each, 1) for each in (FRESH, keeping)]
        for command in GAIT:
            for simulator in simulators:
                simulator.advance(command[None], 20)
                assert simulator.status[0] == RobotStatus.RUNNING
            fresh, kept = (simulator.read("position") for simulator in simulators)
            assert np.abs(kept - fresh).max() < 1.6 * tolerance
        shares.append(simulators[1].read("tangent_total")[0] / (160 * len(mounts)))
    assert 1.0 > shares[0] > shares[1]


@pytest.mark.parametrize("precision", ["single", "double"])
def test_legs_of_one_part_move_as_legs_of_equal_parts_do(precision: str) -> None:
    """Legs of one part are taken together, of three parts each alone: the same bits, whichever of
    them keep their stiffness and find their forces ahead."""
    poses = [
        Pose(turn, turn @ np.array([25.0, 0.0, 0.0]))
        for turn in (rotation_about("z", yaw) for yaw in (0.0, 120.0, 240.0))
    ]
    copies = [replace(RELAXING) for _ in poses]
    places = []
    for parts in ([RELAXING] * 3, [RELAXING, copies[1], RELAXING], copies):
        mounts = tuple(
            Mount(part, pose, (number,))
            for number, (part, pose) in enumerate(zip(parts, poses, strict=True))
        )
        physics = replace(PHYSICS, regulator_count=3, **UNDAMPED)
        stepper = replace(STEPPER, element_precision=precision, tangent_tolerance_mm_per_s=0.05)
        simulator = BatchedSimulator([Robot(HUB, mounts)], physics, stepper)
        rng = np.random.default_rng(4)
        for _ in range(8):
            simulator.advance(rng.uniform(0.0, 150.0, (1, 3)), 15)
        assert simulator.status[0] == RobotStatus.RUNNING
        # Beside those of the first step some were found afresh, and some kept.
        assert 3 < simulator.read("tangent_total")[0] < 3 * 120
        state = simulator.state(0)
        places.append((state.position, state.modes, state.mode_rates))
    for others in places[1:]:
        for ours, theirs in zip(places[0], others, strict=True):
            np.testing.assert_array_equal(ours, theirs)
