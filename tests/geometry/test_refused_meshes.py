"""Meshes that look whole but would bend another leg than the one that was drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.bend import end_face_bend_deg, end_face_turn_deg
from pneumorph.geometry.leg_pose_checks import check_outwards
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.pose import rotation_about
from pneumorph.geometry.quadratic import quadratic_mesh

meshio = pytest.importorskip("meshio")

REGIONS = {1: "cavity", 2: "sheet", 3: "attachment", 4: "outer_end_face"}
ENDS = ("attachment", "outer_end_face")
Cells = list[tuple[str, np.ndarray, int | np.ndarray]]


@pytest.fixture
def hollow() -> Mesh:
    return box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)


@pytest.fixture
def filled() -> Mesh:
    """The same with elements in its chamber, whose surface is still called cavity."""
    whole = box_mesh((9.0, 9.0, 9.0), (3, 3, 3))
    hollow = box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)
    number = {tuple(place): node for node, place in enumerate(whole.nodes.round(6).tolist())}
    same = np.array([number[tuple(place)] for place in hollow.nodes.round(6).tolist()])
    return replace(whole, surfaces={**whole.surfaces, "cavity": same[hollow.surfaces["cavity"]]})


def cells_of(mesh: Mesh, volume: int | np.ndarray = 7) -> Cells:
    """A leg's cells, kind by kind, with the numbers of their regions."""
    skin = mesh.surfaces["skin"]
    x = mesh.nodes[skin][:, :, 0]
    return [
        ("triangle", mesh.surfaces["cavity"], 1),
        ("triangle", mesh.surfaces["bottom"], 2),
        ("triangle", skin[np.all(x == 0.0, axis=1)], 3),
        ("triangle", skin[np.all(x == 9.0, axis=1)], 4),
        ("tetra", mesh.tetrahedra, volume),
    ]


def write(
    path: Path, nodes: np.ndarray, cells: Cells, volumes: dict[int, str] | None = None
) -> Path:
    """Save them as gmsh's older format has it, or as VTK with cell data for ``.vtu``."""
    tags = [np.broadcast_to(np.int32(tag), len(block)) for _, block, tag in cells]
    dimension = {number: 1 if kind == "line" else 2 for kind, _, number in cells[:-1]}
    if path.suffix == ".vtu":
        data, names = {"region": tags}, {}
    else:
        entities = [np.full(len(each), number) for number, each in enumerate(tags, 1)]
        data = {"gmsh:physical": tags, "gmsh:geometrical": entities}
        names = {name: np.array([tag, dimension.get(tag, 2)]) for tag, name in REGIONS.items()}
        names |= {name: np.array([tag, 3]) for tag, name in (volumes or {}).items()}
    content = meshio.Mesh(
        nodes, [(kind, block) for kind, block, _ in cells], cell_data=data, field_data=names
    )
    content.write(path, **({} if path.suffix == ".vtu" else {"file_format": "gmsh22"}))
    return path


def test_a_cavity_that_is_filled_is_refused(filled: Mesh, tmp_path: Path) -> None:
    """Its surface lies on faces of elements, and pressure in it would bend next to nothing."""
    told = r"12 of 12 triangles of surface 'cavity' lie between two elements.* delete its volume"
    with pytest.raises(MeshError, match=told):
        check_mesh(filled)
    # However its triangles look: a mesher need not orient those between two volumes.
    cavity = filled.surfaces["cavity"].copy()
    cavity[::2] = cavity[::2, ::-1]
    with pytest.raises(MeshError, match=told):
        check_mesh(replace(filled, surfaces={"cavity": cavity}))
    path = write(tmp_path / "filled.msh", filled.nodes, cells_of(filled))
    with pytest.raises(MeshError, match=rf"filled\.msh: {told}"):
        read_mesh_file(path, node_sets=ENDS)


@pytest.mark.parametrize("region", ["bottom", "cavity"])
@pytest.mark.parametrize("turned", [False, True])
def test_a_surface_with_a_triangle_twice_is_refused(
    region: str, turned: bool, hollow: Mesh
) -> None:
    """Pressure would act on it twice, and a leg in the air push itself."""
    own = hollow.surfaces[region]
    more = own[3:5, ::-1] if turned else own[3:5]
    twice = {**hollow.surfaces, region: np.concatenate([own, more])}
    told = rf"2 of {len(own)} triangles of surface '{region}' occur more than once, one of them at"
    with pytest.raises(MeshError, match=told):
        check_mesh(replace(hollow, surfaces=twice))


@pytest.mark.parametrize("name", ["leg.msh", "leg.vtu"])
def test_regions_of_a_file_that_overlap_are_joined(name: str, hollow: Mesh, tmp_path: Path) -> None:
    """An element in two groups of gmsh's older format is there twice."""
    cells = cells_of(hollow)
    ceiling = hollow.nodes[hollow.surfaces["cavity"]][:, :, 2].min(axis=1) == 6.0
    over = ("triangle", hollow.surfaces["cavity"][ceiling], 9)
    names = {**REGIONS, 9: "cavity"}
    plain = write(tmp_path / f"plain_{name}", hollow.nodes, cells)
    path = write(tmp_path / name, hollow.nodes, [over, *cells])
    expected = read_mesh_file(plain, node_sets=ENDS, region_names=REGIONS)
    found = read_mesh_file(path, node_sets=ENDS, region_names=names)
    assert ceiling.sum() == 2
    assert sorted(found.surfaces["cavity"].tolist()) == sorted(expected.surfaces["cavity"].tolist())
    np.testing.assert_array_equal(found.surfaces["sheet"], expected.surfaces["sheet"])


def test_a_file_of_several_volumes_is_refused(hollow: Mesh, tmp_path: Path) -> None:
    """They would all be of one material; entities that gmsh numbers by itself may be many."""
    half = np.where(hollow.nodes[hollow.tetrahedra][:, :, 2].mean(axis=1) < 4.5, 7, 8)
    count, path = np.bincount(half)[7:], tmp_path / "two.msh"
    write(path, hollow.nodes, cells_of(hollow, half), {7: "stiff", 8: "soft"})
    with pytest.raises(
        MeshError,
        match=rf"two\.msh: its 156 tetrahedra are in 2 physical volumes "
        rf"\('soft': {count[1]}, 'stiff': {count[0]}\), .*one solid material; put all .* into one "
        "physical volume, and delete what is not",
    ):
        read_mesh_file(path, node_sets=ENDS)
    write(path, hollow.nodes, cells_of(hollow, half))
    with pytest.raises(MeshError, match=rf"2 physical volumes \(7: {count[0]}, 8: {count[1]}\)"):
        read_mesh_file(path, node_sets=ENDS)
    path = write(tmp_path / "two.vtu", hollow.nodes, cells_of(hollow, half))
    with pytest.raises(MeshError, match=rf"2 regions \(7: {count[0]}, 8: {count[1]}\)"):
        read_mesh_file(path, node_sets=ENDS, region_names=REGIONS)


def test_tetrahedra_in_no_group_beside_others_are_refused(hollow: Mesh, tmp_path: Path) -> None:
    """gmsh saves them with 0 for their group where it was asked for all."""
    half = np.where(hollow.nodes[hollow.tetrahedra][:, :, 0].mean(axis=1) < 4.5, 7, 0)
    count = int((half == 7).sum())
    for volumes, name in (({}, "7"), ({7: "stiff"}, "'stiff'")):
        path = write(tmp_path / "half.msh", hollow.nodes, cells_of(hollow, half), volumes)
        told = rf"2 physical volumes \({name}: {count}, in none: {156 - count}\)"
        with pytest.raises(MeshError, match=told):
            read_mesh_file(path, node_sets=ENDS)


def test_another_name_for_a_group_that_has_one_is_refused(hollow: Mesh, tmp_path: Path) -> None:
    """It would change nothing."""
    path = write(tmp_path / "leg.msh", hollow.nodes, cells_of(hollow))
    told = r"leg\.msh: region 2 is to be called 'sole', and the file calls it 'sheet', expected a"
    with pytest.raises(MeshError, match=told):
        read_mesh_file(path, node_sets=ENDS, region_names={2: "sole"})
    read_mesh_file(path, node_sets=ENDS, region_names={2: "sheet", 7: "silicone"})
    # A line of the same number has none.
    edge = ("line", hollow.surfaces["bottom"][:1, :2], 2)
    path = write(tmp_path / "edge.msh", hollow.nodes, [edge, *cells_of(hollow)])
    mesh = read_mesh_file(path, node_sets=ENDS, region_names={2: "front"})
    assert len(mesh.node_sets["front"]) == 2


@pytest.mark.parametrize("strange", [np.nan, 2.5, np.inf])
def test_regions_of_no_whole_number_are_refused(
    strange: float, hollow: Mesh, tmp_path: Path
) -> None:
    cells = cells_of(hollow)
    tags = [np.full(len(block), float(tag)) for _, block, tag in cells]
    content = meshio.Mesh(hollow.nodes, [each[:2] for each in cells], cell_data={"region": tags})
    content.write(tmp_path / "leg.vtu")
    read_mesh_file(tmp_path / "leg.vtu", node_sets=ENDS, region_names=REGIONS)
    content.cell_data["region"][1][3] = strange
    content.write(tmp_path / "leg.vtu")
    told = (
        rf"leg\.vtu: cell data 'region' of its triangle cells are {strange:g}, expected one whole"
    )
    with pytest.raises(MeshError, match=told):
        read_mesh_file(tmp_path / "leg.vtu", node_sets=ENDS, region_names=REGIONS)


@pytest.mark.parametrize("kind", ["xdmf", "bdf", "f3grid", "su2", "dat", "mesh"])
def test_damaged_files_of_any_kind_are_refused(kind: str, tmp_path: Path) -> None:
    """meshio's readers end in errors of their own."""
    path = tmp_path / f"leg.{kind}"
    path.write_bytes(b"\x00\x01garbage 12 3\nfoo bar\n" * 5)
    with pytest.raises(MeshError, match=rf"leg\.{kind} cannot be read as a mesh: ..."):
        read_mesh_file(path)


def test_ends_that_share_nodes_are_refused(hollow: Mesh, tmp_path: Path) -> None:
    """The bend of what is held is none."""
    cells = cells_of(hollow)
    cells[3] = ("triangle", cells[2][1], 4)
    path = write(tmp_path / "same.vtu", hollow.nodes, cells)
    told = r"same\.vtu: attachment and outer_end_face share 16 nodes, expected none"
    with pytest.raises(MeshError, match=told):
        read_mesh_file(path, node_sets=ENDS, region_names=REGIONS)


def test_an_end_round_the_other_is_refused(hollow: Mesh) -> None:
    """There is no way from one to the other."""
    x, y, z = (hollow.nodes - 4.5).T
    centre = np.flatnonzero(np.abs(y) + np.abs(z) < 3.1)
    corners = np.flatnonzero((np.abs(x) == 4.5) & (np.abs(y) == 4.5) & (np.abs(z) == 4.5))
    sets = {"attachment": centre, "outer_end_face": corners}
    with pytest.raises(MeshError, match=r"outer_end_face lies .* mm from attachment, expected it"):
        check_outwards(replace(hollow, node_sets=sets))


def test_points_are_spread_over_a_skin_that_is_a_flat_sole(hollow: Mesh, tmp_path: Path) -> None:
    cells = [*cells_of(hollow), ("triangle", hollow.surfaces["bottom"], 5)]
    path = write(tmp_path / "sole.vtu", hollow.nodes, cells)
    names = {**REGIONS, 5: "skin"}
    mesh = read_mesh_file(path, node_sets=ENDS, region_names=names)
    corners = [[x, y, 0.0] for x in (0.0, 9.0) for y in (0.0, 9.0)]
    assert sorted(mesh.contact_points.tolist()) == corners


@pytest.mark.parametrize("volumes", [{}, {7: "silicone"}])
def test_one_volume_of_several_entities_is_read(
    volumes: dict[int, str], hollow: Mesh, tmp_path: Path
) -> None:
    whole = cells_of(hollow, 7 if volumes else 0)
    kind, block, number = whole[-1]
    split: Cells = [*whole[:-1], (kind, block[:50], number), (kind, block[50:], number)]
    found = [
        read_mesh_file(
            write(tmp_path / f"{place}.msh", hollow.nodes, each, volumes), node_sets=ENDS
        )
        for place, each in enumerate((whole, split))
    ]
    assert found[0].digest() == found[1].digest()


NEWER = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
2 3 "base"
3 1 "all"
3 2 "tip"
$EndPhysicalNames
$Entities
0 0 1 2
1 0 0 0 9 9 9 1 3 0
1 0 0 0 9 9 9 {first} 0
2 0 0 0 9 9 9 2 1 2 0
$EndEntities
$Nodes
1 5 1 5
3 1 0 5
1
2
3
4
5
0 0 0
9 0 0
0 9 0
0 0 9
9 9 9
$EndNodes
$Elements
3 3 1 3
2 1 2 1
1 1 3 2
3 1 4 1
2 1 2 3 4
3 2 4 1
3 2 3 4 5
$EndElements
"""


def test_of_several_groups_one_that_holds_all_tetrahedra_is_enough(tmp_path: Path) -> None:
    """gmsh's newer format writes them once, with all of their groups: a part of the volume may have
    a name of its own."""
    path = tmp_path / "newer.msh"
    path.write_text(NEWER.format(first="2 1 2"))
    read = read_mesh_file(path, surfaces=("base",), node_sets=())
    assert len(read.tetrahedra) == 2
    path.write_text(NEWER.format(first="1 1"))
    read = read_mesh_file(path, surfaces=("base",), node_sets=())
    assert len(read.tetrahedra) == 2


def second_order(mesh: Mesh) -> tuple[np.ndarray, Cells]:
    """Nodes and cells with midside nodes, as a mesher of order 2 saves them."""
    fine = quadratic_mesh(mesh)
    cavity = fine.surface_connectivity("cavity")
    return fine.nodes, [("triangle6", cavity, 1), ("tetra10", fine.connectivity, 7)]


def test_of_second_order_elements_it_is_told_to_save_linear_ones(
    hollow: Mesh, tmp_path: Path
) -> None:
    path = write(tmp_path / "second.vtu", *second_order(hollow))
    with pytest.raises(MeshError) as refusal:
        read_mesh_file(path, node_sets=ENDS)
    told = str(refusal.value)
    assert "its cells are: tetra10, triangle6: save linear (first-order) elements" in told
    assert "--quadratic adds midside nodes" in told
    assert "fill the surface" not in told
    path = write(tmp_path / "shell.vtu", hollow.nodes, cells_of(hollow)[:1])
    with pytest.raises(MeshError, match="its cells are: triangle: fill the surface") as refusal:
        read_mesh_file(path, node_sets=ENDS)
    assert "first-order" not in str(refusal.value)


@pytest.mark.parametrize("kind", ["line", "vertex", "side"])
def test_an_end_that_is_no_face_is_refused(kind: str, hollow: Mesh, tmp_path: Path) -> None:
    """A line or a point turns about itself unseen: such a leg never bent."""
    x, y, z = hollow.nodes.T
    edge = np.flatnonzero((x == 9.0) & (z == 0.0))
    edge = edge[np.argsort(y[edge])]
    ends: dict[str, np.ndarray] = {
        "line": np.stack([edge[:-1], edge[1:]], axis=1),
        "vertex": edge[:1, None],
        "side": hollow.surfaces["cavity"][:1],  # a face, but none of the outside
    }
    cells = [each for each in cells_of(hollow) if each[2] != 4]
    own = ("triangle" if kind == "side" else kind, ends[kind], 4)
    path = write(tmp_path / "end.vtu", hollow.nodes, [own, *cells])
    count = len(np.unique(ends[kind]))
    with pytest.raises(
        MeshError, match=rf"end\.vtu: the {count} nodes of outer_end_face cover no triangle of the"
    ):
        read_mesh_file(path, node_sets=ENDS, region_names=REGIONS)


@pytest.mark.parametrize("bend", [end_face_bend_deg, end_face_turn_deg])
def test_the_bend_of_a_line_is_no_number(bend, hollow: Mesh) -> None:
    x, _, z = hollow.nodes.T
    ends = {
        "none": [],
        "point": np.flatnonzero(x == 9.0)[:1],
        "line": np.flatnonzero((x == 9.0) & (z == 0.0)),
        "face": np.flatnonzero(x == 9.0),
        "corner": np.flatnonzero((x == 9.0) & (hollow.nodes[:, 1] + z <= 3.0)),
    }
    turned = hollow.nodes @ rotation_about("y", 30.0).T
    # The same a metre away, as single precision holds it.
    far = np.float32(hollow.nodes @ rotation_about("z", 40.0).T + 1000.0)
    for mesh in (hollow, replace(hollow, nodes=far)):
        mesh = replace(mesh, node_sets=ends)
        for name in ("none", "point", "line"):
            told = rf"the {len(ends[name])} nodes of '{name}' lie on a line .* expected those of a"
            with pytest.raises(ValueError, match=told):
                bend(mesh, turned, name)
    for name in ("face", "corner"):
        angle = bend(replace(hollow, node_sets=ends), turned, name)
        assert angle == pytest.approx(30.0, abs=1e-9)


def test_a_sheet_of_no_faces_is_refused(hollow: Mesh, tmp_path: Path) -> None:
    """Two triangles from corner to corner of the bottom, where the solid has eighteen."""
    at = {tuple(place): node for node, place in enumerate(hollow.nodes.round(6).tolist())}
    a, b, c, d = (at[x, y, 0.0] for x, y in ((0, 0), (9, 0), (9, 9), (0, 9)))
    large = np.array([[a, c, b], [a, d, c]])
    cells = [each for each in cells_of(hollow) if each[2] != 2]
    path = write(tmp_path / "large.msh", hollow.nodes, [("triangle", large, 2), *cells])
    told = "2 of 2 triangles of surface 'sheet' are no faces of the solid's elements"
    with pytest.raises(MeshError, match=rf"large\.msh: {told}"):
        read_mesh_file(path, node_sets=ENDS)
    # A membrane may be of another name, which is asked for.
    with pytest.raises(MeshError, match="'fibre' are no faces"):
        check_mesh(replace(hollow, surfaces={"fibre": large}), ["fibre"])


def test_a_sheet_may_lie_within_the_solid_and_look_either_way() -> None:
    """As a fabric that is cast in."""
    box = box_mesh((6.0, 4.0, 4.0), (3, 2, 2))
    faces = np.concatenate([box.tetrahedra[:, each] for each in ([0, 2, 1], [0, 1, 3], [1, 2, 3])])
    within = faces[np.all(box.nodes[faces][:, :, 2] == 2.0, axis=1)]
    _, first = np.unique(np.sort(within, axis=1), axis=0, return_index=True)
    within = within[first]
    assert len(within) >= 4
    for sheet in (within, within[:, ::-1]):
        check_mesh(replace(box, surfaces={"sheet": sheet}), ["sheet"])
