"""Steps of the engine beside those of the reference in NumPy, on floors of any shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_contact import ROWS, contact_kinematics
from pneumorph.simulation.reference_step import modes_of, reference_step, unknowns_of

FRICTION_TOLERANCE = 1e-8


def step(
    simulator: BatchedSimulator, command: np.ndarray, tolerance: float = 1e-10
) -> tuple[ReducedState, ReducedState]:
    """The state after one step of the only robot, by the reference and by the engine; of parts that
    are not linearised ahead, whose points may be."""
    state = simulator.state(0)
    rates = state.mode_rates if simulator.stepper.linearised == "ahead" else None
    expected = reference_step(
        simulator.robots[0], simulator.physics, state, command, tolerance, rates_before=rates
    )
    simulator.advance(command[None], 1)
    assert simulator.status[0] == RobotStatus.RUNNING
    return expected, simulator.state(0)


def assert_steps_with_contact_equal(
    simulator: BatchedSimulator, commands: np.ndarray
) -> tuple[int, int]:
    """Steps from the engine's own states; how many points stuck and how many slid, in all.

    Both solve the contact law to 1e-8 mm/s, each by its own path. The velocities that obey it are
    unique in these steps, and what is left of the law changes them by about as much; a hundred
    times that is still a tenth of a millionth of what they move at. Impulses of more points than a
    body has freedoms are determined in sum only. One in some thirty steps is too degenerate for
    one of the solvers to come that far, and a processor's rounding may decide which.
    """
    robot, solved, stuck, slid = simulator.robots[0], 0, 0, 0
    allowed = 100.0 * FRICTION_TOLERANCE
    floor = simulator.physics.floor(robot.standing_points)
    for command in commands:
        before = simulator.state(0)
        try:
            expected, got = step(simulator, command, FRICTION_TOLERANCE)
        except ArithmeticError:
            simulator.advance(command[None], 1)
            continue
        if simulator.read("contact_residual")[0] > FRICTION_TOLERANCE:
            continue
        solved += 1
        for name in ("position", "rotation", "velocity", "angular_velocity", "modes", "mode_rates"):
            assert np.abs(getattr(got, name) - getattr(expected, name)).max() < allowed, name
        assert np.abs(got.regulated - expected.regulated).max() < 1e-12
        places, jacobian = contact_kinematics(
            robot, before.position, before.rotation, modes_of(robot, before)
        )
        # The law speaks of velocities along the axes that the hub had at the step's start.
        moved = jacobian @ unknowns_of(robot, replace(got, rotation=before.rotation))
        frames = floor.frames(places)
        forces = np.einsum("pra,pr->a", frames, got.impulses - expected.impulses)
        assert np.abs(forces).max() < allowed
        sliding = np.einsum("pra,pa->pr", frames[:, 1:, ROWS], moved)
        slides = np.linalg.norm(sliding, axis=1) > allowed
        pressed = got.impulses[:, 0] > allowed
        stuck, slid = stuck + np.sum(pressed & ~slides), slid + np.sum(pressed & slides)
    assert solved > 0.8 * len(commands)
    return stuck, slid
