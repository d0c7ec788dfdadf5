from dataclasses import replace

import numpy as np
import pytest
from helpers.small_robot import small_leg, small_robot
from threadpoolctl import threadpool_info, threadpool_limits

from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.hub_body import HubBody
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap


def test_rest_state_is_the_rest_shape_in_the_hub_frame():
    robot = small_robot()
    state = robot.initial_state()
    for leg, x in zip(robot.legs, robot.leg_nodes_in_hub_frame(state), strict=True):
        np.testing.assert_allclose(x, leg.part.rest_nodes, atol=1e-12)
    # It touches nothing and no law is violated.
    assert (state.active_contacts, state.contact_residual, state.penetration_mm) == (0, 0.0, 0.0)


def test_attachment_stays_in_the_hub_frame_while_the_robot_moves():
    robot = small_robot()
    state, _ = robot.rollout(robot.initial_state(), np.full((20, 2), 20.0), record_nodes=False)
    for leg, x in zip(robot.legs, robot.leg_nodes_in_hub_frame(state), strict=True):
        nodes = leg.attachment
        np.testing.assert_allclose(x[nodes], leg.part.rest_nodes[nodes], atol=1e-9)


class OwnHub:
    """A hub of which no more can be seen than the protocol has."""

    def __init__(self, hub):
        self._hub = hub

    def __getattr__(self, name):
        if name.startswith("__") or name not in vars(HubBody):
            raise AttributeError(name)
        return getattr(self._hub, name)


@pytest.mark.parametrize("integrator", ["linearly_implicit", "implicit_euler"])
@pytest.mark.parametrize("soft", [False, True])
def test_a_hub_of_ones_own_needs_no_more_than_the_protocol(soft, integrator):
    numerics = FullOrderSettings(integrator=integrator)
    robot = small_robot(soft=soft, numerics=numerics)
    mounts = [(leg.part, leg.pose, leg.regulators) for leg in robot.legs]
    own = FullRobot(
        OwnHub(robot.hub), mounts, robot.physics, robot.tracked_point, numerics=numerics
    )
    commands = np.full((6, 2), 20.0)
    walked = [each.rollout(each.initial_state(), commands)[1] for each in (robot, own)]
    np.testing.assert_array_equal(walked[1].node_positions_mm, walked[0].node_positions_mm)
    assert walked[1].metadata == walked[0].metadata
    assert np.abs(np.diff(walked[0].node_positions_mm, axis=0)).max() > 0.1


def test_rollout_records_what_it_is_asked_to():
    robot = small_robot()
    commands = np.tile([10.0, 0.0], (12, 1))
    seen = []
    state, trajectory = robot.rollout(
        robot.initial_state(), commands, record_every=5, observe=seen.append
    )
    assert len(seen) == 12
    assert seen[-1] is state
    np.testing.assert_allclose(trajectory.time_s, [0.0, 0.05, 0.1, 0.12])
    nodes = robot.legs[0].part.node_count
    assert trajectory.node_positions_mm.shape == (4, 2, nodes, 3)
    assert trajectory.status == "completed"
    # 150 kPa/s for 0.05 s is 7.5 kPa.
    np.testing.assert_allclose(trajectory.regulated_kPa[:, 0], [0.0, 7.5, 10.0, 10.0])
    assert trajectory.metadata["settings"]["damping"] == "published"
    assert trajectory.metadata["contact"] == {
        "floor": "plane at 0 mm",
        "worst_residual_mm_per_s": max(each.contact_residual for each in seen),
        "unconverged_share": 0.0,
        "deepest_penetration_mm": max(each.penetration_mm for each in seen),
    }


def test_steps_have_one_thread_of_linear_algebra_whatever_the_caller_has():
    """Two of them take longer, most of all beside other work, and sum otherwise."""

    def threads():
        return {p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas"}

    robot, seen = small_robot(), []
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        robot.rollout(
            robot.initial_state(), np.zeros((1, 2)), observe=lambda _: seen.append(threads())
        )
        assert threads() == before
    assert seen == [{1}]


def test_work_of_the_pressure_is_what_it_does_on_the_cavity():
    """p dV of every step (9), of a pressure that stays: the one that a step ends with."""
    physics = Physics(
        floor_height_mm=0.0, regulator_count=2, pressure_map=PressureMap(1.0, 0.0),
        pressure_rate_kPa_per_s=1e6,
    )  # fmt: skip
    robot = small_robot(physics)
    _, seen = robot.rollout(robot.initial_state(), np.tile([10.0, 6.0], (12, 1)), record_every=1)
    work = np.diff(seen.pressure_work_mJ, axis=0)
    swollen = np.diff(seen.cavity_volume_mm3, axis=0)
    assert np.abs(swollen).max() > 1.0
    np.testing.assert_allclose(work, 1e-3 * swollen * [10.0, 6.0], rtol=1e-9, atol=1e-12)


def test_a_regulator_fills_the_chambers_of_all_its_legs():
    """Two alike take twice the air of one, and the tube next to none."""
    air = Air(law="orifice", tube_mm3=1e-3)
    physics = Physics(floor_height_mm=0.0, regulator_count=2, air=air)
    robot = small_robot(physics, legs=((0.0, 0), (100.0, 0), (200.0, 1)))
    state = robot.initial_state()
    risen = robot.regulators.after(state.regulated_kPa, np.full(2, 90.0), 1e-4)
    # From one state, so that the chambers have grown by nothing yet.
    assert risen[1] / risen[0] == pytest.approx(2.0, rel=1e-5)


def test_rollout_in_two_pieces_is_the_rollout_in_one():
    robot = small_robot()
    commands = np.tile([15.0, 5.0], (10, 1))
    whole, _ = robot.rollout(robot.initial_state(), commands, record_nodes=False)
    middle, _ = robot.rollout(robot.initial_state(), commands[:4], record_nodes=False)
    end, _ = robot.rollout(middle, commands[4:], record_nodes=False)
    assert np.array_equal(end.positions[0], whole.positions[0])


def test_divergence_is_a_status_not_an_exception():
    physics = Physics(
        floor_height_mm=0.0,
        regulator_count=2,
        pressure_map=PressureMap(1.0, 0.0),
        pressure_rate_kPa_per_s=1e9,
    )
    robot = small_robot(physics)
    state, trajectory = robot.rollout(robot.initial_state(), np.full((50, 2), 1e7))
    assert trajectory.status == "diverged"
    assert np.all(np.isfinite(state.positions[0]))


def test_bad_input_is_refused():
    robot = small_robot()
    state = robot.initial_state()
    with pytest.raises(ValueError, match=r"shape \(step, 2\), got \(5, 3\)"):
        robot.rollout(state, np.zeros((5, 3)))
    with pytest.raises(ValueError, match="must be finite"):
        robot.rollout(state, np.full((5, 2), np.nan))
    with pytest.raises(ValueError, match="at least one leg"):
        FullRobot(robot.hub, [])
    with pytest.raises(ValueError, match=r"regulator must be 0 \.\. 2, got 3"):
        FullRobot(robot.hub, [(small_leg(), robot.legs[0].pose, 3)])
    with pytest.raises(ValueError, match="time_step_s must be above 0"):
        Physics(time_step_s=0.0)
    with pytest.raises(ValueError, match="damping must be one of published, objective"):
        Physics(damping="none")
    with pytest.raises(ValueError, match="newton_tolerance must be positive, got 0"):
        FullOrderSettings(newton_tolerance=0.0)
    with pytest.raises(ValueError, match="integrator must be one of linearly_implicit"):
        FullOrderSettings(integrator="leapfrog")


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("damping", ["published", "objective"])
def test_condensed_step_solves_the_whole_system(soft, damping):
    """The step's equations put together densely, without any elimination, hold for its result."""
    physics = Physics(
        damping=damping,
        floor_height_mm=0.0,
        regulator_count=2,
    )
    robot = small_robot(physics, soft)
    command = np.array([25.0, 10.0])
    state, _ = robot.rollout(robot.initial_state(), np.tile(command, (25, 1)), record_nodes=False)
    new = robot.step(state, command)
    assert np.any(new.impulses[:, 0] > 0.0)

    hub_count, h = robot.hub.unknown_count, physics.time_step_s
    matrix, right = robot.hub.system(state.hub, physics)
    right = right.copy()
    hub_map = robot.hub.point_map(state.hub, robot.hub.contact_points)
    start = len(state.impulses) - len(robot.hub.contact_points)
    right += hub_map.T @ new.impulses[start:][:, [1, 2, 0]].ravel()
    residual = matrix @ new.hub.velocity - right
    start = 0
    for number, leg in enumerate(robot.legs):
        part, x = leg.part, state.positions[number]
        stiffness = (
            part.stiffness(x) if damping == "published" else part.objective_stiffness(x)
        ).toarray()
        own = physics.stiffness_factor * stiffness
        own[np.diag_indices(len(own))] += physics.mass_factor * np.repeat(part.node_mass, 3)
        pressure = physics.pressure_map.simulated(new.regulated_kPa[leg.regulators[0]])
        force = part.internal_force(x, physics.rotation) + part.pressure_force(x, float(pressure))
        force[:, 2] -= part.node_mass * physics.gravity_mm_per_s2
        impulses = new.impulses[start : start + leg.contact_count][:, [1, 2, 0]]
        start += leg.contact_count
        load = part.node_mass[:, None] * state.velocities[number] + h * force
        load += leg.contact_weights.T @ impulses
        velocity = (new.positions[number] - x) / h
        tie = robot.hub.point_map(state.hub, leg.attachment_in_hub)
        velocity[leg.attachment] = (tie @ new.hub.velocity).reshape(-1, 3)
        unbalanced = (own @ velocity.ravel() - load.ravel()).reshape(-1, 3)
        residual += tie.T @ unbalanced[leg.attachment].ravel()
        unbalanced[leg.attachment] = 0.0
        # Impulses are about 1 mN s; positions of 100 mm divided by h leave 1e-12 of velocity.
        assert np.abs(unbalanced).max() < 1e-8
    assert residual.shape == (hub_count,)
    assert np.abs(residual).max() < 1e-8


def test_contact_law_holds_after_a_step():
    robot = small_robot()
    physics = robot.physics
    state, _ = robot.rollout(robot.initial_state(), np.tile([25.0, 0.0], (30, 1)))
    normal, tangent = state.impulses[:, 0], np.hypot(state.impulses[:, 1], state.impulses[:, 2])
    assert normal.min() >= 0.0
    assert np.all(tangent <= physics.friction * normal + 1e-12)
    heights = np.concatenate(
        [leg.contact_weights @ x[:, 2] for leg, x in zip(robot.legs, state.positions, strict=True)]
    )
    pressed = normal[: len(heights)] > 1e-9
    assert pressed.any()
    # Those pressed lie on the floor within the solver's tolerance times the step; none is below.
    assert np.abs(heights[pressed]).max() < 1e-8
    assert heights.min() > -1e-8


@pytest.mark.parametrize("matrix", ["kept", "fresh"])
def test_corners_of_a_hub_that_turns_fast_come_to_lie_on_the_floor(matrix):
    """Within a step at 8 rad/s a corner goes along an arc, 0.03 mm off its tangent. Balanced to
    1e-9 of the impulses at work, some 0.1 mN s, the hub moves by far less than 1e-6 mm."""
    numerics = FullOrderSettings("implicit_euler", newton_matrix=matrix, step_halvings=0)
    part = small_leg()
    rubber = PartModel(part.mesh, yeoh_material(50.0, 8.0, -1.0), 0.02, (), "cavity")
    physics = Physics(
        floor_height_mm=0.0, regulator_count=2, damping="objective", stiffness_damping_s=0.0
    )
    robot = small_robot(physics, leg=rubber, numerics=numerics)
    start = robot.initial_state()
    spin = np.array([0.0, 0.0, 0.0, 0.0, 8.0, 0.0])
    velocities = [
        (robot.hub.point_map(start.hub, x) @ spin).reshape(-1, 3) for x in start.positions
    ]
    state = replace(start, hub=replace(start.hub, velocity=spin), velocities=tuple(velocities))
    for _ in range(3):
        state = robot.step(state, np.zeros(2))
        on_hub = state.impulses[-len(robot.hub.contact_points) :, 0]
        assert on_hub.max() > 0.01  # mN s
        heights = robot.contact_positions(state)[-1][:, 2]
        np.testing.assert_allclose(heights[on_hub > 1e-9], 0.0, atol=1e-6)
        assert heights.min() > -1e-6


@pytest.mark.parametrize("soft", [False, True])
def test_contact_forces_and_weight_change_the_momentum(soft):
    # (1 + a h) P_new = P_old + h (W + F): no internal force or damping has a resultant. The
    # solution of the step is exact to rounding of stiffness times displacement, about 1e-10 of W.
    robot = small_robot(soft=soft)
    physics = robot.physics
    h, damping = physics.time_step_s, physics.mass_damping_per_s
    states = [robot.settled_state(10)]
    states.append(robot.step(states[0], np.array([30.0, 0.0])))
    bodies = [robot.bodies(state) for state in states]
    momentum = np.array(
        [sum(part.node_mass @ v for part, _, v in each) for each in bodies], dtype=float
    )
    mass = sum(part.node_mass.sum() for part, _, _ in bodies[0])
    if not soft:
        mass += robot.hub.mass_kg
        momentum += robot.hub.mass_kg * np.array([state.hub.velocity[:3] for state in states])
    force, velocity, level = robot.leg_contacts(states[1])
    assert level is None
    hub_force = np.roll(states[1].impulses[force.shape[0] * force.shape[1] :].sum(axis=0), -1) / h
    weight = mass * np.array([0.0, 0.0, -physics.gravity_mm_per_s2])
    expected = momentum[0] + h * (weight + force.sum(axis=(0, 1)) + hub_force)
    np.testing.assert_allclose(
        (1.0 + damping * h) * momentum[1], expected, atol=1e-8 * h * abs(weight[2])
    )
    assert force[..., 2].max() > 0.0
    assert not np.any(velocity[force[..., 2] == 0.0])


def test_what_pulls_on_a_hub_resists_its_turn():
    """The moments of impulses that keep their directions while the arms turn, by central
    differences: of turns of 1e-5 radian they are exact to 1e-9. The matrix is their symmetric
    part."""
    rng = np.random.default_rng(3)
    hub = small_robot().hub
    start = hub.advance(hub.initial_state(), rng.normal(size=6), 0.3)
    points, impulses = rng.normal(0.0, 10.0, (2, 7, 3))

    def moments(turn):
        moved = hub.advance(start, np.array([0.0, 0.0, 0.0, *turn]), 1.0)
        return hub.point_map(moved, points).T @ impulses.ravel()

    found = hub.turning_matrix(start, points, impulses)
    step = 1e-5
    changes = [(moments(step * e) - moments(-step * e)) / (2.0 * step) for e in np.eye(3)]
    exact = -np.array(changes).T[3:]
    np.testing.assert_allclose(found[3:, 3:], 0.5 * (exact + exact.T), atol=1e-6)
    assert not found[:3].any()
    assert not found[:, :3].any()
    outwards = hub.point_positions(start, points) - start.centre
    assert np.linalg.eigvalsh(hub.turning_matrix(start, points, outwards)[3:, 3:]).min() > 0.0
