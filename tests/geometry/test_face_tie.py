"""How a part is tied: at nodes, or over the face that they span."""

import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.sparse.linalg import splu

from pneumorph.catalogue.leg_kinds import measured_leg_mesh
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.face_tie import FaceTie, tied_over_face
from pneumorph.geometry.mesh import Mesh, MeshError

SIZE = (12.0, 8.0, 8.0)


def block(cells: int) -> Mesh:
    """A block with its attachment at the four corners of its left face."""
    mesh = box_mesh(SIZE, (3 * cells // 2, cells, cells))
    left = mesh.nodes[mesh.node_sets["left"]][:, 1:]
    corners = np.all((left < 1e-9) | (left > SIZE[1] - 1e-9), axis=1)
    attachment = mesh.node_sets["left"][corners]
    return dataclasses.replace(mesh, node_sets={**mesh.node_sets, "attachment": attachment})


def compliance(mesh: Mesh) -> float:
    """Mean displacement of the right face over the force that shears it [mm/mN]."""
    part = PartModel(mesh, Material(100.0, 0.3), 0.01)
    free = np.setdiff1d(np.arange(3 * part.node_count), FaceTie.of(mesh).unknowns)
    right = mesh.node_sets["right"]
    force = np.zeros((part.node_count, 3))
    # Even traction: nodes in proportion to the area about them.
    inner = [np.abs(mesh.nodes[right][:, a] - SIZE[a] / 2.0) < SIZE[a] / 2.0 - 1e-9 for a in (1, 2)]
    area = 0.25 * (1 + inner[0]) * (1 + inner[1])
    force[right, 2] = area / area.sum()
    stiffness = part.stiffness(part.rest_nodes)[free][:, free].tocsc()
    moved = np.zeros(3 * part.node_count)
    moved[free] = splu(stiffness).solve(force.ravel()[free])
    return float(force.ravel() @ moved)


def test_a_face_has_a_limit_under_refinement_and_corners_have_none():
    """Point loads indent by F / (E h): each halving of h adds twice as much as the one before. With
    a face the changes fall, by 0.56 here, where linear elements are still too stiff in shear."""
    corners = [compliance(block(cells)) for cells in (2, 4, 8)]
    faces = [compliance(tied_over_face(block(cells))) for cells in (2, 4, 8)]
    grown, settled = np.diff(corners), np.diff(faces)
    assert grown[1] > 1.5 * grown[0] > 0.0
    assert 0.0 < settled[1] < 0.7 * settled[0]


def test_the_face_follows_its_corners():
    """Exactly in affine motion: the spline has polynomials of first degree."""
    mesh = tied_over_face(block(4))
    tie = FaceTie.of(mesh)
    assert sorted(tie.nodes) == sorted(mesh.node_sets["left"])
    rest = mesh.nodes[tie.nodes]
    rng = np.random.default_rng(0)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    attached = rest[:4] @ matrix.T + shift
    np.testing.assert_allclose(tie.spread(attached), rest @ matrix.T + shift, atol=1e-12)
    loads, moves = rng.normal(size=(len(tie.nodes), 3)), rng.normal(size=(4, 3))
    work = np.vdot(loads, tie.spread(moves))
    assert np.vdot(tie.gathered(loads), moves) == pytest.approx(work, rel=1e-12)


def test_a_mesh_without_a_face_is_tied_at_its_attachment():
    tie = FaceTie.of(block(2))
    assert len(tie.nodes) == 4
    values = np.arange(12.0).reshape(4, 3)
    assert tie.spread(values) is values
    assert tie.gathered(values) is values


def test_attachments_that_span_no_face_are_refused():
    mesh = block(2)
    line = {**mesh.node_sets, "attachment": mesh.node_sets["attachment"][:2]}
    with pytest.raises(MeshError, match="expected a rectangle across one of the axes"):
        tied_over_face(dataclasses.replace(mesh, node_sets=line))


def uneven(offsets_mm: np.ndarray, carried: np.ndarray) -> Mesh:
    """A block whose left face has a corner, a middle of a side or its centre off its plane.

    Args:
        offsets_mm: How far into the block each of the 3 x 3 nodes of the face lies [mm], (9,).
        carried: Which of them are the attachment, by number.
    """
    mesh = block(2)
    face = mesh.node_sets["left"]
    nodes = mesh.nodes.copy()
    nodes[face, 0] += offsets_mm
    sets = {**mesh.node_sets, "attachment": face[carried], "attachment_face": face}
    return dataclasses.replace(mesh, nodes=nodes, node_sets=sets)


CORNERS, MIDDLE = np.array([0, 2, 6, 8]), 4
RECESS = np.where(np.arange(9) == MIDDLE, 1.0, 0.0)


def test_a_face_with_a_recess_that_its_attachment_shares_follows_rigidly():
    """Nodes carried at both levels span it: every affine motion is followed off the plane too."""
    offsets = np.array([0.0, 0.7, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    mesh = uneven(offsets, CORNERS)
    tie = FaceTie.of(mesh)
    rest = mesh.nodes[tie.nodes]
    rng = np.random.default_rng(0)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    moved = tie.spread(rest[:4] @ matrix.T + shift)
    np.testing.assert_allclose(moved, rest @ matrix.T + shift, atol=1e-12)
    assert np.abs(tie.weights).max() < 2.0


def test_what_is_off_the_plane_by_rounding_leaves_the_weights_as_they_are():
    flat, rounded = (FaceTie.of(uneven(share * RECESS, CORNERS)).weights for share in (0.0, 5e-4))
    np.testing.assert_array_equal(flat, rounded)


@pytest.mark.parametrize(
    ("corner_mm", "told"),
    [(0.0, "1 mm off the face .* and 1 of 5"), (0.1, r"0\.975 mm off the face .* and 1 of 5")],
    ids=["flat", "nearly flat"],
)
def test_a_recess_that_the_attachment_does_not_span_is_refused(corner_mm, told):
    """It would be pressed into the plane of the corners for good, or carried by long levers."""
    mesh = uneven(RECESS + corner_mm * (np.arange(9) == 8), CORNERS)
    node = mesh.node_sets["left"][MIDDLE]
    with pytest.raises(MeshError, match=rf"node {node} of 'attachment_face' lies {told}"):
        FaceTie.of(mesh)


@pytest.mark.parametrize(
    ("carried", "message"),
    [
        ([0, 8], "'attachment' has 2 nodes, expected at least three that span a face"),
        ([0, 4, 8], "the 3 nodes of 'attachment' lie on one line, expected at least three"),
        ([0, 2, 6, 7], "are at one place of its face"),
    ],
)
def test_attachments_that_a_face_cannot_follow_are_refused(carried, message):
    mesh = uneven(np.zeros(9), np.array(carried))
    if carried[-1] == 7:  # a double node
        nodes = mesh.nodes.copy()
        nodes[mesh.node_sets["left"][7]] = nodes[mesh.node_sets["left"][6]]
        mesh = dataclasses.replace(mesh, nodes=nodes)
    with pytest.raises(MeshError, match=message):
        FaceTie.of(mesh)


def test_two_nodes_that_no_other_follows_are_an_attachment():
    mesh = uneven(np.zeros(9), np.array([0, 8]))
    sets = {**mesh.node_sets, "attachment_face": mesh.node_sets["attachment"]}
    assert len(FaceTie.of(dataclasses.replace(mesh, node_sets=sets)).nodes) == 2


def test_the_measured_leg_is_tied_over_its_first_tooth():
    """End face of the solid tooth, 20 x 16 mm."""
    mesh = measured_leg_mesh()
    face = mesh.nodes[mesh.node_set("attachment_face")]
    np.testing.assert_allclose(face.min(axis=0), [-52.0, -10.0, 4.0], atol=1e-9)
    np.testing.assert_allclose(face.max(axis=0), [-52.0, 10.0, 20.0], atol=1e-9)
    assert len(face) > 40
