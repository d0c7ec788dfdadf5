"""Every number of a world acts on finite elements as on reduced robots: laws and identities.

How legs point is in `test_robot_spec.py`, how regulators lag in `test_randomisation.py`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.full_module import full_module
from helpers.small_robot import small_leg
from helpers.synthetic_part import synthetic_mesh

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.physics.air import Air
from pneumorph.physics.floor import HeightField
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.physics import Physics
from pneumorph.simulation.randomisation import World

AIR = Air("orifice", filling_mm3_per_s_kPa=(2.0,), venting_mm3_per_s_kPa=(20.0,))
AS_IS = World(1.2, 1.0, 1.0, 0.0, 0.0)
DESIGN = "1.2"


def hub() -> HubSpec:
    mesh = box_mesh((16.0, 16.0, 9.0), (2, 2, 1))
    mesh = replace(mesh, nodes=mesh.nodes + np.array([-8.0, -8.0, 1.0]))
    high = mesh.nodes[mesh.nodes[:, 2] < 1.0 + 1e-9] + np.array([0.0, 0.0, 8.0])
    return HubSpec(mesh, Material(500.0, 0.3), 0.03, np.array([0.0, 0.0, 10.0]), high)


def spec(leg: Module, physics: Physics) -> RobotSpec:
    place = Pose(np.eye(3), np.array([8.0, -6.0, 1.0]))
    poses = [Pose(rotation_about("z", angle)).compose(place) for angle in (0.0, 180.0)]
    return RobotSpec(hub(), tuple(Site(pose, leg) for pose in poses), physics, hub_model="rigid")


def box(modulus_factor: float = 1.0, mass_factor: float = 1.0) -> PartModel:
    assert mass_factor == 1.0
    return small_leg(3000.0 * modulus_factor)


BOXES = spec(
    Module("a box", lambda: None, box),
    Physics(floor_height_mm=0.0, regulator_count=2, mass_damping_per_s=0.0),
)


@pytest.mark.parametrize("name", ["published", "measured"])
def test_moduli_masses_and_damping_are_factors_on_forces(name) -> None:
    """Elastic forces are linear in the moduli, those of what relaxes in modulus times damping,
    weights in the masses: to rounding, for solids, volumes and sheets of either leg."""
    mesh = synthetic_mesh((4, 4, 4))
    mesh = mesh if name == "published" else quadratic_mesh(mesh)
    physics = replace(leg_kind(name).physics, regulator_count=2, friction_by_surface=())
    robot = spec(module_of_leg(name, mesh=mesh), physics)
    world = replace(AS_IS, modulus_factor=1.2, mass_factor=0.9, damping_factor=1.4)
    own = robot.in_world(world)
    usual, changed = robot.module.full, own.module.full
    x = usual.rest_nodes + np.random.default_rng(0).normal(scale=0.02, size=usual.rest_nodes.shape)
    force = usual.internal_force(x, "polar")
    tolerance = 1e-9 * np.abs(force).max()
    np.testing.assert_allclose(changed.internal_force(x, "polar"), 1.2 * force, atol=tolerance)
    np.testing.assert_allclose(changed.node_mass, 0.9 * usual.node_mass, rtol=1e-12)
    full = own.full(DESIGN)
    assert full.hub.mass_kg == pytest.approx(0.9 * robot.full(DESIGN).hub.mass_kg, rel=1e-12)
    assert full.physics.stiffness_damping_s == 1.4 * robot.physics.stiffness_damping_s
    branches, theirs = usual.branches, changed.branches
    assert (branches is None) == (theirs is None) == (name == "published")
    if branches is not None and theirs is not None:
        state = branches.advanced(branches.relaxed(usual.rest_nodes), x, 0.01)
        expected = 1.2 * 1.4 * usual.relaxing_force(state, x)
        found = changed.relaxing_force(state, x)
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def momentum(robot: FullRobot, state: FullRobotState) -> np.ndarray:
    """Of all nodes and the hub [mN s], (3,); the hub's centre is its frame's origin moved with it,
    and its points' mean velocity is its own, as it does not turn."""
    legs = sum(
        leg.part.node_mass @ velocity
        for leg, velocity in zip(robot.legs, state.velocities, strict=True)
    )
    points = robot.hub.point_map(state.hub, robot.hub.mesh.nodes) @ state.hub.velocity
    moved: np.ndarray = legs + robot.hub.mass_kg * points.reshape(-1, 3).mean(axis=0)
    return moved


@pytest.mark.parametrize(
    "change",
    [{"friction": 0.3}, {"friction_by_surface": (("bottom", 0.3),)}],
    ids=["friction", "friction by surface"],
)
def test_a_robot_slides_down_a_slope_as_coulomb_has_it(change) -> None:
    """While all slides, momentum grows along the floor by m g sin(a) t, less the coefficient times
    the impulse of the floor, m g cos(a) t and what is gained normal to it. To the tolerance of the
    contact solve, 1e-7 mm/s of 30 mm/s."""
    own = BOXES.in_world(replace(AS_IS, floor_slope_deg=-25.0, **change))
    robot = own.full(DESIGN)
    state = robot.settled_state(5)
    start, rest = momentum(robot, state), np.zeros(2)
    steps = 10
    for _ in range(steps):
        state = robot.step(state, rest)
        assert np.all(state.contact_velocities[state.impulses[:, 0] > 0.0, 1] > 0.0)
    gained = momentum(robot, state) - start
    mass = robot.hub.mass_kg + 2.0 * 0.02
    weight = mass * 9800.0 * 0.01 * steps
    slope = np.radians(25.0)
    floor = weight * np.cos(slope) + gained[2]
    assert gained[0] == pytest.approx(weight * np.sin(slope) - 0.3 * floor, rel=1e-6)


def test_a_ground_of_the_worlds_own_is_that_surface_for_finite_elements() -> None:
    own = BOXES.in_world(replace(AS_IS, ground_roughness_mm=2.0, ground_seed=5))
    floor = own.full(DESIGN).floor
    assert floor.description == "roughness of 2 mm over 40 mm, seed 5"
    points = np.random.default_rng(0).uniform(-200.0, 200.0, (50, 3))
    ground = Ground(rough=RoughGround(2.0, 40.0, 5)).grid()
    assert isinstance(floor, HeightField)
    expected = points[:, 2] - floor.base_mm - ground.height(*points[:, :2].T)
    np.testing.assert_allclose(
        floor.gap(points) / floor.frames(points)[:, 0, 2], expected, atol=1e-12
    )
    assert np.ptp(expected - points[:, 2]) > 4.0


@pytest.mark.parametrize("name", ["filling_factor", "venting_factor"])
def test_factors_on_valves_are_factors_on_time(name) -> None:
    """Through twice the conductance a pressure is where it otherwise is after twice the time."""
    robot = replace(BOXES, physics=replace(BOXES.physics, air=AIR))
    up, down = np.array([40.0, 20.0]), np.zeros(2)
    commands = [up] if name == "filling_factor" else [up, down]

    def pressures(factor: float, last: int) -> np.ndarray:
        full = robot.in_world(replace(AS_IS, **{name: factor})).full(DESIGN)
        regulated = np.zeros(2)
        for number, command in enumerate(commands):
            for _ in range(last if number == len(commands) - 1 else 200):
                regulated = full.regulators.after(regulated, command, 0.01)
        return regulated

    slow, quick = pressures(1.0, 4), pressures(2.0, 2)
    assert 0.5 < slow[0] < 39.0
    np.testing.assert_allclose(quick, slow, rtol=1e-9)


def test_finite_elements_that_cannot_be_changed_are_refused_by_name() -> None:
    robot = spec(full_module("a cast box", small_leg()), BOXES.physics)
    assert robot.in_world(replace(AS_IS, friction=0.3)).module.full is robot.module.full
    with pytest.raises(
        ValueError, match=r"a cast box is asked for with modulus_factor 1\.1 and mass"
    ):
        _ = robot.in_world(replace(AS_IS, modulus_factor=1.1)).module.full
