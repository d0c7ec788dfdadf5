from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.two_chambers import two_chamber_mesh

from pneumorph.base.artefact import ArtefactError
from pneumorph.geometry.leg_pose_checks import check_outwards
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.pose import rotation_about
from pneumorph.geometry.surface import TETRAHEDRON_FACES, enclosed_volume

meshio = pytest.importorskip("meshio")


def write(mesh, path, *, cavity=None, file_format=None, scale=1.0):
    cavity = mesh.surfaces["cavity"] if cavity is None else cavity
    cells = [
        ("tetra", mesh.tetrahedra),
        ("triangle", cavity),
        ("triangle", mesh.surfaces["bottom"]),
    ]
    tags = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in enumerate(cells, 1)]
    gmsh = file_format is not None and file_format.startswith("gmsh")
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags} if gmsh else {"region": tags}
    names = {"solid": [1, 3], "cavity": [2, 2], "paper": [3, 2]} if gmsh else {}
    names = {name: np.array(value) for name, value in names.items()}
    content = meshio.Mesh(mesh.nodes * scale, cells, cell_data=data, field_data=names)
    meshio.write(path, content, file_format=file_format)


@pytest.fixture
def hollow():
    return box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)


def test_gmsh_file_with_physical_groups(hollow, tmp_path):
    """The group of the sheet may have its name of earlier versions."""
    write(hollow, tmp_path / "box.msh", file_format="gmsh22")
    mesh = read_mesh_file(tmp_path / "box.msh", node_sets=("paper",))
    np.testing.assert_allclose(mesh.nodes, hollow.nodes, atol=1e-12)
    assert np.array_equal(mesh.tetrahedra, hollow.tetrahedra)
    assert len(mesh.surfaces["cavity"]) == len(hollow.surfaces["cavity"])
    assert len(mesh.surfaces["sheet"]) == len(hollow.surfaces["bottom"])


def test_vtk_file_with_numbered_regions_in_metres(hollow, tmp_path):
    write(hollow, tmp_path / "box.vtu", scale=1e-3)
    names = {2: "cavity", 3: "sheet"}
    mesh = read_mesh_file(tmp_path / "box.vtu", node_sets=(), region_names=names, scale=1000.0)
    np.testing.assert_allclose(mesh.nodes, hollow.nodes, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_a_mesh_in_other_units_is_refused(scale, hollow, tmp_path):
    """A leg of 0.1 m read as one of 0.1 mm has no stiffness and no weight worth a word."""
    write(hollow, tmp_path / "box.vtu", scale=scale)
    with pytest.raises(
        MeshError, match=r"box\.vtu: it is .* mm long with a scale of 1, expected 1 to"
    ):
        read_mesh_file(tmp_path / "box.vtu", node_sets=(), region_names={2: "cavity", 3: "sheet"})


def test_cavity_oriented_by_a_mesher_is_turned_round(hollow, tmp_path):
    turned = hollow.surfaces["cavity"][:, ::-1]
    write(hollow, tmp_path / "box.msh", cavity=turned, file_format="gmsh22")
    mesh = read_mesh_file(tmp_path / "box.msh", node_sets=())
    assert np.array_equal(mesh.surfaces["cavity"], hollow.surfaces["cavity"])


def test_open_cavity_and_missing_region_are_refused(hollow, tmp_path):
    path = tmp_path / "box.msh"
    write(hollow, path, cavity=hollow.surfaces["cavity"][1:], file_format="gmsh22")
    with pytest.raises(MeshError, match=r"mesh file .*box\.msh: .*not closed"):
        read_mesh_file(path, node_sets=())
    with pytest.raises(MeshError, match="unknown node set 'attachment'; the mesh has: cavity"):
        read_mesh_file(path)


def test_a_leg_upside_down_is_refused(hollow, tmp_path):
    turned = replace(hollow, nodes=hollow.nodes @ np.diag([1.0, -1.0, -1.0]))
    write(turned, tmp_path / "box.msh", file_format="gmsh22")
    with pytest.raises(MeshError, match=r"box\.msh: the sheet lies 9\.0 mm above .* upside down"):
        read_mesh_file(tmp_path / "box.msh", node_sets=())


@pytest.mark.parametrize("turn_deg", [90.0, -90.0, 50.0, 40.0])
@pytest.mark.parametrize("inwards", [False, True])
def test_a_leg_on_its_side_is_refused(turn_deg, inwards, hollow, tmp_path):
    """As of a program in which y is up, with the sheet as high as the leg; however its triangles
    look."""
    bottom = hollow.surfaces["bottom"]
    surfaces = {**hollow.surfaces, "bottom": bottom[:, ::-1] if inwards else bottom}
    nodes = hollow.nodes @ rotation_about("x", turn_deg).T
    nodes[:, 2] += 1e-3 * nodes[:, 0]  # nothing is quite level
    write(replace(hollow, nodes=nodes, surfaces=surfaces), tmp_path / "b.msh", file_format="gmsh22")
    told = r"b\.msh: the sheet lies .* mm above .* looks along \(.*, expected .* or y up as in some"
    refused = abs(turn_deg) > 45.0
    with pytest.raises(MeshError, match=told) if refused else nullcontext():
        read_mesh_file(tmp_path / "b.msh", node_sets=())


@pytest.mark.parametrize(("height", "refused"), [(3.0, False), (6.0, True)])
def test_a_sheet_within_the_leg_is_refused_in_its_upper_half(height, refused, tmp_path):
    """It looks nowhere."""
    solid = box_mesh((9.0, 9.0, 9.0), (3, 3, 3))
    faces = solid.tetrahedra[:, TETRAHEDRON_FACES].reshape(-1, 3)
    level = np.all(solid.nodes[faces][:, :, 2] == height, axis=1)
    write(replace(solid, surfaces={"bottom": faces[level]}), tmp_path / "b.vtu", cavity=faces[:1])
    told = r"the sheet lies 6\.0 mm above the lowest node of 9\.0 mm, expected it at the bottom, z"
    with pytest.raises(MeshError, match=told) if refused else nullcontext():
        read_mesh_file(tmp_path / "b.vtu", ("sheet",), (), region_names={3: "sheet"})


@pytest.mark.parametrize(("axis", "sign", "refused"), [(0, 1, 0), (0, -1, 1), (1, 1, 1), (2, 1, 1)])
def test_a_leg_that_does_not_point_outwards_is_refused(hollow, axis, sign, refused):
    along = sign * hollow.nodes[:, axis]
    ends = {"attachment": along == along.min(), "outer_end_face": along == along.max()}
    mesh = replace(hollow, node_sets={name: np.flatnonzero(at) for name, at in ends.items()})
    expected = pytest.raises(MeshError, match=r"mm from attachment, expected it along \+x")
    with expected if refused else nullcontext():
        check_outwards(mesh)


def test_surface_only_and_damaged_files_are_refused(hollow, tmp_path):
    path = tmp_path / "shell.vtu"
    meshio.write(path, meshio.Mesh(hollow.nodes, [("triangle", hollow.surfaces["skin"])]))
    with pytest.raises(MeshError, match="no linear tetrahedra; its cells are: triangle"):
        read_mesh_file(path)
    damaged = tmp_path / "damaged.msh"
    damaged.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0\n")
    with pytest.raises(MeshError, match="cannot be read as a mesh"):
        read_mesh_file(damaged)
    with pytest.raises(FileNotFoundError, match="does not exist"):
        read_mesh_file(tmp_path / "nowhere.msh")


def test_skin_and_contact_points_come_from_the_boundary(hollow, tmp_path):
    write(hollow, tmp_path / "box.msh", file_format="gmsh22")
    mesh = read_mesh_file(tmp_path / "box.msh", node_sets=(), contact_spacing_mm=4.0)
    # Six faces of three by three squares, two triangles each; the cavity is none of them.
    assert len(mesh.surfaces["skin"]) == 6 * 9 * 2
    assert enclosed_volume(mesh.nodes, mesh.surfaces["skin"]) == pytest.approx(9.0**3)
    corners = {tuple(p) for p in mesh.contact_points if set(p) <= {0.0, 9.0}}
    assert len(corners) == 8


def test_a_skin_of_the_file_is_kept(hollow, tmp_path):
    skin = hollow.surfaces["skin"][::-1]
    blocks = [hollow.tetrahedra, hollow.surfaces["cavity"], hollow.surfaces["bottom"], skin]
    cells = list(zip(("tetra", "triangle", "triangle", "triangle"), blocks, strict=True))
    tags = [np.full(len(block), tag) for tag, block in enumerate(blocks, 1)]
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(hollow.nodes, cells, cell_data={"region": tags}))
    names = dict(enumerate(("cavity", "sheet", "skin"), 2))
    mesh = read_mesh_file(tmp_path / "b.vtu", node_sets=(), region_names=names)
    assert np.array_equal(mesh.surfaces["skin"], skin)


def _with_own_skin(hollow, path, skin, **more):
    blocks = [hollow.tetrahedra, hollow.surfaces["cavity"], hollow.surfaces["bottom"], skin]
    cells = list(zip(("tetra", "triangle", "triangle", "triangle"), blocks, strict=True))
    tags = [np.full(len(block), tag) for tag, block in enumerate(blocks, 1)]
    for kind, block in more.items():
        cells.append((kind, block))
        tags.append(np.full(len(block), 9))
    meshio.write(path, meshio.Mesh(hollow.nodes, cells, cell_data={"region": tags}))
    names = dict(enumerate(("cavity", "sheet", "skin"), 2))
    return read_mesh_file(path, node_sets=(), region_names=names)


def test_a_skin_looks_outwards_however_it_is_given(hollow, tmp_path):
    """What a part encloses, its mass by volume, is told by it."""
    skin = hollow.surfaces["skin"]
    inwards = np.concatenate([skin[:50, ::-1], skin[50:]])
    mesh = _with_own_skin(hollow, tmp_path / "b.vtu", inwards)
    assert enclosed_volume(mesh.nodes, mesh.surfaces["skin"]) == pytest.approx(9.0**3)


def test_a_skin_that_is_inside_and_cells_that_would_be_lost_are_refused(hollow, tmp_path):
    wrong = np.concatenate([hollow.surfaces["skin"], hollow.surfaces["cavity"][:3]])
    with pytest.raises(MeshError, match="3 of 111 triangles of the surface 'skin' are not on the"):
        _with_own_skin(hollow, tmp_path / "in.vtu", wrong)
    more = {"hexahedron": np.arange(8)[None]}
    with pytest.raises(MeshError, match="holds hexahedron cells beside linear tetrahedra"):
        _with_own_skin(hollow, tmp_path / "mixed.vtu", hollow.surfaces["skin"], **more)


GROUPS = {"solid": (3, 1), "cavity": (2, 2), "sheet": (2, 3), "skin": (2, 4)}
"""Dimension and number of gmsh's physical groups."""


def write_newer(mesh, path, solid=("solid",)):
    """As gmsh's format 4.1 has it: elements once, each entity with its groups, here the sheet as
    part of the skin, and the tetrahedra in the groups `solid`."""
    bottom = {tuple(sorted(each)) for each in mesh.surfaces["bottom"].tolist()}
    skin = mesh.surfaces["skin"]
    on = np.array([tuple(sorted(each)) in bottom for each in skin.tolist()])
    entities = [
        (2, mesh.surfaces["cavity"], ("cavity",)),
        (2, skin[on], ("skin", "sheet")),
        (2, skin[~on], ("skin",)),
        (3, mesh.tetrahedra, solid),
    ]
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", f"{len(GROUPS)}"]
    lines += [f'{dimension} {number} "{name}"' for name, (dimension, number) in GROUPS.items()]
    lines += ["$EndPhysicalNames", "$Entities", "0 0 3 1"]
    for number, (dimension, _, names) in enumerate(entities, 1):
        groups = " ".join(str(GROUPS[name][1]) for name in names)
        bounded = "3 1 2 3" if dimension == 3 else "0"
        lines.append(f"{number} 0 0 0 9 9 9 {len(names)} {groups} {bounded}")
    count = len(mesh.nodes)
    lines += ["$EndEntities", "$Nodes", f"1 {count} 1 {count}", f"3 4 0 {count}"]
    lines += [str(number + 1) for number in range(count)]
    lines += [" ".join(map(str, map(float, place))) for place in mesh.nodes]
    count = sum(len(members) for _, members, _ in entities)
    lines += ["$EndNodes", "$Elements", f"4 {count} 1 {count}"]
    tags = iter(range(1, count + 1))
    for number, (dimension, members, _) in enumerate(entities, 1):
        lines.append(f"{dimension} {number} {2 if dimension == 2 else 4} {len(members)}")
        lines += [" ".join(map(str, [next(tags), *(each + 1)])) for each in members]
    path.write_text("\n".join([*lines, "$EndElements"]) + "\n")


def test_a_face_may_be_in_two_groups_of_gmsh_s_newer_format(hollow, tmp_path):
    """The sheet is part of the skin; gmsh writes its elements once, with both groups. That a reader
    numbers regions changes nothing of those that the file names."""
    path = tmp_path / "two.msh"
    write_newer(hollow, path)
    mesh = read_mesh_file(path, node_sets=("sheet", "skin"), contact_spacing_mm=4.0)
    assert len(mesh.surfaces["skin"]) == 108
    assert len(mesh.surfaces["sheet"]) == 18
    path.write_text(path.read_text().replace('\n2 2 "cavity"', "").replace("Names\n4", "Names\n3"))
    numbered = read_mesh_file(
        path, node_sets=("sheet",), region_names={2: "cavity"}, contact_spacing_mm=4.0
    )
    assert numbered.digest() == mesh.digest()
    with pytest.raises(MeshError, match=r"no element is in region 99, .*'lid', .*: 1, 2, 4"):
        read_mesh_file(path, node_sets=("sheet",), region_names={99: "lid"})


def test_elements_in_no_group_of_gmsh_are_told_of(hollow, tmp_path):
    """gmsh saves them where it was asked for all."""
    path = tmp_path / "all.msh"
    write_newer(hollow, path, solid=())
    with pytest.raises(MeshError, match=r"all\.msh .* in no physical group: .*SaveAll = 0"):
        read_mesh_file(path, node_sets=("sheet", "skin"), contact_spacing_mm=4.0)


def test_faces_that_are_held_or_turn_are_no_surface_of_their_own(hollow):
    """In a file they are triangles as the sheet is, whose friction their edges have."""
    skin, bottom = hollow.surfaces["skin"], hollow.surfaces["bottom"]
    side = skin[np.all(hollow.nodes[skin][:, :, 0] == 9.0, axis=1)]
    surfaces = {"cavity": hollow.surfaces["cavity"], "skin": skin, "sheet": bottom}
    edge = np.array([[9.0, 4.5, 0.0]])
    plain = replace(hollow, surfaces=surfaces, contact_points=edge).contact_surfaces
    held = replace(
        hollow, surfaces={**surfaces, "outer_end_face": side}, contact_points=edge
    ).contact_surfaces
    assert held.names.tolist() == plain.names.tolist() == ["sheet"]
    np.testing.assert_array_equal(held.area_mm2, plain.area_mm2)


def test_a_hole_in_no_cavity_is_refused(tmp_path):
    """A second chamber whose group is called otherwise would never be inflated."""
    made = two_chamber_mesh()
    volume = -enclosed_volume(made.nodes, made.surfaces["cavity_right"][:, ::-1])
    names = {"cavity_left": 2, "chamber_right": 3, "sheet": 4}
    regions = [made.surfaces[each] for each in ("cavity_left", "cavity_right", "sheet")]
    cells = [("tetra", made.tetrahedra), *(("triangle", each) for each in regions)]
    tags = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in enumerate(cells, 1)]
    path = tmp_path / "two.msh"
    meshio.Mesh(
        made.nodes,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([tag, 2]) for name, tag in names.items()},
    ).write(path, file_format="gmsh22")
    told = rf"closed hole of {abs(volume):.4g} mm\^3 .*they are: cavity_left\)"
    with pytest.raises(MeshError, match=told):
        read_mesh_file(path, ("cavity_left", "sheet"), ())


def test_each_of_several_cavities_is_turned_round_and_none_is_skin(tmp_path):
    """Regions whose names begin with cavity; the mesher oriented both the other way."""
    made = two_chamber_mesh()
    regions = ("cavity_left", "cavity_right", "sheet")
    cells = [("tetra", made.tetrahedra)]
    cells += [("triangle", made.surfaces[name][:, ::-1]) for name in regions]
    tags = [np.full(len(block), tag, dtype=np.int32) for tag, (_, block) in enumerate(cells, 1)]
    names = {name: np.array([tag, 2]) for tag, name in enumerate(regions, 2)}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    path = tmp_path / "two.msh"
    meshio.Mesh(made.nodes, cells, cell_data=data, field_data=names).write(
        path, file_format="gmsh22"
    )
    read = read_mesh_file(path, regions, (), contact_spacing_mm=4.0)
    # Of a mesh with several cavities nobody need say so.
    usual = read_mesh_file(path, node_sets=(), contact_spacing_mm=4.0)
    assert usual.digest() == read.digest()
    with pytest.raises(MeshError, match="unknown surface region 'chamber'"):
        read_mesh_file(path, ("chamber",), ())
    for name in regions[:2]:
        np.testing.assert_array_equal(read.surfaces[name], made.surfaces[name])
    assert len(read.surfaces["skin"]) == len(made.surfaces["skin"])
    inside = made.nodes[np.unique(np.vstack([made.surfaces[name] for name in regions[:2]]))]
    distance = np.linalg.norm(read.contact_points[:, None] - inside, axis=2)
    assert distance.min() > 0.5


def test_a_meshers_file_in_place_of_a_mesh_is_told_what_to_do(tmp_path):
    path = tmp_path / "leg.msh"
    path.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
    with pytest.raises(ArtefactError, match=r"not a readable Mesh .*pneumorph mesh --file .*msh"):
        Mesh.load(path)


def test_a_hub_without_a_legs_regions_is_told_how_it_is_read(tmp_path):
    made = two_chamber_mesh()
    path = tmp_path / "hub.vtu"
    meshio.Mesh(made.nodes, [("tetra", made.tetrahedra)]).write(path)
    with pytest.raises(MeshError, match=r"the mesh has: none; a hub needs .*: --surfaces --node-"):
        read_mesh_file(path, ("cavity",), ("attachment",))
    assert read_mesh_file(path, (), ()).tetrahedra.shape == made.tetrahedra.shape
