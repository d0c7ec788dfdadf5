"""Steps that keep the stiffness of an earlier one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import FRESH, GAIT, PART, PHYSICS, STEPPER, crawlers, march
from helpers.one_leg import COMMAND, motion_of, thrown
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reference_step import step_equations, step_system, unknowns_of


def mounted(mode_count):
    """A part on a mount that gives way."""
    part = synthetic_reduced_part(mode_count, (4, 4, 4) if mode_count > 6 else (6, 4, 4))
    spring = np.random.default_rng(1).normal(size=(mode_count, mode_count))
    return replace(part, linear_stiffness=10.0 * spring @ spring.T)


@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("mode_count", "instruction_set"),
    [(6, "best"), (6, "avx2"), (6, "baseline"), *((count, "best") for count in (14, 20, 30, 38))],
)
def test_steps_with_a_kept_stiffness_equal_the_reference(
    damping, precision, mode_count, instruction_set
):
    """Steps two and three keep the first's stiffness and predict what it lacks."""
    part = mounted(mode_count)
    simulator = thrown(
        part,
        motion_of(part, 1.0),
        damping=damping,
        element_precision=precision,
        instruction_set=instruction_set,
        tangent_tolerance_mm_per_s=1e6,
    )
    robot, physics = simulator.robots[0], simulator.physics
    pressure = physics.pressure_map.simulated(COMMAND)
    kept = step_system(robot, physics, simulator.state(0), pressure).stiffness
    simulator.advance(COMMAND[None], 1)
    last_lack = np.zeros(len(kept))
    for _ in range(2):
        before = simulator.state(0)
        old = unknowns_of(robot, before)
        system = step_system(robot, physics, before, pressure)
        lack = (system.stiffness - kept) @ old
        stale = replace(system, stiffness=kept)
        damped = physics.time_step_s + physics.stiffness_damping_s  # s / h of (25)
        predicted = replace(stale, force=system.force - damped * (2.0 * lack - last_lack))
        expected = np.linalg.solve(*step_equations(predicted, old, physics))
        simulator.advance(COMMAND[None], 1)
        after = replace(simulator.state(0), rotation=before.rotation)
        got = unknowns_of(robot, after)
        # As for a fresh step: sums in double precision; strains of 1e-2, rounded, and their rates.
        tolerance = 1e-11 if precision == "double" else 1e-4
        assert np.abs(got - expected).max() < tolerance * np.abs(expected).max()
        # The prediction is seen: without it the velocities differ by more than three tolerances.
        ignored = np.linalg.solve(*step_equations(stale, old, physics))
        assert np.abs(ignored - expected).max() > 3e-4 * np.abs(expected).max()
        last_lack = lack
    assert simulator.read("tangent_total")[0] == 1


def lag_of_step_two(part, motion):
    """Modal velocities that the lack of the first step's stiffness is worth in the second, by dense
    matrices, and the velocities at its start; a robot without floor under objective damping."""
    simulator = thrown(part, motion, damping="objective")
    robot, physics = simulator.robots[0], simulator.physics
    h, rest = physics.time_step_s, np.zeros(2)
    scale = h * (h + physics.stiffness_damping_s)
    kept = step_system(robot, physics, simulator.state(0), rest).stiffness[6:, 6:]
    simulator.advance(rest[None], 1)
    now = simulator.state(0)
    rates = unknowns_of(robot, now)[6:]
    stiffness = step_system(robot, physics, now, rest).stiffness[6:, 6:]
    block = (1.0 + physics.mass_damping_per_s * h) * np.eye(len(rates)) + scale * kept
    return np.linalg.solve(block, scale * (stiffness - kept) @ rates), rates


def fresh_in_two_steps(part, motion, tolerance):
    simulator = thrown(part, motion, damping="objective", tangent_tolerance_mm_per_s=tolerance)
    simulator.advance(np.zeros((1, 2)), 2)
    return simulator.read("tangent_total")[0]


def test_a_stiffness_is_kept_up_to_the_tolerance():
    part = mounted(6)
    motion = motion_of(part, 0.3)
    lag, rates = lag_of_step_two(part, motion)
    assert np.linalg.norm(lag) < 0.3 * np.linalg.norm(rates)  # the other limit is far
    change = np.linalg.norm(lag) / np.sqrt(part.mass)
    assert fresh_in_two_steps(part, motion, 1.01 * change) == 1
    assert fresh_in_two_steps(part, motion, 0.99 * change) == 2


def test_a_stiffness_that_has_changed_along_the_motion_is_not_kept():
    """Whatever the tolerance: with a stale stiffness velocities would grow from step to step."""
    ratios = []
    for speed in (1.0, 1000.0):
        motion = motion_of(PART, 0.3, speed)
        lag, moving = lag_of_step_two(PART, motion)
        ratios.append(np.linalg.norm(lag) / np.linalg.norm(moving))
        assert fresh_in_two_steps(PART, motion, 1e9) == (1 if ratios[-1] < 0.3 else 2)
    assert ratios[0] < 0.3 < ratios[1]


def test_paths_with_a_kept_stiffness_stay_by_those_with_fresh_ones():
    """Paths of 1.6 s part by less than that time's worth of the tolerance, at every command.

    What two predictions part by is what one of them may be wrong by, and later steps damp it.
    """
    legs = sum(len(robot.mounts) for robot in crawlers())
    shares = []
    for tolerance in (0.01, 0.1):
        keeping = replace(STEPPER, tangent_tolerance_mm_per_s=tolerance)
        simulators = [BatchedSimulator(crawlers(), PHYSICS, each, 1) for each in (FRESH, keeping)]
        for command in GAIT:
            for simulator in simulators:
                simulator.advance(np.tile(command, (3, 1)), 20)
            fresh, kept = (simulator.read("position") for simulator in simulators)
            assert np.abs(kept - fresh).max() < 1.6 * tolerance
        shares.append(simulators[1].read("tangent_total").sum() / (160 * legs))
        assert simulators[1].read("tangent_error_total").sum() < 0.05 * 160 * legs
    assert 1.0 > shares[0] > shares[1]


def test_what_was_kept_is_forgotten_with_the_state_it_was_kept_of():
    """After a reset or a new state a robot walks as if it had never walked before."""
    once = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1)
    first = march(once)
    once.reset()
    for name, value in march(once).items():
        assert np.array_equal(value, first[name]), name
    # The state of one robot, written into another simulator and into its own.
    robot = crawlers()[2]
    walked, other = (BatchedSimulator([robot], PHYSICS, STEPPER, 1) for _ in range(2))
    march(walked)
    simulator_state = ("position", "rotation", "velocity", "angular_velocity", "regulated",
                       "impulses", "modes", "mode_rates")  # fmt: skip
    for name in simulator_state:
        for simulator in (walked, other):
            simulator.write(0, name, walked.read(name)[0])
    here, there = march(walked), march(other)
    for name, value in here.items():
        assert np.array_equal(value, there[name]), name
    # With its memory it goes on as if it had never stopped.
    memory = walked.memory(0)
    state = {name: walked.read(name)[0] for name in simulator_state}
    here = march(walked)
    for name, value in state.items():
        other.write(0, name, value)
    other.set_memory(0, memory)
    for name, value in march(other).items():
        assert np.array_equal(value, here[name]), name
    with pytest.raises(ValueError, match="it is of another robot, precision or instruction set"):
        other.set_memory(0, memory[1:])
