"""Both integrators against each other, against conservation laws, and where a step fails."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.small_robot import small_robot

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import EASY_ITERATIONS, FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.time_integration import StepError
from pneumorph.physics.floor import HeightField
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap

INTEGRATORS = ("linearly_implicit", "implicit_euler")
FLYING = Physics(
    floor_height_mm=-1e6,
    regulator_count=2,
    mass_damping_per_s=0.0,
    stiffness_damping_s=0.01,
    gravity_mm_per_s2=0.0,
    pressure_rate_kPa_per_s=1e6,
    pressure_map=PressureMap(1.0, 0.0),
    damping="objective",
)
IMPLICIT = FullOrderSettings(integrator="implicit_euler")
PRESSURE = np.array([20.0, 10.0])


@cache
def flown(physics: Physics, integrator: str, duration_s: float) -> FullRobotState:
    robot = small_robot(physics, soft=True, numerics=FullOrderSettings(integrator=integrator))
    commands = np.tile(PRESSURE, (round(duration_s / physics.time_step_s), 1))
    state, trajectory = robot.rollout(robot.initial_state(), commands, 1000, record_nodes=False)
    assert trajectory.status == "completed"
    return state


def test_a_linearly_implicit_step_that_touches_nothing_is_one_solve():
    robot = small_robot(FLYING, numerics=FullOrderSettings(integrator="linearly_implicit"))
    assert robot.step(robot.initial_state(), PRESSURE).iterations == 1


@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_first_order_convergence(integrator, damping):
    """Halving the step halves the error; the limit is shared by both integrators.

    With the limit extrapolated from the two finest runs (Richardson), the errors of 4 and 2 ms
    would be as 2 to 1 but for terms of second order, some 5 % here.
    """
    base = replace(FLYING, damping=damping)
    ends = [
        flown(replace(base, time_step_s=step), integrator, 0.016).positions[0]
        for step in (4e-3, 2e-3, 1e-3)
    ]
    limit = 2.0 * ends[2] - ends[1]
    coarse, fine = (np.linalg.norm(end - limit) for end in ends[:2])
    assert coarse / fine == pytest.approx(2.0, rel=0.1)
    other = INTEGRATORS[1 - INTEGRATORS.index(integrator)]
    swapped = flown(replace(base, time_step_s=1e-3), other, 0.016).positions[0]
    assert np.linalg.norm(swapped - limit) < fine


def gravitational(robot: FullRobot, state: FullRobotState) -> float:
    """Energy of height [mJ]."""
    height = sum(float(part.node_mass @ x[:, 2]) for part, x, _ in robot.bodies(state))
    return 1e-3 * robot.physics.gravity_mm_per_s2 * height


def energy(robot: FullRobot, state: FullRobotState) -> float:
    """Kinetic and elastic energy [mJ]."""
    return 1e-3 * sum(
        part.elastic_energy(x) + 0.5 * float(part.node_mass @ np.sum(v**2, axis=1))
        for part, x, v in robot.bodies(state)
    )


def dissipated(robot: FullRobot, state: FullRobotState) -> float:
    """Power lost to damping of mass and stiffness [mW]."""
    alpha, beta = robot.physics.mass_damping_per_s, robot.physics.stiffness_damping_s
    return 1e-3 * sum(
        alpha * float(part.node_mass @ np.sum(v**2, axis=1))
        + beta * float(v.ravel() @ (part.objective_stiffness(x) @ v.ravel()))
        for part, x, v in robot.bodies(state)
    )


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_work_is_stored_or_dissipated(integrator):
    """Work of pressure and gravity = kinetic + elastic energy + damping, but for the integrator's
    own loss.

    That loss is of first order in the step: it halves with it, within 15 %.
    """
    losses = []
    heavy = replace(FLYING, gravity_mm_per_s2=2000.0, mass_damping_per_s=3.0)
    for step in (2e-3, 1e-3):
        numerics = FullOrderSettings(integrator=integrator)
        robot = small_robot(replace(heavy, time_step_s=step), soft=True, numerics=numerics)
        lost, work = 0.0, 0.0
        state = robot.initial_state()
        height = gravitational(robot, state)
        for _ in range(round(0.012 / step)):
            state = robot.step(state, PRESSURE)
            lost += step * dissipated(robot, state)
            work = float(state.pressure_work_mJ.sum()) + height - gravitational(robot, state)
        losses.append((work - energy(robot, state) - lost) / work)
    assert abs(losses[1]) < 0.1
    assert losses[0] / losses[1] == pytest.approx(2.0, rel=0.15)


def momenta(robot: FullRobot, state: FullRobotState) -> tuple[np.ndarray, np.ndarray]:
    """Linear [mN s] and angular momentum about the origin [mN s mm]; the ties hold no mass."""
    linear, angular = np.zeros((2, 3))
    for part, x, v in robot.bodies(state):
        linear += part.node_mass @ v
        angular += part.node_mass @ np.cross(x, v)
    return linear, angular


def spinning(robot: FullRobot) -> FullRobotState:
    """The robot at rest, turning at 3 rad/s and flying."""
    state, spin, drift = (
        robot.initial_state(),
        np.array([0.0, 1.0, 3.0]),
        np.array([50.0, 0.0, 9.0]),
    )
    velocities = tuple(drift + np.cross(spin, x) for x in state.positions)
    hub = replace(state.hub, velocity=(drift + np.cross(spin, state.hub.positions)).ravel())
    return replace(state, hub=hub, velocities=velocities)


def test_a_flying_robot_keeps_its_momenta_under_objective_damping():
    """No outer force: the linearly implicit step conserves both momenta to rounding.

    Its matrices vanish on rigid motions of the stressed robot and its forces have no resultant, so
    sum x_n x m (v_new - v) = 0, and x_new = x + h v_new adds nothing. Published damping turns it.
    """
    change = {}
    for damping in ("objective", "published"):
        robot = small_robot(replace(FLYING, damping=damping), soft=True)
        state = spinning(robot)
        before = momenta(robot, state)
        for _ in range(10):
            state = robot.step(state, PRESSURE)
        change[damping] = [
            float(np.linalg.norm(after - first) / np.linalg.norm(first))
            for after, first in zip(momenta(robot, state), before, strict=True)
        ]
    assert max(change["objective"]) < 1e-9
    assert change["published"][0] < 1e-9  # its stiffness is blind to translation
    assert change["published"][1] > 1e-3


def test_implicit_euler_keeps_angular_momentum_to_first_order():
    """Its forces have no moment about the end of the step, where momentum is counted next: what is
    lost is of first order, and linear momentum is kept."""
    lost = []
    for step, count in ((1e-2, 5), (5e-3, 10)):
        robot = small_robot(replace(FLYING, time_step_s=step), soft=True, numerics=IMPLICIT)
        state = spinning(robot)
        before = momenta(robot, state)
        for _ in range(count):
            state = robot.step(state, PRESSURE)
        after = momenta(robot, state)
        assert np.linalg.norm(after[0] - before[0]) < 1e-9 * np.linalg.norm(before[0])
        lost.append(float(np.linalg.norm(after[1] - before[1])))
    assert lost[0] / lost[1] == pytest.approx(2.0, rel=0.15)


def test_implicit_euler_starts_from_a_deformed_body_at_rest():
    """No gravity, no pressure, no velocity: only elastic forces are at work."""
    robot = small_robot(replace(FLYING, time_step_s=1e-3), soft=False, numerics=IMPLICIT)
    state = robot.initial_state()
    bent = []
    for leg, x in zip(robot.legs, state.positions, strict=True):
        moved = x + 0.01 * (x - x[leg.attachment].mean(axis=0))
        moved[leg.attachment] = x[leg.attachment]
        bent.append(moved)
    new = robot.step(replace(state, positions=tuple(bent)), np.zeros(2))
    assert new.substeps == 1
    assert max(np.abs(v).max() for v in new.velocities) > 1.0


def test_a_halved_step_reports_its_worst_part_and_all_its_impulses():
    """On the floor, and halved by force: the impulses of the parts carry the weight of both."""
    robot = small_robot(Physics(floor_height_mm=0.0, regulator_count=2))
    state, _ = robot.rollout(robot.initial_state(), np.zeros((150, 2)), record_nodes=False)
    calls = []
    undivided = robot._undivided

    def failing_first(state, command, physics):
        calls.append(physics.time_step_s)
        if len(calls) == 1:
            raise StepError("for the test")
        new = undivided(state, command, physics)
        return replace(new, contact_residual=5.0) if len(calls) == 2 else new

    robot._undivided = failing_first
    new = robot.step(state, np.zeros(2))
    assert calls == [0.01, 0.005, 0.005]
    assert new.contact_residual == 5.0
    weight = (0.03 + 2 * 0.02) * 9800.0
    assert new.impulses[:, 0].sum() == pytest.approx(0.01 * weight, rel=2e-3)


def test_a_floor_without_height_ends_the_run():
    def pit(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.where(np.abs(x) < 5.0, 0.0, np.nan) + 0.0 * y

    robot = small_robot(Physics(regulator_count=2))
    robot.floor = HeightField(pit)
    _, trajectory = robot.rollout(robot.initial_state(), np.zeros((5, 2)), record_nodes=False)
    assert trajectory.status == "diverged"
    assert "has no height below the contact point" in trajectory.metadata["reason"]
    with pytest.raises(StepError, match="has no height"):
        robot.settled_state()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_settled_shape_does_not_depend_on_the_step(integrator):
    """Pressure is a force in equilibrium with elasticity: no step length enters."""
    ends = []
    for step in (2e-2, 1e-2):
        physics = replace(FLYING, time_step_s=step, stiffness_damping_s=0.02)
        robot = small_robot(physics, numerics=FullOrderSettings(integrator=integrator))
        commands = np.tile(PRESSURE, (round(0.3 / step), 1))
        state, _ = robot.rollout(robot.initial_state(), commands, 10000, record_nodes=False)
        x = robot.leg_nodes_in_hub_frame(state)[0]
        ends.append(x - robot.legs[0].part.rest_nodes)
    bend = np.abs(ends[0]).max()
    assert bend > 0.2
    # What is left of the motion at 0.3 s, some 1e-4 mm/s, and the tolerance of the steps.
    assert np.abs(ends[0] - ends[1]).max() < 2e-4 * bend


def test_a_step_that_fails_is_halved_and_reported():
    """A sudden 60 kPa takes 15 Newton iterations at 10 ms and 8 at 2.5 ms: allow 10."""
    few = replace(IMPLICIT, newton_iterations=10)
    command = 3.0 * PRESSURE
    robot = small_robot(replace(FLYING, time_step_s=0.01), numerics=few)
    start = robot.initial_state()
    halved, trajectory = robot.rollout(start, command[None], record_nodes=False)
    assert trajectory.metadata["steps"]["halved"] == 1
    assert halved.substeps == 4
    # The parts are the steps of a robot that moves by them.
    fine = small_robot(replace(FLYING, time_step_s=0.0025), numerics=few)
    state = start
    for _ in range(4):
        state = fine.step(state, command)
    np.testing.assert_array_equal(halved.positions[0], state.positions[0])

    # The next step begins with as many parts, and as soon as they take few iterations with fewer.
    calm = [halved]
    for _ in range(6):
        calm.append(robot.step(calm[-1], command))
    wanted = [4]
    for before in calm[:-1]:
        easy = before.iterations <= EASY_ITERATIONS * before.substeps
        wanted.append(wanted[-1] // 2 if easy else wanted[-1])
    assert [state.substeps for state in calm] == [max(parts, 1) for parts in wanted]
    assert wanted[-1] <= 1 < wanted[1]

    robot = small_robot(replace(FLYING, time_step_s=0.01), numerics=replace(few, step_halvings=1))
    state, trajectory = robot.rollout(start, command[None], record_nodes=False)
    assert trajectory.status == "diverged"
    reason = trajectory.metadata["reason"]
    assert "a step of 0.005 s failed, 1 times halved: Newton's" in reason
    assert state is start
