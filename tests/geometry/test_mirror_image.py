"""A mesh of one's own that is its own mirror image is known as such, whatever numbers its nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.two_chambers import two_chamber_mesh

from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.corner_order import EVEN_ORDERS
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_checks import check_elements, check_mesh
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.mirror_image import mirror_notes, with_mirror_nodes
from pneumorph.geometry.netgen_mesher import MesherSettings, box, tetrahedralise
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.spread_points import spread_points

meshio = pytest.importorskip("meshio")

FLIP = np.array([1.0, -1.0, 1.0])
SPACING_MM = 5.0
"""Of contact points; chosen one by one at this distance, some have no image."""
REGIONS = ("cavity_left", "cavity_right", "sheet")
BARE = replace(two_chamber_mesh(), mirror_nodes=None)


def written(mesh: Mesh, path: Path) -> Path:
    """As gmsh would have it: nodes and corners of elements in no order of a mirror."""
    rng = np.random.default_rng(0)
    number = rng.permutation(len(mesh.nodes))
    nodes = np.empty_like(mesh.nodes)
    nodes[number] = mesh.nodes
    turned = [mesh.tetrahedra[k::3][:, order] for k, order in enumerate(_EVEN)]
    cells = [("tetra", number[rng.permutation(np.concatenate(turned))])]
    cells += [("triangle", number[mesh.surfaces[name]]) for name in REGIONS]
    tags = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in enumerate(cells, 1)]
    names = {name: np.array([tag, 2]) for tag, name in enumerate(REGIONS, 2)}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(nodes, cells, cell_data=data, field_data=names).write(path, file_format="gmsh22")
    return path


_EVEN = ([0, 1, 2, 3], [1, 2, 0, 3], [2, 3, 0, 1])
"""Orders of corners that leave a volume positive."""


def test_a_file_that_is_its_own_mirror_image_has_images_of_its_nodes_and_points(tmp_path) -> None:
    """Exact ones, also where the file rounds."""
    rounding = 1e-8 * np.random.default_rng(1).normal(size=BARE.nodes.shape)
    rounded = replace(BARE, nodes=BARE.nodes + rounding)
    path = written(rounded, tmp_path / "leg.msh")
    mesh = read_mesh_file(path, node_sets=(), contact_spacing_mm=SPACING_MM)
    assert mesh.mirror_nodes is not None
    assert mirror_notes(mesh) == ()
    check_mesh(quadratic_mesh(mesh))  # which wants exact images
    np.testing.assert_allclose(
        mesh.nodes[np.lexsort(np.round(mesh.nodes, 3).T)],
        rounded.nodes[np.lexsort(np.round(rounded.nodes, 3).T)],
        atol=1e-7,
    )
    own = set(map(tuple, (mesh.contact_points + 0.0).tolist()))
    assert own == set(map(tuple, (mesh.contact_points * FLIP + 0.0).tolist()))
    skin = mesh.nodes[np.unique(mesh.surfaces["skin"])]
    alone = skin[spread_points(skin, SPACING_MM, flat=True)] + 0.0
    assert set(map(tuple, alone.tolist())) != set(map(tuple, (alone * FLIP + 0.0).tolist()))


def _scrambled(mesh: Mesh) -> Mesh:
    """With corners in any order that keeps elements and triangles as they are oriented."""
    rng = np.random.default_rng(2)
    drawn = EVEN_ORDERS[rng.integers(0, 12, len(mesh.tetrahedra))]
    surfaces = {}
    for name, cells in mesh.surfaces.items():
        turn = (np.arange(3) + rng.integers(0, 3, (len(cells), 1))) % 3
        surfaces[name] = np.take_along_axis(cells, turn, axis=1)
    tetrahedra = np.take_along_axis(mesh.tetrahedra, drawn, axis=1)
    return replace(mesh, tetrahedra=tetrahedra, surfaces=surfaces, mirror_nodes=None)


def _across_the_plane() -> Mesh:
    """Two pairs of elements and between them one that is its own image, on a triangle that is."""
    nodes = np.array(
        [[0.0, 0.0, 0.0], [9.0, 0.0, 10.0], [5.0, 6.0, 1.0], [5.0, -6.0, 1.0], [4.0, 9.0, 12.0],
         [4.0, -9.0, 12.0]]
    )  # fmt: skip
    tetrahedra = np.array([[0, 1, 3, 2], [0, 1, 2, 4], [0, 3, 1, 5]])
    return Mesh(nodes, tetrahedra, {"sheet": np.array([[2, 0, 3]]), "skin": np.array([[0, 2, 3]])})


@pytest.mark.parametrize("mesh", [BARE, _across_the_plane()], ids=["two chambers", "across"])
def test_edge_based_rotations_see_left_and_right_as_images_whatever_order_a_file_has(
    mesh: Mesh,
) -> None:
    """Forces of a mirrored state are mirrored forces, but for rounding: sums of some hundred terms
    of the size of the largest, each to 1e-16."""
    there = _scrambled(mesh)
    found = with_mirror_nodes(there)
    assert found.mirror_nodes is not None
    check_elements(found)
    for name, cells in mesh.surfaces.items():
        now = found.surfaces[name]
        assert {_oriented(each) for each in now} == {_oriented(each) for each in cells}, name
    part = PartModel(
        found, Material(300.0, 0.3), 0.01, (Membrane("sheet", Material(3000.0, 0.4), 0.2),)
    )
    x = found.nodes
    along = x[:, 0] / np.ptp(x[:, 0])
    moved = np.stack([-3.0 * along**2, 4.0 * along**2, -6.0 * along**2 + x[:, 1] * along], axis=1)
    images = found.mirror_nodes
    for rotation in ("edge", "polar"):
        force = part.internal_force(x + moved, rotation)
        mirrored = part.internal_force(x + moved[images] * FLIP, rotation)
        atol = 1e-11 * np.abs(force).max()
        np.testing.assert_allclose(mirrored, force[images] * FLIP, rtol=0.0, atol=atol)


def _oriented(cell: np.ndarray) -> tuple[int, ...]:
    """A triangle from its lowest node on."""
    return tuple(np.roll(cell, -int(np.argmin(cell))).tolist())


def test_corners_that_are_in_the_order_of_images_stay_and_with_them_digests() -> None:
    """Such as of half a mesh and its image, as the package makes them and files may have them."""
    mesh = paper_leg_mesh()
    assert with_mirror_nodes(replace(mesh, mirror_nodes=None)).digest() == mesh.digest()
    found = with_mirror_nodes(BARE)
    np.testing.assert_array_equal(found.tetrahedra, BARE.tetrahedra)
    np.testing.assert_array_equal(found.surfaces["skin"], BARE.surfaces["skin"])
    assert with_mirror_nodes(replace(found, mirror_nodes=None)).digest() == found.digest()


def _one_sided(mesh: Mesh, name: str) -> Mesh:
    triangles = mesh.surfaces[name]
    left = mesh.nodes[triangles][:, :, 1].mean(axis=1) > 0.0
    return replace(mesh, surfaces={**mesh.surfaces, name: triangles[left]})


@pytest.mark.parametrize(
    "changed",
    [
        pytest.param(
            replace(BARE, nodes=BARE.nodes + 0.01 * np.eye(len(BARE.nodes), 3)), id="a node off"
        ),
        pytest.param(replace(BARE, tetrahedra=BARE.tetrahedra[1:]), id="an element lacks"),
        pytest.param(_one_sided(BARE, "sheet"), id="half a sheet"),
        pytest.param(
            replace(
                BARE,
                surfaces={k: v for k, v in BARE.surfaces.items() if k != "cavity_right"},
            ),
            id="one cavity",
        ),
        pytest.param(
            replace(BARE, node_sets={"attachment": np.flatnonzero(BARE.nodes[:, 1] > 5.0)}),
            id="held at one side",
        ),
    ],
)
def test_a_mesh_without_all_images_stays_as_it_is_and_that_is_told(changed: Mesh) -> None:
    assert with_mirror_nodes(BARE).mirror_nodes is not None
    assert with_mirror_nodes(changed) is changed
    (note,) = mirror_notes(changed)
    assert "mirror images of a design walk alike only" in note


def test_a_mirror_plane_elsewhere_is_named() -> None:
    aside = replace(BARE, nodes=BARE.nodes + np.array([0.0, 7.0, 0.0]))
    (note,) = mirror_notes(aside)
    assert note.startswith("its mirror plane is y = 7 mm, expected y = 0")


def test_a_mesh_of_an_earlier_version_is_told_to_be_read_again() -> None:
    """It has images and does not name them."""
    (note,) = mirror_notes(BARE)
    assert "which its file does not say" in note
    assert "pneumorph mesh --file" in note


def test_a_file_without_images_keeps_its_points(tmp_path) -> None:
    skewed = replace(BARE, nodes=BARE.nodes + [0.0, 0.3, 0.0] * (BARE.nodes[:, 1:2] > 1.0))
    mesh = read_mesh_file(written(skewed, tmp_path / "leg.msh"), node_sets=())
    assert mesh.mirror_nodes is None
    skin = mesh.nodes[np.unique(mesh.surfaces["skin"])]
    chosen = skin[spread_points(skin, 10.0, flat=True)]
    np.testing.assert_array_equal(mesh.contact_points, chosen)


def _solid(mesh: Mesh) -> Mesh:
    """A mesh without regions, its middle at y = 0."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    return Mesh(mesh.nodes - [0.0, 0.5 * (low + high)[1], 0.0], mesh.tetrahedra)


@pytest.mark.parametrize(
    "keep",
    [
        pytest.param(lambda cell: cell[0] < 2 or cell[1] < 2, id="L"),
        pytest.param(lambda cell: cell[0] < 2 or cell[1] > 2, id="L turned"),
        pytest.param(
            lambda cell: cell[1] in (2, 3) or (cell[0] < 2) == (cell[1] < 2), id="Z, by its turn"
        ),
    ],
)
def test_a_shape_that_is_another_ones_image_is_not_told_to_be_mirrored(
    keep: Callable[[np.ndarray], bool],
) -> None:
    """A half of it and that half's mirror image would be a third shape."""
    cells = (6, 6, 2)
    mesh = _solid(box_mesh((60.0, 60.0, 16.0), cells, keep=lambda cell: bool(keep(cell))))
    assert mirror_notes(mesh) == ()


def test_a_box_and_a_disk_that_are_meshed_apart_are_told_the_way() -> None:
    occ = pytest.importorskip("netgen.occ")
    round_disk = occ.Cylinder(occ.Pnt(5.0, 0.0, 0.0), occ.Z, 40.0, 16.0)
    for solid in (box((0.0, -30.0, 25.0), (130.0, 60.0, 16.0)), round_disk):
        mesh = Mesh(*tetrahedralise(solid, MesherSettings(size_mm=12.0)))
        (note,) = mirror_notes(mesh)
        assert "mesh its half y >= 0 and add the mirror image" in note
        assert "move" not in note
        (note,) = mirror_notes(replace(mesh, nodes=mesh.nodes + np.array([0.0, 50.0, 0.0])))
        assert "to y = 0, mesh its half y >= 0" in note


def test_spread_points_come_with_their_images() -> None:
    """And lie no further apart than without."""
    half = np.random.default_rng(1).uniform([0.0, 0.5, 0.0], [60.0, 20.0, 20.0], (150, 3))
    points = np.concatenate([half, half * FLIP, half[:9] * [1.0, 0.0, 1.0]])
    images = np.concatenate([np.arange(150, 300), np.arange(150), np.arange(300, 309)])
    chosen = spread_points(points, 12.0, images=images)
    np.testing.assert_array_equal(np.sort(images[chosen]), chosen)
    between = np.linalg.norm(points[:, None] - points[chosen], axis=2)
    assert between.min(axis=1).max() <= 12.0
