"""Steps that keep the stiffness of an earlier one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from crawlers import FRESH, GAIT, PART, SETTINGS, crawlers, march
from dense_step import GRAVITY, dense_step, dense_system, falling_robot, state_of, velocities
from synthetic_part import synthetic_reduced_part

from pneumorph.simulation import BatchedSimulator


def mounted(mode_count):
    """A part on a mount that gives way."""
    part = synthetic_reduced_part(mode_count, (4, 4, 4) if mode_count > 6 else (6, 4, 4))
    spring = np.random.default_rng(1).normal(size=(mode_count, mode_count))
    return replace(part, linear_stiffness=10.0 * spring @ spring.T)


@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("mode_count", "instruction_set"),
    [(6, "best"), (6, "avx2"), (6, "baseline"), (14, "best"), (20, "best"), (30, "best")],
)
def test_steps_with_a_kept_stiffness_equal_dense_linear_algebra(
    damping, precision, mode_count, instruction_set
):
    """Steps two and three keep the first's stiffness and predict what it lacks."""
    part = mounted(mode_count)
    simulator, settings, (alpha, rates, velocity) = falling_robot(
        part,
        0.3,
        damping=damping,
        element_precision=precision,
        instruction_set=instruction_set,
        tangent_tolerance_mm_per_s=1e6,
    )
    command, count = np.array([[0.0, 20.0]]), part.mode_count
    pressure = settings.pressure_map.simulated(20.0)
    kept = dense_system(part, alpha, velocity, rates, pressure, settings)[1]
    simulator.advance(command, 1)
    last_lack = np.zeros(len(kept))
    for _ in range(2):
        rotation = simulator.read("rotation")[0]
        old = velocities(simulator, count, rotation)
        mass, stiffness, force = dense_system(
            part,
            simulator.read("modes")[0, 0, :count],
            old[:6],
            old[6:],
            pressure,
            settings,
            rotation.T @ GRAVITY,
        )
        lack = (stiffness - kept) @ old
        predicted = force - (settings.time_step_s + settings.stiffness_damping_s) * (
            2.0 * lack - last_lack
        )
        expected = dense_step(mass, kept, predicted, old[:6], old[6:], settings)
        simulator.advance(command, 1)
        got = velocities(simulator, count, rotation)
        # As for a fresh step: modes of single precision; rounding of strains of 1e-2, their rates.
        tolerance = 1e-6 if precision == "double" else 1e-4
        assert np.abs(got - expected).max() < tolerance * np.abs(expected).max()
        # The prediction is seen: without it the velocities differ by more than three tolerances.
        ignored = dense_step(mass, kept, force, old[:6], old[6:], settings)
        assert np.abs(ignored - expected).max() > 3 * tolerance * np.abs(expected).max()
        last_lack = lack
    assert simulator.read("tangent_total")[0] == 1


def lag_of_step_two(part, state):
    """Modal velocities that the lack of the first step's stiffness is worth in the second, by dense
    matrices, and the velocities at its start; a robot without floor under objective damping."""
    simulator, settings, (alpha, rates, velocity) = falling_robot(
        part, 0.3, state, damping="objective"
    )
    h, count = settings.time_step_s, part.mode_count
    scale = h * (h + settings.stiffness_damping_s)
    kept = dense_system(part, alpha, velocity, rates, 0.0, settings)[1][6:, 6:]
    simulator.advance(np.zeros((1, 2)), 1)
    old = velocities(simulator, count)
    place = simulator.read("modes")[0, 0, :count]
    stiffness = dense_system(part, place, old[:6], old[6:], 0.0, settings)[1][6:, 6:]
    block = (1.0 + settings.mass_damping_per_s * h) * np.eye(count) + scale * kept
    return np.linalg.solve(block, scale * (stiffness - kept) @ old[6:]), old[6:]


def fresh_in_two_steps(part, state, tolerance):
    simulator, _, _ = falling_robot(
        part, 0.3, state, damping="objective", tangent_tolerance_mm_per_s=tolerance
    )
    simulator.advance(np.zeros((1, 2)), 2)
    return simulator.read("tangent_total")[0]


def test_a_stiffness_is_kept_up_to_the_tolerance():
    part = mounted(6)
    lag, rates = lag_of_step_two(part, None)
    assert np.linalg.norm(lag) < 0.3 * np.linalg.norm(rates)  # the other limit is far
    change = np.linalg.norm(lag) / np.sqrt(part.mass)
    assert fresh_in_two_steps(part, None, 1.01 * change) == 1
    assert fresh_in_two_steps(part, None, 0.99 * change) == 2


def test_a_stiffness_that_has_changed_along_the_motion_is_not_kept():
    """Whatever the tolerance: with a stale stiffness velocities would grow from step to step."""
    alpha, rates, velocity = state_of(PART, 0.3)
    ratios = []
    for speed in (1.0, 1000.0):
        state = (alpha, speed * rates, velocity)
        lag, moving = lag_of_step_two(PART, state)
        ratios.append(np.linalg.norm(lag) / np.linalg.norm(moving))
        assert fresh_in_two_steps(PART, state, 1e9) == (1 if ratios[-1] < 0.3 else 2)
    assert ratios[0] < 0.3 < ratios[1]


def test_paths_with_a_kept_stiffness_stay_by_those_with_fresh_ones():
    """Paths of 1.6 s part by less than that time's worth of the tolerance, at every command.

    What two predictions part by is what one of them may be wrong by, and later steps damp it.
    """
    legs = sum(len(robot.mounts) for robot in crawlers())
    shares = []
    for tolerance in (0.01, 0.1):
        settings = replace(SETTINGS, tangent_tolerance_mm_per_s=tolerance)
        simulators = [BatchedSimulator(crawlers(), each, 1) for each in (FRESH, settings)]
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
    once = BatchedSimulator(crawlers(), SETTINGS, 1)
    first = march(once)
    once.reset()
    for name, value in march(once).items():
        assert np.array_equal(value, first[name]), name
    # The state of one robot, written into another simulator and into its own.
    robot = crawlers()[2]
    walked, other = (BatchedSimulator([robot], SETTINGS, 1) for _ in range(2))
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
