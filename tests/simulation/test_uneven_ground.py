"""Reduced robots on grounds: closed forms, the reference in NumPy and finite elements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.crawlers import FRESH, GAIT, PHYSICS, STEPPER, crawlers, march
from helpers.steps_with_contact import FRICTION_TOLERANCE, assert_steps_with_contact_equal

from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.height_map import HeightMap
from pneumorph.physics.physics import Physics
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.robot.robot import Hub, Mount, Robot, hub_of_mesh
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.stepper_settings import Linearised, StepperSettings

GRAVITY = 9800.0
ROUGH = Ground(rough=RoughGround(4.0, 30.0, seed=3))
CONTACT = replace(FRESH, contact_tolerance_mm_per_s=FRICTION_TOLERANCE, contact_sweeps=1000)
TIGHT = StepperSettings(contact_tolerance_mm_per_s=1e-7, contact_sweeps=2000)
NO_PRESSURE = np.zeros((1, 1))


def read(tmp_path: Path, heights: np.ndarray, spacing_mm: float) -> Ground:
    """A ground of these heights, (row, column)."""
    np.save(tmp_path / "heights.npy", heights)
    return Ground(HeightMap(tmp_path / "heights.npy", mm_per_pixel=spacing_mm))


def ramp(tmp_path: Path, slope_deg: float, turned_deg: float = 0.0) -> Ground:
    """A plane that rises towards a direction turned from x, 4 m wide."""
    x, y = np.meshgrid(np.linspace(-2000, 2000, 21), np.linspace(2000, -2000, 21))
    turn = np.radians(turned_deg)
    along = np.cos(turn) * x + np.sin(turn) * y
    return read(tmp_path, np.tan(np.radians(slope_deg)) * along, 200.0)


def base_of(robot: Robot, physics: Physics) -> float:
    """What the robot's ground is counted from, after it was lowered [mm]."""
    return float(physics.floor(robot.standing_points).base_mm)


@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_ground_of_constant_slope_is_the_plane_of_that_slope(
    tmp_path: Path, instruction_set: str, precision: str
) -> None:
    """The same fall, landing, sliding and walking in axes that lean by 15 degrees.

    Both solve the contact law to 1e-8 mm/s; what is left of it and rounding of doubles grow to less
    than 1e-5 mm in 60 steps. The elements see no axes of the world.
    """
    lean, stepper = rotation_about("y", -15.0), replace(
        CONTACT, element_precision=precision, instruction_set=instruction_set
    )  # fmt: skip
    robot = crawlers()[0]
    sloping = replace(PHYSICS, floor_slope_deg=15.0, friction=0.2)
    uneven = replace(PHYSICS, friction=0.2, ground=ramp(tmp_path, 15.0))
    plane, ground = (BatchedSimulator([robot], each, stepper, 1) for each in (sloping, uneven))
    above = np.array([30.0, -20.0, 3.0 - sloping.floor_height_mm])
    base = np.array([0.0, 0.0, base_of(robot, uneven)])
    level = np.array([0.0, 0.0, sloping.floor_height_mm])
    plane.write(0, "position", above + level)
    ground.write(0, "position", lean @ above + base)
    ground.write(0, "rotation", lean)
    for command in GAIT[:3]:
        for each in (plane, ground):
            each.advance(command[None], 20)
    moved, expected = ground.state(0), plane.state(0)
    assert expected.velocity[0] < -10.0
    there = lean @ (expected.position - level) + base
    np.testing.assert_allclose(moved.position, there, atol=1e-5)
    np.testing.assert_allclose(moved.rotation, lean @ expected.rotation, atol=1e-6)
    np.testing.assert_allclose(moved.modes, expected.modes, atol=1e-4)
    assert moved.impulses[:, 0].sum() == pytest.approx(expected.impulses[:, 0].sum(), rel=1e-4)


def particle() -> Robot:
    """A hub that touches with its centre of mass alone."""
    return Robot(Hub(0.1, np.zeros(3), np.eye(3), np.zeros(3), np.zeros((1, 3))), ())


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_it_slides_down_a_slope_of_any_direction_with_the_closed_form(
    tmp_path: Path, friction: float
) -> None:
    slope, turned, steps = 20.0, 35.0, 40
    physics = Physics(
        mass_damping_per_s=0.0, floor_height_mm=0.0, regulator_count=1, friction=friction,
        ground=ramp(tmp_path, slope, turned),
    )  # fmt: skip
    simulator = BatchedSimulator([particle()], physics, TIGHT, 1)
    simulator.advance(NO_PRESSURE, steps)
    angle = np.radians(slope)
    acceleration = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    # Implicit Euler: the sum of h (k h a), k = 1..n.
    way = acceleration * 0.01**2 * steps * (steps + 1) / 2.0
    down = -np.array([np.cos(np.radians(turned)), np.sin(np.radians(turned))])
    expected = way * np.array([*(np.cos(angle) * down), -np.sin(angle)])
    np.testing.assert_allclose(simulator.read("position")[0], expected, atol=1e-5 * way)


def bowl(tmp_path: Path) -> Ground:
    """A cosine bowl 20 mm deep and 200 mm wide; curvature up to 1/100 mm."""
    x, y = np.meshgrid(np.linspace(-150, 150, 121), np.linspace(-150, 150, 121))
    wave = 2.0 * np.pi / 200.0
    return read(tmp_path, -10.0 * np.cos(wave * x) - 10.0 * np.cos(wave * y), 2.5)


def test_without_friction_energy_is_kept_to_the_order_of_the_step(tmp_path: Path) -> None:
    """Sliding once through a bowl: what energy is wrong by is of the order of the step, and half of
    it with half the step."""
    ground, start = bowl(tmp_path), np.array([30.0, 20.0])
    losses = []
    for step in (0.002, 0.001):
        physics = Physics(
            mass_damping_per_s=0.0, floor_height_mm=0.0, regulator_count=1, friction=0.0,
            time_step_s=step, ground=ground,
        )  # fmt: skip
        simulator = BatchedSimulator([particle()], physics, TIGHT, 1)
        base, grid = base_of(particle(), physics), ground.grid()
        height = float(grid.height(*start[:, None])[0]) + base
        simulator.write(0, "position", np.array([*start, height]))
        simulator.advance(NO_PRESSURE, round(0.2 / step))
        state = simulator.state(0)
        assert state.position[0] < 0.0  # across the middle
        potential = GRAVITY * (height - state.position[2])
        kinetic = 0.5 * state.velocity @ state.velocity
        losses.append(1.0 - kinetic / potential)
    assert abs(losses[0]) < 0.01
    assert losses[0] / losses[1] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    "ground",
    [ROUGH, Ground(steps=Steps(12.0, 60.0, 30.0)), "bowl"],
    ids=["rough", "step", "bowl"],
)
def test_steps_with_sticking_and_sliding_points_equal_the_reference(ground, tmp_path) -> None:
    ground = bowl(tmp_path) if ground == "bowl" else ground
    physics = replace(PHYSICS, damping="objective", floor_slope_deg=6.0, ground=ground)
    simulator = BatchedSimulator(crawlers()[:1], physics, CONTACT, 1)
    simulator.advance(np.zeros((1, 2)), 40)
    stuck, slid = assert_steps_with_contact_equal(simulator, np.repeat(GAIT[:4], 6, axis=0))
    assert stuck > 10
    assert slid > 10


def test_a_fast_robot_sees_the_ground_where_it_comes_to_lie(tmp_path: Path) -> None:
    """Thrown across a bowl, points bend off their planes by more than the tolerance: both solve
    again."""
    physics = replace(PHYSICS, ground=bowl(tmp_path))
    simulator = BatchedSimulator(crawlers()[:1], physics, CONTACT, 1)
    simulator.write(0, "velocity", np.array([300.0, 100.0, -100.0]))
    assert_steps_with_contact_equal(simulator, np.zeros((10, 2)))
    # On one plane alone a point that does not turn is left half the curvature times its way
    # squared below the ground, 0.079 mm.
    physics = replace(physics, floor_height_mm=0.0, friction=0.0, regulator_count=1)
    simulator = BatchedSimulator([particle()], physics, TIGHT, 1)
    simulator.write(0, "velocity", np.array([400.0, 0.0, 0.0]))
    simulator.advance(NO_PRESSURE, 10)
    assert simulator.tracked_point_mm[0, 0] > 20.0
    assert simulator.read("worst_penetration")[0] < 0.0101


def test_it_rests_on_a_bump_with_forces_that_carry_it() -> None:
    """The floor presses along its own normals; in sum it bears the weight and nothing else."""
    robot = crawlers()[0]
    physics = replace(PHYSICS, ground=ROUGH)
    walker = ReducedRobot(robot, physics, CONTACT)
    state, _ = walker.rollout(walker.initial_state(), np.zeros((300, 2)), 300, record_nodes=False)
    force = walker.leg_contacts(state).force_mN
    mass = robot.hub.mass + sum(mount.part.mass for mount in robot.mounts)
    # Sinking in by mass damping's 10 s is over but for 1e-3 of the weight.
    total = force.sum(axis=(0, 1))
    np.testing.assert_allclose(total, [0.0, 0.0, mass * GRAVITY], atol=1e-3 * mass * GRAVITY)
    sideways = np.linalg.norm(force[..., :2], axis=-1).max()
    assert sideways > 0.05 * mass * GRAVITY / 10.0


def test_ceilings_leave_out_nothing_that_touches(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same bits where every point is looked at."""
    ground = replace(ROUGH, steps=Steps(25.0, 40.0, 40.0))
    physics = replace(PHYSICS, ground=ground)
    usual = march(BatchedSimulator(crawlers(), physics, STEPPER, 1))
    high = np.full_like(ground.grid().ceilings, 1e4)
    monkeypatch.setattr(ground.grid(), "ceilings", high)
    everywhere = march(BatchedSimulator(crawlers(), physics, STEPPER, 1))
    for name, values in usual.items():
        np.testing.assert_array_equal(values, everywhere[name], err_msg=name)
    monkeypatch.setattr(ground.grid(), "ceilings", -high)
    sunk = BatchedSimulator(crawlers(), physics, STEPPER, 1)
    sunk.advance(np.zeros((3, 2)), 40)
    assert np.all(sunk.read("position")[:, 2] < -300.0)  # or it finds them anyhow


def test_each_robot_of_a_batch_has_its_own_ground() -> None:
    """To the bit what it does alone; grounds are held once."""
    worlds = [
        World(1.2, 1.0, 1.0, 0.0, 0.0, ground_roughness_mm=roughness, ground_seed=seed)
        for roughness, seed in ((0.0, 0), (2.0, 1), (2.0, 7))
    ]
    expected = march(BatchedSimulator(crawlers(), PHYSICS, STEPPER, 2, worlds))
    for number, (robot, world) in enumerate(zip(crawlers(), worlds, strict=True)):
        physics = world.applied_to(PHYSICS)
        own = march(BatchedSimulator([robot], physics, STEPPER, 1))
        for name, values in own.items():
            there = expected[name][number][: len(values[0])]
            np.testing.assert_array_equal(values[0], there, err_msg=name)
    plain = march(BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1))
    np.testing.assert_array_equal(plain["position"][0], expected["position"][0])
    assert np.abs(plain["position"][1:] - expected["position"][1:]).max() > 1.0


def small_legs(time_step_s: float) -> tuple[FullRobot, Robot]:
    """Two boxes on a rigid hub above rough ground, and the same with all of their modes, which are
    all that their nodes can do."""
    physics = Physics(
        damping="objective", floor_height_mm=-6.0, regulator_count=1, time_step_s=time_step_s,
        ground=Ground(rough=RoughGround(3.0, 40.0, seed=2)),
    )  # fmt: skip
    mesh = box_mesh((30.0, 30.0, 30.0), (1, 1, 1))
    inner = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    free = np.setdiff1d(np.arange(len(mesh.nodes)), inner)
    mesh = replace(
        mesh, node_sets={**mesh.node_sets, "attachment": inner}, contact_points=mesh.nodes[free]
    )
    part = PartModel(mesh, Material(300.0, 0.3), 0.03)
    hub_mesh = box_mesh((40.0, 30.0, 20.0), (1, 1, 1))
    hub_mesh = replace(hub_mesh, nodes=hub_mesh.nodes - [20.0, 15.0, -5.0])
    bottom = hub_mesh.nodes[hub_mesh.nodes[:, 2] < 5.0 + 1e-9]
    poses = [
        Pose(rotation_about("z", angle), rotation_about("z", angle) @ [20.0, -15.0, 0.0])
        for angle in (0.0, 180.0)
    ]
    full = FullRobot(RigidHub(hub_mesh, 0.03, bottom), [(part, pose, 0) for pose in poses], physics)
    modes = np.zeros((len(mesh.nodes), 3, 3 * len(free)))
    for number, node in enumerate(free):
        modes[node, :, 3 * number : 3 * number + 3] = np.eye(3) / np.sqrt(part.node_mass[node])
    mounts = tuple(Mount(assemble_reduced_part(part, modes), pose, ()) for pose in poses)
    return full, Robot(hub_of_mesh(hub_mesh, 0.03, np.zeros(3), bottom), mounts)


def apart_on_rough_ground(linearised: Linearised, time_step_s: float) -> float:
    """Largest distance between nodes of the two after 0.4 s [mm]."""
    full, robot = small_legs(time_step_s)
    walker = ReducedRobot(robot, full.physics, replace(CONTACT, linearised=linearised))
    state, other = walker.initial_state(), full.initial_state()
    start = np.array(other.positions)
    for _ in range(round(0.4 / time_step_s)):
        state, _ = walker.rollout(state, np.zeros((1, 1)), 1, record_nodes=False)
        other = full.step(other, np.zeros(1))
    nodes, same = walker.node_positions(state), np.array(other.positions)
    assert np.abs(same - start).max() > 5.0
    return float(np.abs(nodes - same).max())


def test_it_moves_as_its_finite_elements_do_on_rough_ground() -> None:
    """Same nodes, same elements, same law of contact: both fall onto bumps and settle there alike.

    At the start's velocities alone, what differs are the hub's axes against the world's in a step:
    of the order of the step, so half of it with half the step. With what the turning adds (48) what
    is left is within the depth that is not solved again, 0.01 mm. On a plane nothing turns, and
    they differ by 3e-6 mm.
    """
    usual = [apart_on_rough_ground("start", time_step_s) for time_step_s in (0.01, 0.005)]
    assert usual[0] < 0.03
    assert usual[0] / usual[1] == pytest.approx(2.0, rel=0.25)
    assert apart_on_rough_ground("ahead", 0.01) < 0.01
