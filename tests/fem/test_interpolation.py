import numpy as np
from helpers.box_mesh import box_mesh

from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh


def test_linear_fields_are_reproduced_inside_and_outside():
    mesh = box_mesh()
    points = np.random.default_rng(0).uniform([-0.5, 0, 0], [10.5, 6.0, 4.5], (40, 3))
    weights = interpolation_matrix(mesh, points)
    np.testing.assert_allclose(weights @ mesh.nodes, points, atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    inside = np.all((points > 0.0) & (points < [10.0, 6.0, 4.0]), axis=1)
    assert weights[np.flatnonzero(inside)].data.min() > -1e-12


def test_quadratic_fields_are_reproduced_by_quadratic_elements():
    mesh = quadratic_mesh(box_mesh())
    points = np.random.default_rng(0).uniform([0, 0, 0], [10.0, 6.0, 4.0], (40, 3))

    def field(x):
        return x[:, 0] * x[:, 1] - 2.0 * x[:, 2] ** 2 + x[:, 1] - 3.0

    weights = interpolation_matrix(mesh, points)
    # Rounding of values of 60.
    np.testing.assert_allclose(weights @ field(mesh.nodes), field(points), atol=1e-11)
    np.testing.assert_allclose(weights @ mesh.nodes, points, atol=1e-12)


def test_mirrored_points_get_mirrored_weights(leg_mesh):
    points = leg_mesh.contact_points
    image = points * [1.0, -1.0, 1.0]
    weights = interpolation_matrix(leg_mesh, points).toarray()
    there = interpolation_matrix(leg_mesh, image).toarray()[:, leg_mesh.mirror_nodes]
    off_plane = np.abs(points[:, 1]) > 1e-9
    assert np.array_equal(weights[off_plane], there[off_plane])
    # On the plane of symmetry only the order of a face's nodes may differ.
    np.testing.assert_allclose(weights, there, atol=1e-9)


def test_an_element_across_the_mirror_plane_has_its_nodes():
    """As of a user's mesh, of which none is half of the solid: two nodes on the plane, and one on
    each side."""
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.3], [0.5, -1.0, 0.3]])
    mesh = Mesh(nodes, np.array([[0, 2, 1, 3]]), mirror_nodes=np.array([0, 1, 3, 2]))
    weights = interpolation_matrix(mesh, nodes).toarray()
    np.testing.assert_allclose(weights, np.eye(4), atol=1e-12)
