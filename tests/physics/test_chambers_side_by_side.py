"""Cavities side by side: each at its own pressure; mirrored ones bend a leg to mirrored sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.synthetic_part import vibration_modes
from helpers.two_chambers import two_chamber_leg

from pneumorph.fem.bend import end_face_bend_deg, end_face_turn_deg
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.static import static_equilibrium
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.reduction.walk_snapshots import WalkPhysics, WalkSnapshotSettings, walk_snapshots

PRESSURE_KPA = 30.0
_REFLECTION = np.array([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def leg() -> PartModel:
    return two_chamber_leg()


def bent(leg: PartModel, shares: tuple[float, float]) -> np.ndarray:
    result = static_equilibrium(
        leg.inflated_in(shares), PRESSURE_KPA, FaceTie.of(leg.mesh).nodes, rotation="polar"
    )
    assert result.converged
    return result.positions


def test_mirrored_chambers_bend_mirrored_angles(leg: PartModel) -> None:
    """To the solver's 1e-8 of the loads, which leaves a hundred-thousandth of the bend."""
    left, right, both = (bent(leg, shares) for shares in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0)))
    image = left[leg.mesh.mirror_nodes] * _REFLECTION
    end = leg.mesh.node_set("outer_end_face")
    sideways = [(x - leg.rest_nodes)[end, 1].mean() for x in (left, right, both)]
    assert sideways[0] < -0.5  # away from the chamber that is inflated
    np.testing.assert_allclose(right, image, atol=1e-5)
    assert sideways[2] == pytest.approx(0.0, abs=1e-5)
    turns = [end_face_turn_deg(leg.mesh, x) for x in (left, right, both)]
    assert turns[0] == pytest.approx(turns[1], rel=1e-5)
    # Both together bend straight down, where the turn about any axis is that about y.
    assert end_face_bend_deg(leg.mesh, both) == pytest.approx(turns[2], rel=1e-6)
    assert turns[2] > turns[0]


def test_pressures_add_up_and_their_tangent_is_the_derivative(leg: PartModel) -> None:
    """Forces are linear in the pressures; central differences of a cubic function of x, to rounding
    and the third derivative that a step of 1e-4 mm leaves (1e-8 of the force)."""
    rng = np.random.default_rng(0)
    x = leg.rest_nodes + rng.normal(0.0, 0.2, (leg.node_count, 3))
    pressures = np.array([20.0, -7.0])
    alone = [leg.pressure_force(x, np.array([p, q])) for p, q in ((20.0, 0.0), (0.0, -7.0))]
    np.testing.assert_allclose(leg.pressure_force(x, pressures), sum(alone), atol=1e-12)
    np.testing.assert_allclose(
        leg.pressure_force(x, 5.0), leg.pressure_force(x, np.array([5.0, 5.0])), atol=1e-12
    )
    step, direction = 1e-4, rng.normal(size=x.shape)
    change = leg.pressure_force(x + step * direction, pressures)
    change -= leg.pressure_force(x - step * direction, pressures)
    tangent = leg.tangent(x, pressures, "polar") - leg.tangent(x, 0.0, "polar")
    np.testing.assert_allclose(
        -(tangent @ direction.ravel()), change.ravel() / (2 * step), atol=1e-5
    )
    with pytest.raises(ValueError, match=r"pressure_kPa has shape \(3,\), expected one for all"):
        leg.pressure_force(x, np.zeros(3))
    with pytest.raises(
        ValueError, match="got 1 shares of the pressure, expected one for each of 2"
    ):
        leg.inflated_in([1.0])


def test_chambers_that_a_reduction_would_take_for_others_are_refused(leg: PartModel) -> None:
    """It numbers them by the mesh's names: exchanged, its tip went to the other side unsaid."""
    first, second = leg.cavity_names
    modes = vibration_modes(leg, 4)
    reduced = assemble_reduced_part(leg, modes)
    modes = reduced.modes
    for number in range(2):
        alone = leg.inflated_in([float(number == each) for each in range(2)])
        force = np.einsum("nim,ni->m", modes, alone.pressure_force(leg.rest_nodes, 1.0))
        gradient = reduced.cavity(number).gradient(np.zeros(4))
        np.testing.assert_allclose(force, gradient, atol=1e-6 * np.abs(gradient).max())
    for names in ((second, first), (second,), ()):
        other = PartModel(leg.mesh, leg.material, leg.mass_kg, leg.membranes, names)
        said = rf"cavity is {', '.join(names) or 'none'}, expected .*, {first}, {second}: a reduced"
        with pytest.raises(ValueError, match=said):
            reduced.check_model(other)
        if len(names) == 2:  # the bend of one chamber is compared with that of one
            with pytest.raises(ValueError, match=said):
                assemble_reduced_part(other, modes)
    with pytest.raises(ValueError, match=f"cavity is {first}, {first}, expected each region once"):
        PartModel(leg.mesh, leg.material, leg.mass_kg, leg.membranes, (first, first))


def test_the_engine_inflates_each_cavity_as_numpy_does(leg: PartModel) -> None:
    material = replace(leg.material, law="st_venant_kirchhoff")
    sheets = [
        replace(each, material=replace(each.material, law="st_venant_kirchhoff"))
        for each in leg.membranes
    ]
    part = PartModel(leg.mesh, material, leg.mass_kg, sheets, leg.cavity_names)
    assert part.compiled is not None
    x = part.rest_nodes + np.random.default_rng(0).normal(0.0, 0.05, (part.node_count, 3))
    for pressure in (np.array([20.0, 0.0]), np.array([3.0, 11.0]), 7.0):
        data = np.zeros(len(part.assembly.indices))
        force = part.compiled.force_and_tangent(x, pressure, None, data, 1.0)
        wanted = part.internal_force(x, "polar") + part.pressure_force(x, pressure)
        np.testing.assert_allclose(force, wanted, atol=1e-9 * np.abs(wanted).max())
        tangent = part.tangent_data(x, pressure, "polar")
        np.testing.assert_allclose(data, tangent, atol=1e-9 * np.abs(tangent).max())


def robot(leg: PartModel, regulators: list[tuple[int, ...]]) -> FullRobot:
    """Two legs, to the front and to the back, of a box that is its own mirror image."""
    mesh = box_mesh((16.0, 14.0, 6.0), (2, 2, 1))
    mesh = replace(mesh, nodes=mesh.nodes - [8.0, 7.0, 0.0])
    place = Pose(np.eye(3), np.array([8.0, 0.0, 0.0]))
    mounts = [
        (leg, Pose(rotation_about("z", angle)).compose(place), numbers)
        for angle, numbers in zip((0.0, 180.0), regulators, strict=True)
    ]
    physics = Physics(
        regulator_count=2,
        damping="objective",
        pressure_map=PressureMap(1.0, 0.0),
        floor_height_mm=-0.01,
    )
    return FullRobot(RigidHub(mesh, 0.02), mounts, physics)


def test_a_robot_with_a_regulator_for_each_cavity_walks_mirrored_when_these_are_exchanged(
    leg: PartModel,
) -> None:
    """Chambers left and right of the robot's middle are exchanged: the front leg's left one is the
    back leg's right one. The step's Newton tolerance of 1e-7 mm/s leaves far less than 1e-6 mm."""
    commands = np.tile([25.0, 0.0], (18, 1))
    paths = []
    for order in ((0, 1), (1, 0)):
        walker = robot(leg, [order, order[::-1]])
        state = walker.settled_state()
        state, _ = walker.rollout(state, commands, record_every=18)
        paths.append([*state.positions, state.pressure_work_mJ])
    (front, back, work), (front_image, back_image, work_image) = paths
    to = leg.mesh.mirror_nodes
    assert np.abs(front - robot(leg, [(0, 1), (1, 0)]).initial_state().positions[0]).max() > 0.3
    np.testing.assert_allclose(front_image, front[to] * _REFLECTION, atol=1e-6)
    np.testing.assert_allclose(back_image, back[to] * _REFLECTION, atol=1e-6)
    np.testing.assert_allclose(work_image, work, rtol=1e-6)
    assert work.min() > 0.0
    assert robot(leg, [(0, 1), (1, 0)]).shape[0].leg_regulators.tolist() == [[1, 2], [2, 1]]


def test_one_regulator_for_all_cavities_is_as_one_for_each(leg: PartModel) -> None:
    commands = np.tile([20.0, 5.0], (5, 1))
    states = []
    for regulators in ([(0,), (1,)], [(0, 0), (1, 1)]):
        walker = robot(leg, regulators)
        state, _ = walker.rollout(walker.initial_state(), commands, record_every=5)
        states.append(state)
    for one, other in zip(states[0].positions, states[1].positions, strict=True):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(ValueError, match="2 cavities has 3 regulators, expected one"):
        robot(leg, [(0, 1, 1), (0,)])
    with pytest.raises(ValueError, match=r"regulator must be 0 \.\. 1, got 2"):
        robot(leg, [(0, 2), (0,)])


def test_robots_that_walk_for_snapshots_inflate_all_cavities_or_one(leg: PartModel) -> None:
    """One robot after the other: both chambers, the left one, the right one. Inflated alone a
    chamber bends the leg to the other side, both do not."""
    hub = RigidHub(box_mesh((16.0, 14.0, 6.0), (2, 2, 1)), 0.02)
    poses = [Pose(rotation_about("z", angle)) for angle in (0.0, 180.0)]
    settings = WalkSnapshotSettings(
        leg_counts=(1, 1, 1), corner_limit=1, hold_s=0.3, settling_steps=1, record_every=10,
        amplitude_kPa=PRESSURE_KPA,
    )  # fmt: skip
    acting = WalkPhysics(Physics(damping="objective", floor_height_mm=-1000.0))
    end = leg.mesh.node_set("outer_end_face")
    sideways = []
    for number in range(3):
        walked = walk_snapshots(leg, hub, poses, settings, number, acting)
        assert isinstance(walked, Snapshots)
        sideways.append(float(walked.displacement[-1][end, 1].mean()))
    assert abs(sideways[0]) < 0.01 < 0.1 < -sideways[1]
    assert sideways[2] == pytest.approx(-sideways[1], rel=0.01)


def test_a_reduced_leg_bends_to_each_side_as_its_finite_elements_do(leg: PartModel) -> None:
    """Snapshots of all cavities together and of each alone: nearly as many modes as states
    follow them to a thousandth, and by sampled elements to some percent."""
    settings = StaticSnapshotSettings(
        bend_pressure_kPa=PRESSURE_KPA, bend_count=4, load_count=8, load_pressure_kPa=PRESSURE_KPA,
        load_limit_mN=60.0, rotation="polar",
    )  # fmt: skip
    bend = bend_snapshots(leg, settings)
    assert bend.sources == ["bend", "bend of cavity_left", "bend of cavity_right"]
    loads = load_snapshots(leg, settings, range(8), bend)
    reduction = ReductionSettings(mode_limit=20, mode_tolerance=1e-4, rotation="polar")
    part, report = reduce_part(leg, Snapshots.joined([bend, loads]), reduction)
    assert part.cavity_count == 2
    sides = report.bend_of_cavities
    assert list(sides) == ["cavity_left", "cavity_right"]
    np.testing.assert_allclose(
        sides["cavity_left"]["full_deg"], sides["cavity_right"]["full_deg"], rtol=1e-4
    )
    np.testing.assert_allclose(
        sides["cavity_left"]["reduced_deg"], sides["cavity_right"]["reduced_deg"], rtol=1e-4
    )
    assert report.bend_error_unsampled_percent is not None
    assert report.bend_error_percent is not None
    assert report.bend_error_unsampled_percent < 1.0
    assert report.bend_error_percent < 8.0
