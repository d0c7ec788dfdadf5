from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.two_chambers import two_chamber_mesh

from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.surface import winding_number


@pytest.fixture
def hollow() -> Mesh:
    return box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)


def test_good_mesh_passes(hollow):
    check_mesh(hollow, ("skin", "cavity"), ("left",))


def test_inverted_element_is_refused(hollow):
    tetrahedra = hollow.tetrahedra.copy()
    tetrahedra[3] = tetrahedra[3][[1, 0, 2, 3]]
    with pytest.raises(MeshError, match=r"1 of .* inverted .* first is 3"):
        check_mesh(replace(hollow, tetrahedra=tetrahedra))


def test_flat_element_is_refused(hollow):
    nodes = hollow.nodes.copy()
    a, b, c, d = hollow.tetrahedra[0]
    nodes[d] = nodes[[a, b, c]].mean(axis=0)
    with pytest.raises(MeshError, match="degenerate"):
        check_mesh(replace(hollow, nodes=nodes))


def test_two_pieces_are_refused(hollow):
    count = len(hollow.nodes)
    two = Mesh(
        np.concatenate([hollow.nodes, hollow.nodes + 20.0]),
        np.concatenate([hollow.tetrahedra, hollow.tetrahedra + count]),
    )
    with pytest.raises(MeshError, match="2 disconnected pieces"):
        check_mesh(two)


def test_unused_node_is_refused(hollow):
    with_one = replace(hollow, nodes=np.concatenate([hollow.nodes, [[50.0, 0, 0]]]))
    with pytest.raises(MeshError, match="1 nodes belong to no tetrahedron"):
        check_mesh(with_one)


def test_doubled_element_is_refused(hollow):
    twice = np.concatenate([hollow.tetrahedra, hollow.tetrahedra[:1]])
    three = np.concatenate([twice, hollow.tetrahedra[:1]])
    with pytest.raises(MeshError, match="more than two"):
        check_mesh(replace(hollow, tetrahedra=three))


def test_open_cavity_is_refused(hollow):
    surfaces = {**hollow.surfaces, "cavity": hollow.surfaces["cavity"][1:]}
    with pytest.raises(MeshError, match="'cavity' is not closed: 3 edges"):
        check_mesh(replace(hollow, surfaces=surfaces))


def test_cavity_inside_out_is_refused(hollow):
    surfaces = {**hollow.surfaces, "cavity": hollow.surfaces["cavity"][:, ::-1]}
    with pytest.raises(MeshError, match="wrongly oriented"):
        check_mesh(replace(hollow, surfaces=surfaces))


def test_outside_named_as_cavity_is_refused(hollow):
    surfaces = {**hollow.surfaces, "cavity": hollow.surfaces["skin"][:, ::-1]}
    with pytest.raises(MeshError, match="outside of the solid, not a cavity"):
        check_mesh(replace(hollow, surfaces=surfaces))


def test_unknown_regions_are_refused(hollow):
    with pytest.raises(MeshError, match="unknown surface region 'sheet'; the mesh has: bottom"):
        check_mesh(hollow, ("sheet",))
    with pytest.raises(MeshError, match="unknown node set 'attachment'"):
        check_mesh(hollow, (), ("attachment",))


def test_false_mirror_is_refused(hollow):
    with pytest.raises(MeshError, match="mirror_nodes do not mirror"):
        check_mesh(replace(hollow, mirror_nodes=np.arange(len(hollow.nodes))))


def test_index_from_one_is_refused(hollow):
    with pytest.raises(MeshError, match="gmsh counts from 1"):
        replace(hollow, tetrahedra=hollow.tetrahedra + 1)


def test_nan_is_refused(hollow):
    nodes = hollow.nodes.copy()
    nodes[0] = np.nan
    with pytest.raises(MeshError, match="nodes must be finite"):
        replace(hollow, nodes=nodes)


def test_every_cavity_is_checked():
    """All whose names begin with cavity, whichever a model inflates."""
    mesh = two_chamber_mesh()
    check_mesh(mesh)
    turned = {**mesh.surfaces, "cavity_right": mesh.surfaces["cavity_right"][:, ::-1]}
    with pytest.raises(MeshError, match="'cavity_right' is wrongly oriented"):
        check_mesh(replace(mesh, surfaces=turned))
    opened = {**mesh.surfaces, "cavity_left": mesh.surfaces["cavity_left"][1:]}
    with pytest.raises(MeshError, match="'cavity_left' is not closed"):
        check_mesh(replace(mesh, surfaces=opened))
    twice = {**mesh.surfaces, "cavity_third": mesh.surfaces["cavity_left"]}
    with pytest.raises(MeshError, match="'cavity_left' and 'cavity_third' share a triangle"):
        check_mesh(replace(mesh, surfaces=twice))


def test_a_contact_point_in_a_cavity_is_refused():
    mesh = two_chamber_mesh()
    inner = mesh.nodes[np.unique(mesh.surfaces["cavity_left"])]
    centre = inner.mean(axis=0)
    face = mesh.nodes[mesh.surfaces["cavity_left"][0]].mean(axis=0)
    for point in (inner[0], centre, face):
        points = np.vstack([mesh.contact_points, point])
        with pytest.raises(MeshError, match="1 contact points lie in or on 'cavity_left'"):
            check_mesh(replace(mesh, contact_points=points))


def test_a_closed_surface_goes_once_round_what_is_inside():
    """Of a box with a point: 1 inside, 0 outside, to rounding."""
    mesh = box_mesh((4.0, 3.0, 2.0), (2, 2, 2))
    points = np.array([[2.0, 1.0, 1.0], [3.9, 2.9, 1.9], [5.0, 1.0, 1.0], [2.0, -0.1, 1.0]])
    found = winding_number(points, mesh.nodes, mesh.surfaces["skin"])
    np.testing.assert_allclose(found, [1.0, 1.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("missing", ["cavity", "sheet", "attachment"])
def test_a_file_that_holds_no_leg_is_told_by_its_name(missing: str, tmp_path: Path) -> None:
    box = box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)
    surfaces = {"cavity": box.surfaces["cavity"], "sheet": box.surfaces["bottom"]}
    ends = {"attachment": np.array([0, 1, 2])}
    whole = replace(box, surfaces=surfaces, node_sets=ends)
    assert load_leg_mesh(whole.save(tmp_path / "leg.npz")).digest() == whole.digest()
    surfaces.pop(missing, None)
    ends.pop(missing, None)
    path = replace(box, surfaces=surfaces, node_sets=ends).save(tmp_path / "other.npz")
    with pytest.raises(MeshError, match=rf"{path} is not of a leg: .*'{missing}'"):
        load_leg_mesh(path)
