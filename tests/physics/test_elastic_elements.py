"""Closed forms and identities of the corotational elements, one by one."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.element_stiffness import rotated_stiffness_entries
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.geometry.pose import rotation_about

MATERIAL = Material(1000.0, 0.3)
ROTATIONS = ("edge", "polar")


def part(**options) -> PartModel:
    mesh = box_mesh(**options)
    sheet = Membrane("bottom", Material(2000.0, 0.4), 0.5)
    cavity = "cavity" if options.get("hollow") else None
    return PartModel(mesh, MATERIAL, 0.1, (sheet,), cavity)


@pytest.fixture(scope="module")
def body() -> PartModel:
    return part()


def wobbled(body: PartModel, size: float = 0.3) -> np.ndarray:
    rng = np.random.default_rng(1)
    return body.rest_nodes + rng.uniform(-size, size, body.rest_nodes.shape)


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_rigid_motion_gives_no_force(body, rotation):
    turn = rotation_about("x", 70.0) @ rotation_about("z", 200.0)
    moved = body.rest_nodes @ turn.T + [5.0, -3.0, 100.0]
    # Rounding of coordinates of size 100 through a stiffness of 1e4 mN/mm.
    assert np.abs(body.internal_force(moved, rotation)).max() < 1e-8


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_force_turns_with_the_body(body, rotation):
    turn = rotation_about("y", 110.0) @ rotation_about("x", -35.0)
    x = wobbled(body)
    there = body.internal_force(x @ turn.T, rotation)
    np.testing.assert_allclose(there, body.internal_force(x, rotation) @ turn.T, atol=1e-9)


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_internal_forces_have_no_resultant(body, rotation):
    x = wobbled(body)
    force = body.internal_force(x, rotation)
    assert np.abs(force.sum(axis=0)).max() < 1e-9
    if rotation == "polar":  # the edge-based force has no potential, and a moment
        assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-8


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_uniform_uniaxial_stress(rotation):
    """Patch test: a bar under uniform traction stretches by sigma / E and thins by nu."""
    mesh = box_mesh((10.0, 6.0, 4.0), (5, 3, 2))
    bar = PartModel(mesh, MATERIAL, 0.1)
    strain = 1e-3
    stretch = np.array([strain, -0.3 * strain, -0.3 * strain])
    force = bar.internal_force(mesh.nodes * (1.0 + stretch), rotation)
    interior = np.all((mesh.nodes > 1e-9) & (mesh.nodes < np.array([10, 6, 4]) - 1e-9), axis=1)
    assert interior.any()
    traction = MATERIAL.young_modulus_kPa * strain * 24.0  # sigma times area
    # Polar: exact to rounding. Edge: its frame shears by the strain, an error of second order.
    tolerance = traction * (1e-10 if rotation == "polar" else 2.0 * strain)
    assert np.abs(force[interior]).max() < tolerance
    right = mesh.node_sets["right"]
    assert force[right, 0].sum() == pytest.approx(-traction, abs=tolerance)


def test_membrane_in_uniaxial_plane_stress(body):
    """A sheet stretched by eps and thinned by nu eps in its plane pulls with E eps t b."""
    sheet = body.element_groups[1]
    strain, poisson = 1e-3, 0.4
    x = body.rest_nodes * (1.0 + np.array([strain, -poisson * strain, 0.7]))
    forces = sheet.forces(x, "polar")
    right = np.isin(sheet.connectivity, body.mesh.node_sets["right"])
    assert forces[right][:, 0].sum() == pytest.approx(-2000.0 * strain * 0.5 * 6.0, rel=1e-9)
    assert np.abs(forces[:, :, 2]).max() < 1e-10


def test_stiffness_is_the_derivative_of_the_force_at_rest(body):
    rest = body.rest_nodes
    direction = np.random.default_rng(2).normal(size=rest.shape)
    step = 1e-6
    for rotation in ROTATIONS:
        change = body.internal_force(rest + step * direction, rotation) - body.internal_force(
            rest - step * direction, rotation
        )
        expected = -body.stiffness(rest, rotation) @ direction.ravel()
        # Central differences: rounding 1e-16 * |f| / step, truncation step^2.
        np.testing.assert_allclose(change.ravel() / (2 * step), expected, rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_tangent_is_the_derivative_of_all_forces_anywhere(rotation):
    body = part(size=(9.0, 9.0, 9.0), cells=(3, 3, 3), hollow=True)
    x, pressure, step = wobbled(body, 0.2), 30.0, 1e-6

    def force(positions):
        return body.internal_force(positions, rotation) + body.pressure_force(positions, pressure)

    direction = np.random.default_rng(3).normal(size=x.shape)
    change = (force(x + step * direction) - force(x - step * direction)) / (2 * step)
    expected = -body.tangent(x, pressure, rotation) @ direction.ravel()
    np.testing.assert_allclose(change.ravel(), expected, rtol=1e-5, atol=1e-3)


def test_stiffness_is_symmetric_and_positive_semidefinite(body):
    x = wobbled(body)
    for matrix in (body.stiffness(x), body.stiffness(x, "polar"), body.objective_stiffness(x)):
        dense = matrix.toarray()
        assert np.abs(dense - dense.T).max() == 0.0
        values = np.linalg.eigvalsh(dense)
        assert values.min() > -1e-9 * values.max()


def test_group_matrices_add_up_to_the_sparse_matrix(body):
    x = wobbled(body)
    total = np.zeros((x.size, x.size))
    for group in body.element_groups:
        triangles = rotated_stiffness_entries(group, x).T
        for nodes, triangle in zip(group.connectivity, triangles, strict=True):
            unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
            matrix = np.zeros((len(unknowns), len(unknowns)))
            matrix[np.triu_indices(len(unknowns))] = triangle
            total[np.ix_(unknowns, unknowns)] += matrix + np.triu(matrix, 1).T
    np.testing.assert_allclose(body.stiffness(x).toarray(), total, atol=1e-9)


def test_objective_stiffness_ignores_rigid_motion_of_a_stressed_body(body):
    x = wobbled(body)
    spin = np.cross(np.array([0.3, -1.0, 2.0]), x) + np.array([1.0, 2.0, 3.0])
    objective = body.objective_stiffness(x) @ spin.ravel()
    published = body.stiffness(x, "polar") @ spin.ravel()
    assert np.abs(published).max() > 1.0  # the false force of the published damping
    assert np.abs(objective).max() < 1e-9 * np.abs(published).max()


def test_objective_stiffness_is_the_linear_one_at_rest(body):
    rest = body.rest_nodes
    difference = body.objective_stiffness(rest) - body.stiffness(rest, "polar")
    assert np.abs(difference).max() < 1e-9


def test_gram_schmidt_and_polar_frames_are_orthonormal(body):
    x = wobbled(body)
    for group in body.element_groups:
        np.testing.assert_allclose(group.rotations(body.rest_nodes), group.rest_frame, atol=1e-13)
        for rotation in ROTATIONS:
            frame = group.rotations(x, rotation)
            unit = np.eye(group.dimension)
            product = np.swapaxes(frame, 1, 2) @ frame
            np.testing.assert_allclose(product, np.broadcast_to(unit, product.shape), atol=1e-12)


def test_cantilever_under_end_load():
    """Timoshenko's beam: w = F L^3 / (3 E I) + F L / (kappa G A), kappa = 5/6.

    Linear tetrahedra are too stiff in bending; with 8 over the height the excess is below 6 %
    and falls with the square of the size (measured: 21 % with 4, 6 % with 8).
    """
    length, width, height = 40.0, 2.0, 4.0
    material = Material(1000.0, 0.0)
    deflections = []
    for over_height in (4, 8):
        mesh = box_mesh((length, width, height), (10 * over_height, over_height // 2, over_height))
        beam = PartModel(mesh, material, 0.1)
        right = mesh.node_sets["right"]
        force = np.zeros_like(mesh.nodes)
        load = 0.05
        force[right, 2] = -load / len(right)
        result = static_equilibrium(
            beam,
            0.0,
            mesh.node_sets["left"],
            external_force=force,
            settings=StaticSettings(tolerance=1e-6),
        )
        assert result.converged
        deflections.append(-(result.positions - mesh.nodes)[right, 2].mean())
    inertia, area = width * height**3 / 12.0, width * height
    expected = load * length**3 / (3.0 * 1000.0 * inertia) + load * length / (
        5.0 / 6.0 * 500.0 * area
    )
    errors = 1.0 - np.array(deflections) / expected
    assert 0.0 < errors[1] < 0.08
    assert errors[0] / errors[1] > 3.0  # second order would be 4
