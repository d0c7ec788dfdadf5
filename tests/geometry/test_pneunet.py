import dataclasses

import numpy as np
import pytest

from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.surface import boundary_triangles, enclosed_volume


def test_volumes_are_those_of_the_boxes(leg_mesh):
    shape = PneuNetShape()
    assert shape.cavity_volume_mm3() == pytest.approx(3528.0)
    assert shape.solid_volume_mm3() == pytest.approx(43072.0)
    # All faces are flat and lie on mesh faces, so the mesh holds the volume to rounding.
    assert leg_mesh.volumes.sum() == pytest.approx(43072.0, rel=1e-9)
    assert enclosed_volume(leg_mesh.nodes, leg_mesh.surfaces["cavity"]) == pytest.approx(3528.0)
    skin = enclosed_volume(leg_mesh.nodes, leg_mesh.surfaces["skin"])
    assert skin == pytest.approx(43072.0 + 3528.0, rel=1e-9)


def test_size_is_near_the_published_mesh(leg_mesh):
    assert 2300 < len(leg_mesh.nodes) < 2900
    assert 8000 < len(leg_mesh.tetrahedra) < 9800


def test_paper_covers_the_bottom(leg_mesh):
    corners = leg_mesh.nodes[leg_mesh.surfaces["sheet"]]
    assert np.all(corners[:, :, 2] == 0.0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    assert normal[:, 2].max() < 0.0
    assert -normal[:, 2].sum() == pytest.approx(115.0 * 32.0)


def test_mesh_is_its_own_mirror_image_element_by_element(leg_mesh):
    mirror = leg_mesh.mirror_nodes
    flip = np.array([1.0, -1.0, 1.0])
    assert np.array_equal(leg_mesh.nodes[mirror], leg_mesh.nodes * flip)
    assert np.array_equal(mirror[mirror], np.arange(len(mirror)))
    for cells in (leg_mesh.tetrahedra, *leg_mesh.surfaces.values()):
        half, other = np.split(cells, 2)
        swapped = half[:, [1, 0, *range(2, cells.shape[1])]]
        assert np.array_equal(other, mirror[swapped])


def test_node_sets(leg_mesh):
    attachment = leg_mesh.nodes[leg_mesh.node_sets["attachment"]]
    expected = {(-52.0, side, z) for side in (-10.0, 10.0) for z in (4.0, 20.0)}
    assert {tuple(np.round(node, 9)) for node in attachment} == expected
    assert np.all(leg_mesh.nodes[leg_mesh.node_sets["inner_end_face"], 0] == -57.5)
    assert len(leg_mesh.node_sets["outer_end_face"]) >= 9


def test_contact_points_are_outside_symmetric_and_on_the_two_boxes():
    points = PneuNetShape().contact_points_mm()
    mirrored = points * [1.0, -1.0, 1.0]
    assert {tuple(p) for p in np.round(points, 6) + 0.0} == {
        tuple(p) for p in np.round(mirrored, 6) + 0.0
    }
    assert len(np.unique(points, axis=0)) == len(points)
    within_teeth = (np.abs(points[:, 0]) < 52.0) & (np.abs(points[:, 1]) < 10.0)
    assert not np.any(within_teeth & (np.abs(points[:, 2] - 4.0) < 1e-9))
    bottom = points[points[:, 2] == 0.0]
    assert len(bottom) == 13 * 5
    assert points[:, 2].max() == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"tooth_gap_mm": 2.0}, "they must agree"),
        ({"chamber_mm": (8.0, 14.0, 13.0)}, "does not fit into a tooth"),
        ({"chamber_mm": (2.0, 14.0, 17.0)}, "breaks through the top"),
        ({"chamber_mm": (2.0, 20.0, 13.0)}, "narrower than the tooth base"),
        ({"middle_wall_mm": 2.0}, "chambers, 14, and connector, 2: .* make the connector wider"),
    ],
)
def test_impossible_shapes_are_refused(change, reason):
    with pytest.raises(ValueError, match=reason):
        dataclasses.replace(PneuNetShape(), **change)


@pytest.mark.parametrize(
    ("connector", "reason"),
    [
        (
            (70.0, 2.0, 2.0),
            "is 70 mm long, expected more than 70, the way from the first of 9 ",
        ),
        ((104.0, 2.0, 2.0), "is 104 mm long, expected less than the tooth base, 104 mm"),
        ((81.0, 2.0, 9.0), "is 9 mm high, expected less than the tooth base, 9 mm"),
    ],
)
def test_a_connector_that_connects_nothing_or_breaks_out_is_refused(connector, reason):
    """Before it is meshed; its chambers alone would be inflated as if air came to them."""
    shape = PneuNetShape(connector_mm=connector)
    with pytest.raises(ValueError, match=f"connector_mm {reason}"):
        mesh_pneunet(shape)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"base_plate_mm": (70.0, 32.0, 4.0)}, "is 70 mm long, expected more than 81, as long as"),
        ({"base_plate_mm": (115.0, 10.0, 4.0)}, "is 10 mm wide, expected more than 14, as wide"),
        ({"base_plate_mm": (115.0, 14.0, 4.0)}, "is 14 mm wide, expected more than 14, as wide"),
        ({"base_plate_mm": (115.0, 32.0, 0.001)}, r"below the cavity .* is 0\.001 mm thick, exp"),
        ({"chamber_mm": (7.9999999, 14.0, 13.0)}, "of the teeth along x .* is 5e-08 mm thick"),
        ({"chamber_mm": (2.0, 14.0, 15.9999999)}, "above the chambers .* is 1e-07 mm thick"),
        ({"chamber_mm": (2.0, 19.9999999, 13.0)}, "beside the cavity .* is 5e-08 mm thick"),
        ({"connector_mm": (103.99999, 2.0, 2.0)}, "at the connector's ends .* is 5e-06 mm thick"),
        ({"connector_mm": (81.0, 2.0, 8.99999)}, "above the connector .* is 1e-05 mm thick"),
        ({"middle_wall_mm": 1e-3}, r"middle_wall_mm is 0\.001, expected at least 0\.01 mm"),
        (
            {"tooth_gap_mm": 1e-5, "end_tooth_length_mm": 16.0 - 5e-5},
            "tooth_gap_mm is 1e-05, expected at least",
        ),
        ({"middle_wall_mm": 1.9999999}, r"middle_wall_mm is 1\.9999999 and the narrowest .* 2 mm"),
    ],
)
def test_sizes_that_contradict_each_other_are_refused_before_meshing(change, reason):
    """With both numbers; the mesher would fail in words of its own, or leave the cavity open."""
    shape = dataclasses.replace(PneuNetShape(), **change)
    with pytest.raises(ValueError, match=reason):
        mesh_pneunet(shape)


def test_a_failure_of_the_mesher_is_told_with_the_shape():
    shape = dataclasses.replace(PneuNetShape(), chamber_mm=(1e-7, 14.0, 13.0))
    with pytest.raises(MeshError, match=r"cannot fill the leg with tetrahedra .* smallest ones"):
        mesh_pneunet(shape)


def test_the_connector_may_end_within_a_chamber():
    """What is within both counts once."""
    ends = PneuNetShape(connector_mm=(73.0, 2.0, 2.0))
    ends.check_connector()
    chambers = 9 * 2.0 * 14.0 * 13.0
    # Seven chambers are crossed by 2 mm of it, the two at its ends by 1.5.
    shared = (7 * 2.0 + 2 * 1.5) * 2.0 * 2.0
    assert ends.cavity_volume_mm3() == pytest.approx(73.0 * 4.0 + chambers - shared)


def test_saved_mesh_comes_back_the_same(leg_mesh, tmp_path):
    path = leg_mesh.save(tmp_path / "leg.npz")
    again = Mesh.load(path)
    assert again.digest() == leg_mesh.digest()
    check_mesh(again)


def test_boundary_is_skin_and_cavity(leg_mesh):
    boundary = boundary_triangles(leg_mesh.tetrahedra)
    named = len(leg_mesh.surfaces["skin"]) + len(leg_mesh.surfaces["cavity"])
    assert len(boundary) == named


def test_a_wall_in_the_middle_parts_the_cavity_into_mirror_images():
    """Volumes are those of the boxes, to rounding: all faces are flat."""
    pytest.importorskip("netgen")
    shape = PneuNetShape(
        base_plate_mm=(45.0, 32.0, 4.0),
        tooth_base_mm=(41.0, 20.0, 9.0),
        inner_tooth_count=2,
        connector_mm=(13.0, 8.0, 2.0),
        middle_wall_mm=2.0,
    )
    # On each side 3 x 2 of the channel's 8 x 2, and 6 of a chamber's 14 above and beside it.
    each = 13.0 * 3.0 * 2.0 + 2 * (2.0 * 6.0 * 13.0 - 2.0 * 3.0 * 2.0)
    assert shape.cavity_volume_mm3() == pytest.approx(2.0 * each)
    mesh = mesh_pneunet(shape, MesherSettings(size_mm=8.0))
    assert mesh.volumes.sum() == pytest.approx(shape.solid_volume_mm3(), rel=1e-9)
    left, right = (mesh.surfaces[f"cavity_{side}"] for side in ("left", "right"))
    for side, sign in ((left, 1.0), (right, -1.0)):
        assert enclosed_volume(mesh.nodes, side) == pytest.approx(each, rel=1e-9)
        assert (sign * mesh.nodes[side][:, :, 1]).min() == pytest.approx(1.0)
    assert np.array_equal(mesh.mirror_nodes[left][:, [1, 0, 2]], right)
    assert "cavity" not in mesh.surfaces
