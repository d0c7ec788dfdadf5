import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import TETRAHEDRON_EDGES, TRIANGLE_EDGES, Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mirror import mirror_half
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.surface import boundary_triangles


@pytest.fixture(scope="module")
def box() -> Mesh:
    return box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)


@pytest.fixture(scope="module")
def quadratic(box) -> Mesh:
    return quadratic_mesh(box)


@pytest.fixture(scope="module")
def mirrored() -> Mesh:
    half = box_mesh((6.0, 3.0, 3.0), (4, 2, 2))
    # Coordinates that no binary number holds, so that exactness is put to the test.
    solid = mirror_half(half.nodes / 3.0, half.tetrahedra)
    return Mesh(solid.nodes, solid.tetrahedra, mirror_nodes=solid.mirror_nodes)


def test_corners_keep_their_numbers_and_every_edge_has_one_node(box, quadratic):
    assert np.array_equal(quadratic.tetrahedra, box.tetrahedra)
    assert np.array_equal(quadratic.nodes[: len(box.nodes)], box.nodes)
    ends = box.tetrahedra[:, np.array(TETRAHEDRON_EDGES)]  # (element, edge, end)
    edges = {tuple(sorted(edge)) for edge in ends.reshape(-1, 2).tolist()}
    assert len(quadratic.nodes) == len(box.nodes) + len(edges)
    assert np.array_equal(
        np.unique(quadratic.edge_nodes), np.arange(len(box.nodes), len(quadratic.nodes))
    )
    # The mean of two numbers is rounded once.
    middle = box.nodes[ends].mean(axis=2)
    np.testing.assert_allclose(quadratic.nodes[quadratic.edge_nodes], middle, atol=1e-15 * 9.0)
    check_mesh(quadratic, ["cavity"], ["left"])


def test_node_sets_take_the_midside_nodes_of_their_faces(quadratic):
    for name, place in (("left", 0.0), ("right", 9.0)):
        on_plane = np.flatnonzero(np.abs(quadratic.nodes[:, 0] - place) < 1e-9)
        assert np.array_equal(np.sort(quadratic.node_set(name)), on_plane)


@pytest.mark.parametrize("region", ["skin", "bottom", "cavity"])
def test_surfaces_take_the_midside_nodes_of_their_edges(box, quadratic, region):
    triangles = quadratic.surface_connectivity(region)
    assert np.array_equal(triangles[:, :3], box.surface(region))
    middle = box.nodes[box.surface(region)[:, np.array(TRIANGLE_EDGES)]].mean(axis=2)
    np.testing.assert_allclose(quadratic.nodes[triangles[:, 3:]], middle, atol=1e-14)
    assert np.array_equal(box.surface_connectivity(region), box.surface(region))


def test_mirror_images_of_midside_nodes_are_exact(mirrored):
    mesh = quadratic_mesh(mirrored)
    image = mesh.mirror_nodes
    assert np.array_equal(mesh.nodes[image], mesh.nodes * [1.0, -1.0, 1.0])
    assert np.array_equal(image[image], np.arange(len(mesh.nodes)))
    assert np.any(image[len(mirrored.nodes) :] != np.arange(len(mirrored.nodes), len(image)))
    check_mesh(mesh)


def test_mirrored_shapes_have_mirrored_forces(mirrored):
    mesh = quadratic_mesh(mirrored)
    part = PartModel(mesh, Material(100.0, 0.3), 0.1)
    x = mesh.nodes + np.random.default_rng(0).uniform(-0.05, 0.05, mesh.nodes.shape)
    flip = np.array([1.0, -1.0, 1.0])
    force = part.internal_force(x, "polar")
    across = part.internal_force(x[mesh.mirror_nodes] * flip, "polar")
    np.testing.assert_allclose(across, force[mesh.mirror_nodes] * flip, atol=1e-12 * 100.0)


def test_quadratic_mesh_is_saved_and_named_by_its_midside_nodes(quadratic, tmp_path):
    loaded = Mesh.load(quadratic.save(tmp_path / "mesh.npz"))
    assert np.array_equal(loaded.edge_nodes, quadratic.edge_nodes)
    assert loaded.digest() == quadratic.digest()
    curved = dataclasses.replace(quadratic, edge_nodes=quadratic.edge_nodes[:, ::-1])
    assert curved.digest() != quadratic.digest()


def test_faulty_quadratic_meshes_are_refused(box, quadratic):
    with pytest.raises(MeshError, match="has midside nodes already"):
        quadratic_mesh(quadratic)
    with pytest.raises(MeshError, match=r"edge_nodes must have shape \(156, 6\), got \(156, 5\)"):
        dataclasses.replace(quadratic, edge_nodes=quadratic.edge_nodes[:, :5])
    with pytest.raises(MeshError, match="edge_nodes must hold node indices"):
        dataclasses.replace(quadratic, edge_nodes=quadratic.edge_nodes + 10)
    apart = box.surfaces["bottom"].copy()
    apart[0] = [0, len(box.nodes) // 2, len(box.nodes) - 1]
    loose = dataclasses.replace(quadratic, surfaces={"bottom": apart})
    with pytest.raises(MeshError, match="'bottom' has an edge that belongs to no tetrahedron"):
        loose.surface_connectivity("bottom")
    other_order = quadratic.edge_nodes[:, [3, 4, 5, 0, 1, 2]]
    wrong = dataclasses.replace(quadratic, edge_nodes=other_order)
    with pytest.raises(MeshError, match=r"inverted at an integration point.*01 12 20 03 13 23"):
        PartModel(wrong, Material(100.0, 0.3), 0.1)


def test_boundary_of_a_quadratic_mesh_is_that_of_its_corners(box, quadratic):
    """What asks for the corners alone, such as drawing, sees no midside nodes."""
    assert np.array_equal(
        boundary_triangles(quadratic.tetrahedra), boundary_triangles(box.tetrahedra)
    )
