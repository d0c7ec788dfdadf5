"""A reduced part of measured silicone: volumes of whole elements, Yeoh's law and relaxation."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.synthetic_part import (
    rubber_part,
    rubber_reduced_part,
    synthetic_reduced_part,
)

from pneumorph.base.artefact import ArtefactError
from pneumorph.fem.body_equations import linearly_implicit_equations
from pneumorph.fem.prony import PronySeries
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.ecsw import EcswSettings, ecsw
from pneumorph.reduction.incremental_pod import MIRROR
from pneumorph.reduction.mirror_pairs import mirror_elements
from pneumorph.reduction.mixed_dilatation import (
    every_element,
    mixed_dilatation,
    pressure_fields,
)
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, bend_snapshots
from pneumorph.robot.robot import Hub, Mount, Robot
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_step import moved_state, step_equations, step_system

MODE_COUNT = 6
MODEL = rubber_part()
PART = rubber_reduced_part(MODE_COUNT)
FLAT = PART.modes.reshape(-1, MODE_COUNT)
STEP_S = 0.01


def some_state(size: float = 0.5, seed: int = 0) -> np.ndarray:
    alpha = size * np.random.default_rng(seed).normal(size=MODE_COUNT)
    assert np.abs(PART.positions(alpha) - PART.rest_nodes).max() > 2.0
    return alpha


def some_springs(seed: int = 1) -> np.ndarray:
    drawn = 0.1 * np.random.default_rng(seed).normal(size=PART.branches.relaxed().shape)
    return drawn + np.swapaxes(drawn, 2, 3)


def test_every_element_with_its_own_pressure_is_the_galerkin_projection():
    """The same sums in another order: rounding of 1e-16 times the number of points, and since
    lambda is 50 times mu, of changes of volume that are differences of large numbers."""
    alpha = some_state()
    x = PART.positions(alpha)
    force = FLAT.T @ MODEL.internal_force(x, "polar").ravel()
    assert np.abs(PART.internal_force(alpha, "polar") - force).max() < 1e-10 * np.abs(force).max()
    for reduced, full in (
        (PART.stiffness(alpha, "polar"), MODEL.stiffness(x, "polar")),
        (PART.objective_stiffness(alpha), MODEL.objective_stiffness(x)),
    ):
        projected = FLAT.T @ full @ FLAT
        assert np.abs(reduced - projected).max() < 1e-10 * np.abs(projected).max()
    energy = PART.dilatation.energy(alpha)
    assert energy == pytest.approx(MODEL.volume_group.energy(x), rel=1e-9)


@pytest.mark.parametrize("pressures", [0, 3])
def test_force_of_the_volumes_is_the_derivative_of_their_energy(pressures):
    volumes, alpha, step = rubber_reduced_part(pressures=pressures).dilatation, some_state(), 1e-5
    force = volumes.force(alpha)
    for mode, unit in enumerate(step * np.eye(MODE_COUNT)):
        slope = (volumes.energy(alpha + unit) - volumes.energy(alpha - unit)) / (2.0 * step)
        # step^2 of third derivatives as large as the force's: 1e-7 at most.
        assert -slope == pytest.approx(force[mode], abs=1e-6 * np.abs(force).max())
    both = np.stack([alpha, -alpha])
    np.testing.assert_allclose(volumes.force(both)[0], force, rtol=1e-12)


def test_fields_of_pressure_hold_the_snapshots_they_are_of():
    group = MODEL.volume_group
    states = [some_state(seed=seed) for seed in range(4)]
    swelling = np.array([group.volumes(PART.positions(s)) / group.rest_volume - 1 for s in states])
    found = pressure_fields(group, swelling, tolerance=1e-9, limit=10)
    product = found.T @ (group.rest_volume[:, None] * found)
    np.testing.assert_allclose(product, np.eye(4), atol=1e-12)
    # Projected on them a snapshot loses nothing, so its energy is that of the finite elements.
    few = mixed_dilatation(group, PART.rest_nodes, PART.modes, found)
    for state in states:
        assert few.energy(state) == pytest.approx(group.energy(PART.positions(state)), rel=1e-9)
    assert pressure_fields(group, swelling, 1e-9, limit=2).shape[1] == 2
    rough = pressure_fields(group, swelling, 0.5, limit=10)
    missed = swelling - (rough @ (rough.T @ (group.rest_volume * swelling).T)).T
    weight = group.rest_volume
    assert np.sum(weight * missed**2) <= 0.25 * np.sum(weight * swelling**2)
    assert rough.shape[1] < 4
    with pytest.raises(ValueError, match="swelling is zero in every snapshot"):
        pressure_fields(group, 0.0 * swelling, 0.01, 4)


def test_fields_of_pressure_are_symmetric_or_antisymmetric_where_the_part_has_a_mirror():
    group, mirror_nodes = MODEL.volume_group, MODEL.mesh.mirror_nodes
    mirror = mirror_elements(group, mirror_nodes)
    np.testing.assert_array_equal(mirror[mirror], np.arange(len(mirror)))
    assert np.all(mirror != np.arange(len(mirror)))  # no element lies on both sides
    swelling = np.random.default_rng(0).normal(size=(3, len(mirror)))
    found = pressure_fields(group, swelling, 1e-9, 10, mirror)
    assert found.shape[1] == 6
    parities = [np.sign(field @ field[mirror]) for field in found.T]
    for field, parity in zip(found.T, parities, strict=True):
        np.testing.assert_allclose(field[mirror], parity * field, atol=1e-12)
    assert parities == [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]
    # Of mirrored modes, terms of another parity than the field's are zero and not rounding.
    drawn = np.random.default_rng(1).normal(size=(*MODEL.rest_nodes.shape, 3))
    image, sides = drawn[mirror_nodes] * MIRROR[:, None], np.array([1.0, 1.0, -1.0])
    cubic = mixed_dilatation(group, MODEL.rest_nodes, drawn + sides * image, found).cubic
    of_modes = np.multiply.outer(sides, np.multiply.outer(sides, sides))
    same = np.multiply.outer(np.array(parities), of_modes) > 0
    assert np.all((cubic != 0.0) == same)
    with pytest.raises(ValueError, match="the image of one is not in the mesh"):
        mirror_elements(group, np.roll(mirror_nodes, 1))


def test_a_rigid_turn_changes_no_volume_and_strains_no_spring():
    """Modes are zero at the attachment, so this is of the unattached shapes of a turn: the two
    columns x and y of the nodes, with which any turn about z is a state."""
    x = MODEL.rest_nodes
    columns = np.zeros((len(x), 3, 4))
    for place, (row, column) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
        columns[:, row, place] = x[:, column]
    turning = assemble_reduced_part(
        MODEL, columns, pressure_fields=every_element(MODEL.volume_group)[:, :20]
    )
    turn = rotation_about("z", 70.0)[:2, :2] - np.eye(2)
    turned = turn.ravel()
    stretched = np.array([0.05, 0.0, 0.0, 0.05])
    # Rounding of single precision in the modes: 1e-7 of the coordinates.
    assert (
        np.abs(turning.dilatation.changes(turned)).max()
        < 1e-5 * np.abs(turning.dilatation.changes(stretched)).max()
    )
    springs = turning.branches.advanced(turning.branches.relaxed(), 0 * turned, turned, STEP_S)
    assert np.abs(springs).max() < 1e-6
    assert (
        np.abs(turning.internal_force(turned, "polar")).max()
        < 1e-5 * np.abs(turning.internal_force(stretched, "polar")).max()
    )


def test_springs_of_every_point_are_those_of_the_finite_elements():
    before, after, springs = some_state(), some_state(0.6, 3), some_springs()
    branches, full = PART.branches, MODEL.branches
    state = full.relaxed(PART.positions(before))
    state = replace(state, spring=np.moveaxis(springs, 1, 3))
    expected = full.advanced(state, PART.positions(after), STEP_S)
    got = branches.advanced(springs, before, after, STEP_S)
    np.testing.assert_allclose(np.moveaxis(got, 1, 3), expected.spring, atol=1e-13)
    force = FLAT.T @ MODEL.relaxing_force(expected, PART.positions(after)).ravel()
    np.testing.assert_allclose(branches.force(got, after), force, atol=1e-11 * np.abs(force).max())
    assert branches.energy(got) == pytest.approx(full.energy(expected), rel=1e-12)
    assert branches.dissipation(got) == pytest.approx(full.dissipation(expected), rel=1e-12)


def test_what_sampled_branches_take_is_never_negative_and_all_that_is_lost():
    """Over a closed path, sampled with any weights: work done on the branches is what the dashpots
    take and what the springs keep. Trapezoids of 1/400 of the path: errors of 1e-5."""
    rng = np.random.default_rng(5)
    weight = np.maximum(rng.normal(size=len(PART.tetrahedron_measure)), 0.0)
    part = replace(PART, tetrahedron_measure=weight * PART.tetrahedron_measure)
    branches, step = part.branches, 1e-3
    direction, count = some_state(), 400
    path = 0.5 * np.sin(np.linspace(0.0, 2.0 * np.pi, count + 1))[:, None] * direction
    springs, work, lost = branches.relaxed(), 0.0, 0.0
    for before, after in pairwise(path):
        moved = branches.advanced(springs, before, after, step)
        mean = branches.force(springs, before) + branches.force(moved, after)
        work -= 0.5 * mean @ (after - before)
        powers = branches.dissipation(springs), branches.dissipation(moved)
        assert min(powers) >= 0.0
        lost += 0.5 * step * sum(powers)
        springs = moved
    assert work == pytest.approx(lost + branches.energy(springs), rel=1e-3)
    assert lost > 0.0


def test_a_relaxing_step_is_the_projection_of_the_finite_elements():
    """Left matrix and right side of the linearly implicit step, of a hub that stands still."""
    physics = Physics(damping="objective", stiffness_damping_s=0.003, mass_damping_per_s=0.0)
    hub = Hub(0.03, np.zeros(3), 20.0 * np.eye(3), np.zeros(3))
    robot = Robot(hub, (Mount(PART, Pose(np.eye(3), np.zeros(3)), (0,)),))
    alpha, rates, springs = some_state(), 10.0 * some_state(seed=4), some_springs()
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    state = ReducedState(
        np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), alpha[None], rates[None], np.zeros(1),
        np.zeros((1 + len(PART.contact_points), 3)), springs[None, ..., rows, columns],
    )  # fmt: skip
    pressure = np.array([7.0])
    system = step_system(robot, physics, state, pressure)
    matrix, right = step_equations(system, np.concatenate([np.zeros(6), rates]), physics)

    x, v = PART.positions(alpha), PART.modes @ rates
    memory = MODEL.branches.relaxed(x)
    memory = replace(memory, spring=np.moveaxis(springs, 1, 3))
    data, impulse = linearly_implicit_equations(MODEL, x, v, 7.0, physics, memory)
    projected = FLAT.T @ MODEL.assembly.matrix(data) @ FLAT
    assert np.abs(matrix[6:, 6:] - projected).max() < 1e-9 * np.abs(projected).max()
    expected = FLAT.T @ impulse
    # Modes in single precision are orthonormal in mass to 1e-7 alone.
    assert np.abs(right[6:] - expected).max() < 1e-6 * np.abs(expected).max()

    moved = moved_state(robot, state, np.concatenate([np.zeros(6), rates]), STEP_S)
    after = MODEL.branches.advanced(memory, PART.positions(moved.modes[0]), STEP_S)
    expected_springs = np.moveaxis(after.spring, 3, 1)[..., rows, columns]
    np.testing.assert_allclose(moved.springs[0], expected_springs, atol=1e-13)


def test_the_sampled_branches_of_few_points_are_those_of_all():
    part = rubber_reduced_part(pressures=3)
    states = 0.3 * np.random.default_rng(0).normal(size=(6, MODE_COUNT))
    settings = EcswSettings(hyperreduction_tolerance=0.01, stiffness_state_count=2)
    errors = []
    for relaxing in (False, True):
        chosen = ecsw(
            MODEL.element_groups,
            part.modes,
            states,
            settings,
            mixed=(part.dilatation,),
            relaxing=relaxing,
            mirror_nodes=MODEL.mesh.mirror_nodes,
        )
        assert chosen.converged
        sampled = assemble_reduced_part(MODEL, part.modes, chosen.cubatures)
        assert len(sampled.tetrahedron_index) < len(part.tetrahedron_index) / 5
        worst = 0.0
        for state in states:
            lower = np.linalg.cholesky(part.objective_stiffness(state))
            exact, got = (
                each.branches.force(
                    each.branches.advanced(each.branches.relaxed(), 0 * state, state, 1e-6), state
                )
                for each in (part, sampled)
            )
            size = np.linalg.norm(np.linalg.solve(lower, exact))
            worst = max(worst, np.linalg.norm(np.linalg.solve(lower, got - exact)) / size)
        errors.append(worst)
    # The tolerance bounds the mean square over states and rows; one may have sqrt(12) of it.
    assert errors[1] < 0.01 * 12**0.5
    assert errors[1] < errors[0]  # chosen for the elastic forces alone they are worse


def test_a_rubber_part_is_saved_whole_and_an_older_file_is_read(tmp_path):
    part = rubber_reduced_part(pressures=3)
    loaded = ReducedPart.load(part.save(tmp_path / "rubber.npz"))
    for item in fields(ReducedPart):
        if item.name != "metadata":
            assert np.array_equal(getattr(loaded, item.name), getattr(part, item.name)), item.name
    loaded.check_model(MODEL)
    assert loaded.digest() == part.digest()
    other = rubber_part()
    other.branches = None
    with pytest.raises(ArtefactError, match=r"relaxes by .*0\.65.*, got None"):
        loaded.check_model(other)

    # A file of format 2 has none of the new arrays.
    old = synthetic_reduced_part(3, (4, 4, 4), "stable_neo_hookean")
    path = old.save(tmp_path / "old.npz")
    with np.load(path) as archive:
        content = {name: archive[name] for name in archive.files}
    metadata = json.loads(str(content.pop("metadata")))
    new = ("dilatation", "relaxation", "yeoh")
    content = {name: value for name, value in content.items() if not any(n in name for n in new)}
    np.savez(path, metadata=json.dumps({**metadata, "format_version": 2}), **content)
    read = ReducedPart.load(path)
    assert read.digest() == old.digest()
    assert read.relaxation is None


def test_parts_that_contradict_themselves_are_refused():
    part = rubber_reduced_part(pressures=3)
    with pytest.raises(ValueError, match="expected none where the material"):
        replace(part, tetrahedron_material=part.tetrahedron_material.without_lambda())
    with pytest.raises(ValueError, match=r"weights sum to 1\.2, expected less than 1"):
        replace(part, relaxation_weight=np.array([0.6, 0.6]))
    with pytest.raises(ValueError, match="relaxation_time must have shape"):
        replace(part, relaxation_time=np.array([1.0]))
    with pytest.raises(ValueError, match="pressure_fields must have a row for each"):
        assemble_reduced_part(MODEL, part.modes, pressure_fields=np.zeros((3, 1)))


def test_a_series_is_kept_to_the_last_digit():
    assert PART.relaxation == PronySeries((0.1, 0.2), (0.65, 0.02))
    assert synthetic_reduced_part(3, (4, 4, 4)).branches is None


def test_a_rubber_part_is_reduced_from_its_snapshots_and_bends_as_the_finite_elements():
    """Where the full force vanishes so does its projection on modes that hold the equilibria; few
    pressures that hold the snapshots' volumes leave it so. Single-precision snapshots leave 1e-4 %,
    and the rounding of volumes, which are 50 times as stiff, ten times that."""
    model = rubber_part(order="linear")
    bend = bend_snapshots(
        model, StaticSnapshotSettings(bend_pressure_kPa=80.0, bend_count=4, load_count=0)
    )
    settings = ReductionSettings(
        mode_tolerance=1e-6,
        mode_limit=20,
        pressure_tolerance=1e-6,
        pressure_limit=20,
        holdout_every=0,
        rotation="polar",
        ecsw=EcswSettings(hyperreduction_tolerance=0.005, stiffness_state_count=2),
    )
    part, report = reduce_part(model, bend, settings, report_pressure_kPa=80.0)
    part.check_model(model)
    assert len(report.bend["full_deg"]) == len(bend) == 4
    assert abs(report.bend["full_deg"][-1]) > 0.5
    assert report.pressure_count == len(part.dilatation_1) <= len(bend)
    assert report.bend_error_unsampled_percent < 0.1
    assert report.bend_error_percent < 2.0
    few, report = reduce_part(
        model, bend, replace(settings, pressure_limit=1), report_pressure_kPa=80.0
    )
    assert len(few.dilatation_1) == report.pressure_count == 1
