"""The compiled stepper against dense numpy linear algebra, and its promises about batches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_part import synthetic_reduced_part

from pneumorph.fem.corotational import law_with_rotation
from pneumorph.fem.material import Material
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.pressure import rate_limit
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation import BatchedSimulator, RobotStatus, SimulationSettings
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout

LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")
PART = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
HUB = Hub(0.075, np.array([0.1, -0.2, 0.3]), np.diag([30.0, 20.0, 40.0]), np.zeros(3))
SETTINGS = SimulationSettings(element_precision="double", regulator_count=2)
POSE = Pose(rotation_about("z", 35.0) @ rotation_about("y", 15.0), np.array([95.0, 40.0, 8.0]))


FRESH = replace(SETTINGS, tangent_tolerance_mm_per_s=0.0)
GRAVITY = np.array([0.0, 0.0, -SETTINGS.gravity_mm_per_s2])


def dense_system(part, alpha, velocity, rates, pressure, settings, gravity=GRAVITY):
    """Mass, stiffness and force of a hub with one part, by dense matrices over all nodes.

    Vectors are along the hub's axes.
    """
    rotation = "edge" if settings.damping == "published" else "polar"
    count = part.mode_count
    nodes = POSE.apply(part.positions(alpha))
    jacobian = np.zeros((len(nodes), 3, 6 + count))
    jacobian[:, :, :3] = np.eye(3)
    for axis in range(3):
        jacobian[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    jacobian[:, :, 6:] = np.einsum("ij,nja->nia", POSE.rotation, part.modes)
    flat = jacobian.reshape(-1, 6 + count)
    mass = part.mass / len(nodes) * flat.T @ flat
    mass[:3, :3] += HUB.mass * np.eye(3)
    first = HUB.first_moment
    skew = np.cross(np.eye(3), first).T  # W -> W x first
    mass[:3, 3:6] += skew
    mass[3:6, :3] += skew.T
    mass[3:6, 3:6] += np.trace(HUB.second_moment) * np.eye(3) - HUB.second_moment

    stiffness = np.zeros_like(mass)
    force = np.zeros(6 + count)
    published = settings.damping == "published"
    stiffness[6:, 6:] = part.stiffness(alpha) if published else part.objective_stiffness(alpha)
    force[6:] = part.internal_force(alpha, rotation) + pressure * part.cavity().gradient(alpha)
    if published:
        # Turning the hub about its axes, seen from the part's own frame.
        axes = POSE.rotation.T
        for elements in (part.tetrahedra, part.membrane):
            gradient = elements.gradients(alpha)
            turns = np.stack(
                [np.cross(axes[:, j], gradient, axisb=1, axisc=1) for j in range(3)], 3
            )
            columns = np.concatenate([turns, elements.mode_gradient], axis=3)
            columns = columns.reshape(len(columns), -1, 3 + count)
            block = np.einsum(
                "eia,eij,ejb->ab", columns, elements.published_tangent(gradient), columns
            )
            stiffness[3:6, 3:6] += block[:3, :3]
            stiffness[3:6, 6:] += block[:3, 3:]
            stiffness[6:, 3:6] += block[3:, :3]
            force[3:6] -= np.einsum("eij,eijl->l", elements.stress(gradient), turns)
    force += part.mass / len(nodes) * np.einsum("nia,i->a", jacobian, gravity)
    force[:3] += HUB.mass * gravity
    force[3:6] += np.cross(first, gravity)
    # Coriolis and centrifugal accelerations of every node, and of the hub's own mass.
    turning = velocity[3:]
    swing = np.einsum("nia,a->ni", jacobian[:, :, 6:], rates)
    acceleration = np.cross(turning, np.cross(turning, nodes)) + 2.0 * np.cross(turning, swing)
    force -= part.mass / len(nodes) * np.einsum("nia,ni->a", jacobian, acceleration)
    force[:3] -= np.cross(turning, np.cross(turning, first))
    inertia = np.trace(HUB.second_moment) * np.eye(3) - HUB.second_moment
    force[3:6] -= np.cross(turning, inertia @ turning)
    return mass, stiffness, force


def dense_step(mass, stiffness, force, velocity, rates, settings):
    """New generalised velocities."""
    h = settings.time_step_s
    scale = h * (h + settings.stiffness_damping_s)
    left = (1.0 + settings.mass_damping_per_s * h) * mass + scale * stiffness
    return np.linalg.solve(left, mass @ np.concatenate([velocity, rates]) + h * force)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("damping", ["published", "objective"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
def test_one_step_equals_dense_linear_algebra(law, damping, instruction_set):
    part = PART if law == "corotational" else synthetic_reduced_part(6, (4, 4, 4), law)
    # Single precision of modes leaves a mass-orthonormality of about 1e-8; all else is double.
    assert_one_step_equals(part, 0.3, damping, instruction_set, "double", 1e-6)


@pytest.mark.parametrize("law", LAWS[1:])
@pytest.mark.parametrize("damping", ["published", "objective"])
def test_quadratic_elements_step_likewise_in_single_precision(law, damping):
    part = synthetic_reduced_part(6, (4, 4, 4), law, quadratic=True)
    # Strains of 1e-2 with 1e-7 of rounding, of which forces nearly balance.
    assert_one_step_equals(part, 0.3, damping, "best", "single", 1e-3)


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_crushed_and_inverted_elements_step_as_well(damping):
    part = synthetic_reduced_part(6, (4, 4, 4), "stable_neo_hookean")
    volume = np.linalg.det(part.tetrahedra.gradients(state_of(part, 8.0)[0]))
    assert volume.min() < -0.1  # tangents are indefinite there
    assert volume.max() > 2.0
    assert_one_step_equals(part, 8.0, damping, "best", "double", 1e-6)


def state_of(part, size):
    """Modal coordinates, their rates, and velocity and turning rate of the hub."""
    generator = np.random.default_rng(0)
    alpha = size * generator.normal(size=part.mode_count) / (1 + np.arange(part.mode_count) // 6)
    rates = generator.normal(size=part.mode_count)
    return alpha, rates, generator.normal(size=6) * [30.0, 30.0, 30.0, 0.5, 0.5, 0.5]


def falling_robot(part, size, state=None, **settings):
    """A simulator of one robot without a floor, its settings and its state."""
    settings = replace(
        SETTINGS,
        floor_height_mm=-1e6,
        pressure_rate_kPa_per_s=1e9,
        speed_limit_mm_per_s=1e7,
        **settings,
    )
    simulator = BatchedSimulator([Robot(HUB, (Mount(part, POSE, (1,)),))], settings, 1)
    alpha, rates, velocity = state or state_of(part, size)
    padding = (0, simulator.padded_mode_count - part.mode_count)
    simulator.write(0, "modes", np.pad(alpha, padding))
    simulator.write(0, "mode_rates", np.pad(rates, padding))
    simulator.write(0, "velocity", velocity[:3])
    simulator.write(0, "angular_velocity", velocity[3:])
    return simulator, settings, (alpha, rates, velocity)


def velocities(simulator, mode_count, rotation=None):
    """Generalised velocities, along the axes of the hub as `rotation` has them."""
    axes = np.eye(3) if rotation is None else rotation
    return np.concatenate(
        [
            axes.T @ simulator.read("velocity")[0],
            axes.T @ simulator.read("angular_velocity")[0],
            simulator.read("mode_rates")[0, 0, :mode_count],
        ]
    )


def assert_one_step_equals(part, size, damping, instruction_set, precision, tolerance, state=None):
    simulator, settings, (alpha, rates, velocity) = falling_robot(
        part,
        size,
        state,
        damping=damping,
        instruction_set=instruction_set,
        element_precision=precision,
    )
    simulator.advance(np.array([[0.0, 20.0]]), 1)
    assert simulator.status[0] == RobotStatus.RUNNING
    pressure = settings.pressure_map.simulated(20.0)
    system = dense_system(part, alpha, velocity, rates, pressure, settings)
    expected = dense_step(*system, velocity, rates, settings)
    got = velocities(simulator, part.mode_count)
    assert np.abs(got - expected).max() < tolerance * np.abs(expected).max()


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


@pytest.mark.parametrize("mode_count", [8, 14, 20, 30])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("instruction_set", ["best", "avx2"])
def test_every_mode_count_has_a_kernel_that_is_right(mode_count, precision, instruction_set):
    part = synthetic_reduced_part(mode_count=mode_count, cells=(6, 4, 4))
    # Single: each of a few hundred sums rounds to 6e-8, and the damping of stiff modes is a
    # difference of nearly equal forces; a wrong tile or a lost row would be wrong by tenths.
    tolerance = 1e-6 if precision == "double" else 1e-3
    assert_one_step_equals(part, 0.3, "published", instruction_set, precision, tolerance)


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
    # Single: the rotation of a crushed element loses a factor of 1 / 0.003.
    tolerance = 1e-6 if precision == "double" else 1e-3
    _, rates, velocity = state_of(PART, 0.0)
    crushed = (scale * direction, rates, velocity)
    assert_one_step_equals(PART, 0.0, "objective", "best", precision, tolerance, crushed)


def crawlers() -> list[Robot]:
    """Three different robots, with points that touch the floor."""
    robots = []
    for angles in ([20.0, 140.0, 260.0], [-20.0, -140.0, -260.0], [0.0, 90.0, 180.0, 270.0]):
        mounts = []
        for number, angle in enumerate(angles):
            turn = rotation_about("z", angle)
            pose = Pose(turn @ rotation_about("y", 15.0), turn @ np.array([100.0, 0.0, 9.0]))
            mounts.append(Mount(PART, pose, (number % 2,)))
        robots.append(Robot(Hub(0.075, np.zeros(3), 60.0 * np.eye(3), np.zeros(3)), tuple(mounts)))
    return robots


GAIT = np.random.default_rng(3).uniform(0.0, 12.0, (8, 2))


def march(simulator: BatchedSimulator) -> dict[str, np.ndarray]:
    for command in GAIT:
        simulator.advance(np.tile(command, (len(simulator.robots), 1)), 20)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    return {name: simulator.read(name) for name in ("position", "rotation", "modes", "impulses")}


def test_a_robot_is_the_same_bits_in_any_batch_and_with_any_threads():
    settings = replace(SETTINGS, element_precision="single")
    robots = crawlers()
    together = march(BatchedSimulator(robots * 4, settings, thread_count=3))
    for index, robot in enumerate(robots):
        alone = march(BatchedSimulator([robot], settings, thread_count=1))
        for name, value in alone.items():
            for copy in range(index, 12, 3):
                same = together[name][copy][: value.shape[1]]
                assert np.array_equal(value[0], same), (name, copy)


def test_mirror_image_robots_walk_mirror_image_paths():
    """Robots 0 and 1 mirror each other in y; so do their paths, but for the friction solver.

    Gauss-Seidel visits the points of the mirror image in another order, and stops when a sweep
    changes no velocity by more than 1e-9 mm/s; its slowest error is some 1e4 sweeps long, so 160
    steps of 0.01 s may differ by up to about 1e-3 mm. They travel millimetres.
    """
    settings = replace(SETTINGS, contact_tolerance_mm_per_s=1e-9, contact_sweeps=3000)
    state = march(BatchedSimulator(crawlers()[:2], settings, thread_count=1))
    left, right = state["position"]
    assert np.abs(left - right * [1.0, -1.0, 1.0]).max() < 1e-3
    assert np.abs(left).max() > 0.1  # it moved at all


def test_every_step_obeys_the_contact_law():
    """Points that carry load end the step on the floor, within the cone; none ends below it."""
    simulator = BatchedSimulator(crawlers(), SETTINGS, 1)
    for command in GAIT:
        for _ in range(20):
            simulator.advance(np.tile(command, (3, 1)), 1)
            impulses = simulator.read("impulses")
            normal, tangent = impulses[..., 0], np.linalg.norm(impulses[..., 1:], axis=-1)
            assert np.all(normal >= 0.0)
            assert np.all(tangent <= SETTINGS.friction * normal * (1.0 + 1e-12))
    assert simulator.read("unconverged_total").sum() == 0
    assert simulator.read("worst_residual").max() <= SETTINGS.contact_tolerance_mm_per_s
    assert simulator.read("contact_total").min() > 160  # they were on the floor
    # The step's floor law is linear in the velocities: a turn W over h = 0.01 s leaves it by half
    # of (W h)^2 times a lever of 150 mm, 0.03 mm at 2 rad/s.
    assert simulator.read("worst_penetration").max() < 0.03


def test_a_settling_robot_loses_energy():
    """Without pressure, elastic, gravitational and kinetic energy together never grow.

    Velocities are differences of positions over a step: of first order in the turn of a step, some
    0.01 rad, so energies of motion are good to a percent of the largest of them.
    """
    robot = crawlers()[2]
    settings = replace(SETTINGS, damping="objective", floor_height_mm=-25.0)  # it falls first
    simulator = BatchedSimulator([robot], settings, 1)
    node_mass = PART.mass / len(PART.rest_nodes)
    gravity, h = settings.gravity_mm_per_s2, settings.time_step_s
    stored, kinetic, before = [], [], None
    for _ in range(120):
        simulator.advance(np.zeros((1, 2)), 1)
        hub, turn = simulator.read("position")[0], simulator.read("rotation")[0]
        alpha = simulator.read("modes")[0, :, : PART.mode_count]
        world = np.array(
            [
                mount.pose.apply(PART.positions(own)) @ turn.T + hub
                for mount, own in zip(robot.mounts, alpha, strict=True)
            ]
        )
        energy = gravity * (HUB.mass * hub[2] + node_mass * world[..., 2].sum())
        for own in alpha:
            for elements in (PART.tetrahedra, PART.membrane):
                gradient = elements.gradients(own)
                law = law_with_rotation(elements.law, "polar")
                energy += elements.measure @ law.energy(np.moveaxis(gradient, 0, 2))
        now = (hub, world)
        if before is not None:
            speeds = [np.sum(((new - old) / h) ** 2) for new, old in zip(now, before, strict=True)]
            stored.append(energy)
            kinetic.append(0.5 * (HUB.mass * speeds[0] + node_mass * speeds[1]))
        before = now
    total = np.array(stored) + np.array(kinetic)
    assert np.all(np.diff(total) < 0.01 * max(kinetic))
    assert max(kinetic) > 0.3 * (total[0] - total[-1])  # it moved
    assert kinetic[-1] < 1e-4 * max(kinetic)


def test_pressure_moves_no_faster_than_its_rate():
    simulator = BatchedSimulator(crawlers()[:1], SETTINGS, 1)
    expected = np.zeros(2)
    for command in ([40.0, 1.0], [0.0, 30.0]):
        simulator.advance(np.array([command]), 7)
        for _ in range(7):
            expected = rate_limit(expected, np.array(command), 150.0, 0.01)
        assert simulator.read("regulated")[0] == pytest.approx(expected)


def test_a_diverging_robot_stops_alone_and_stays_finite():
    robots = crawlers()
    healthy = march(BatchedSimulator(robots, SETTINGS, 2))
    simulator = BatchedSimulator(robots, SETTINGS, 2)
    simulator.write(1, "velocity", np.array([0.0, 0.0, 1e9]))
    for command in GAIT:
        simulator.advance(np.tile(command, (3, 1)), 20)
    assert simulator.status.tolist() == [0, RobotStatus.DIVERGED, 0]
    assert np.array_equal(simulator.read("position")[[0, 2]], healthy["position"][[0, 2]])
    assert np.all(np.isfinite(simulator.read("modes")))
    simulator.reset(np.array([False, True, False]))
    assert simulator.status[1] == RobotStatus.RUNNING


def test_inactive_robots_stand_still():
    simulator = BatchedSimulator(crawlers(), SETTINGS, 1)
    simulator.advance(np.full((3, 2), 5.0), 10, active=np.array([True, False, True]))
    assert np.array_equal(simulator.read("position")[1], np.zeros(3))
    assert np.all(simulator.read("step_count") == [10, 0, 10])


def test_single_precision_elements_stay_within_their_rounding():
    single = march(BatchedSimulator(crawlers(), replace(FRESH, element_precision="single"), 1))
    double = march(BatchedSimulator(crawlers(), FRESH, 1))
    # Float strains of 1e-7 over strains of 1e-2 leave 1e-5 of motions of a few mm, amplified by
    # stick and slip: ten times that.
    assert np.abs(single["position"] - double["position"]).max() < 1e-3


def test_rollout_of_one_robot_equals_the_batch():
    robot = crawlers()[2]
    model = ReducedRobot(robot, SETTINGS)
    _, trajectory = rollout(model, np.repeat(GAIT, 20, axis=0), settling_steps=0, record_every=10)
    batch = march(BatchedSimulator([robot], SETTINGS, 1))
    assert np.array_equal(trajectory.hub_position_mm[-1], batch["position"][0])
    assert trajectory.node_positions_mm.shape[:2] == (17, 4)
    assert trajectory.status == "completed"


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_bad_pressures_are_refused(bad):
    simulator = BatchedSimulator(crawlers()[:1], SETTINGS, 1)
    with pytest.raises(ValueError, match="finite and not negative"):
        simulator.advance(np.array([[1.0, bad]]), 1)


def test_a_law_that_the_engine_does_not_know_is_refused():
    other = replace(PART, tetrahedron_material=Material(1160.0, 0.2, "isochoric_neo_hookean"))
    with pytest.raises(ValueError, match="to be stepped, got 'isochoric_neo_hookean'"):
        BatchedSimulator([Robot(HUB, (Mount(other, POSE, (1,)),))], SETTINGS, 1)


def test_refused_robots_leave_the_old_ones_running():
    simulator = BatchedSimulator(crawlers(), SETTINGS, 1)
    with pytest.raises(ValueError, match="unknown regulator 2"):
        simulator.set_robots([*crawlers()[:2], Robot(HUB, (Mount(PART, POSE, (2,)),))])
    assert len(march(simulator)["position"]) == 3


def test_bad_robots_and_settings_are_refused():
    with pytest.raises(ValueError, match="unknown regulator 2"):
        BatchedSimulator([Robot(HUB, (Mount(PART, POSE, (2,)),))], SETTINGS, 1)
    with pytest.raises(ValueError, match="one regulator for each cavity"):
        Mount(PART, POSE, (0, 1))
    with pytest.raises(ValueError, match="expected at least one robot"):
        BatchedSimulator([], SETTINGS, 1)
    with pytest.raises(ValueError, match="damping must be one of published, objective"):
        SimulationSettings(damping="publishd")
    with pytest.raises(ValueError, match="time_step_s must be positive"):
        SimulationSettings(time_step_s=0.0)
    with pytest.raises(ValueError, match="friction must be finite"):
        SimulationSettings(friction=float("nan"))


def test_contact_forces_carry_a_resting_robot_as_pressed_points_stand_still():
    # At rest the momentum is constant, so F = W; what is left moves less than 1e-3 of g h a step.
    part = synthetic_reduced_part(mode_count=6, cells=(6, 4, 4))
    poses = [Pose(rotation_about("z", angle), np.zeros(3)) for angle in (0.0, 120.0, 240.0)]
    robot = Robot(HUB, tuple(Mount(part, pose, (0,)) for pose in poses))
    settings = replace(SETTINGS, floor_height_mm=-30.0, contact_sweeps=1000)
    reduced = ReducedRobot(robot, settings)
    _, trajectory = rollout(reduced, np.zeros((400, 2)), record_every=400)
    weight = (3 * part.mass + HUB.mass) * 9800.0
    force = trajectory.contact_force_mN[-1]
    np.testing.assert_allclose(force.sum(axis=(0, 1)), [0.0, 0.0, weight], atol=1e-3 * weight)
    speed = np.abs(trajectory.contact_velocity_mm_per_s[-1])
    assert np.any(force[..., 2] > 0.0)
    assert speed.max() < 1e-3 * 9800.0 * settings.time_step_s
