"""An Abaqus file has its regions in element sets and node sets; what would be lost is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_file import read_mesh_file

meshio = pytest.importorskip("meshio")

ENDS = ("attachment", "outer_end_face")


@pytest.fixture
def hollow() -> Mesh:
    return box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True)


def write(path: Path, mesh: Mesh, **volumes: np.ndarray) -> Path:
    """Elements, sets of triangles, ends as node sets, and sets of tetrahedra."""
    cells = [
        ("tetra", mesh.tetrahedra),
        ("triangle", mesh.surfaces["cavity"]),
        ("triangle", mesh.surfaces["bottom"]),
    ]
    none = np.zeros(0, dtype=int)
    sets = {name: [np.flatnonzero(inside), none, none] for name, inside in volumes.items()}
    sets["cavity"] = [none, np.arange(len(cells[1][1])), none]
    sets["sheet"] = [none, none, np.arange(len(cells[2][1]))]
    ends = {"attachment": mesh.node_sets["left"], "outer_end_face": mesh.node_sets["right"]}
    meshio.Mesh(mesh.nodes, cells, cell_sets=sets, point_sets=ends).write(path)
    return path


def test_node_sets_of_the_file_are_taken(hollow: Mesh, tmp_path: Path) -> None:
    mesh = read_mesh_file(write(tmp_path / "leg.inp", hollow), node_sets=ENDS)
    np.testing.assert_array_equal(mesh.node_sets["attachment"], hollow.node_sets["left"])
    np.testing.assert_array_equal(mesh.node_sets["outer_end_face"], hollow.node_sets["right"])
    assert len(mesh.surfaces["sheet"]) == len(hollow.surfaces["bottom"])


def test_element_sets_of_tetrahedra_are_volumes(hollow: Mesh, tmp_path: Path) -> None:
    """They may be of different materials; one that holds all is enough."""
    hard = hollow.nodes[hollow.tetrahedra][:, :, 0].mean(axis=1) > 4.5
    path, count = tmp_path / "two.inp", int(hard.sum())
    write(path, hollow, hard=hard, soft=~hard)
    told = rf"156 tetrahedra are in 2 element sets \('hard': {count}, 'soft': {156 - count}\)"
    with pytest.raises(MeshError, match=rf"two\.inp: its {told}, expected one"):
        read_mesh_file(path, node_sets=ENDS)
    write(path, hollow, hard=hard)
    with pytest.raises(MeshError, match=rf"\('hard': {count}, in none: {156 - count}\)"):
        read_mesh_file(path, node_sets=ENDS)
    for volumes in ({"tip": hard, "all": hard | ~hard}, {"all": hard | ~hard}, {}):
        read_mesh_file(write(path, hollow, **volumes), node_sets=ENDS)


def test_a_set_before_elements_has_none_of_those(hollow: Mesh, tmp_path: Path) -> None:
    """The tetrahedra may stand last."""
    path = write(tmp_path / "leg.inp", hollow)
    expected = read_mesh_file(path, node_sets=ENDS)
    head, solid, rest = path.read_text().partition("*ELEMENT, TYPE=C3D4\n")
    block, mark, rest = rest.partition("*ELEMENT")
    path.write_text(head + mark + rest.rstrip("\n") + "\n" + solid + block)
    assert read_mesh_file(path, node_sets=ENDS).digest() == expected.digest()


SURFACE = (
    "*Elset, elset=_cavity_S1, internal\n1,2\n*Surface, type=ELEMENT, name={}\n_cavity_S1, S1\n"
)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "*ELSET, ELSET=cavity\n",
            SURFACE.format("cavity") + "*ELSET, ELSET=other\n",
            r"its \*SURFACE 'cavity' is made of faces of elements, .* expected shell elements \(S3",
        ),
        ("*ELSET, ELSET=cavity\n", "*ELSET, ELSET=skin\nsheet\n*ELSET, ELSET=cavity\n",
         r"its \*ELSET 'skin' is made of other sets, expected numbers"),
        ("*NSET, NSET=attachment\n", "*NSET, NSET=attachment\nleft\n", "'attachment' is made of"),
        ("*NSET, NSET=outer", "*NSET, NSET=attachment\n1,2\n*NSET, NSET=outer",
         "its NSET 'attachment' is in 2 blocks, expected one"),
        ("*ELEMENT, TYPE=C3D4\n", "*NODE\n99,0.,0.,0.\n*ELEMENT, TYPE=C3D4\n",
         r"its nodes are in several \*NODE blocks"),
        ("*ELEMENT, TYPE=C3D4\n", "*INCLUDE, INPUT=more.inp\n*ELEMENT, TYPE=C3D4\n", "it includes"),
        ("*ELEMENT, TYPE=R3D3\n", "*ELEMENT, TYPE=R3D3, ELSET=walls\n",
         r"its \*ELEMENT lines have an ELSET twice, or one after a line that has none"),
        ("*NSET, NSET=outer",
         "*Solid Section, elset=a, material=Soft\n*Solid Section, elset=b, material=Hard\n"
         "*NSET, NSET=outer", r"its solid sections are of 2 materials \(Hard, Soft\)"),
    ],
    ids=["surface", "sets", "nodes", "twice", "blocks", "include", "place", "materials"],
)  # fmt: skip
def test_what_meshio_would_lose_is_refused(
    old: str, new: str, told: str, hollow: Mesh, tmp_path: Path
) -> None:
    """Else a leg would be read without its skin, or with wrong triangles for its sheet."""
    path = write(tmp_path / "leg.inp", hollow)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(MeshError, match=rf"leg\.inp: .*{told}"):
        read_mesh_file(path, node_sets=ENDS)


def test_surfaces_that_are_no_regions_are_left_alone(hollow: Mesh, tmp_path: Path) -> None:
    """Such as those of a contact, and one beside shell elements of the same name."""
    path = write(tmp_path / "leg.inp", hollow, all=np.ones(156, dtype=bool))
    more = SURFACE.format("floor") + "*Surface, type=ELEMENT, name=cavity\n_cavity_S1, S1\n"
    path.write_text(path.read_text().rstrip("\n") + "\n" + more)
    mesh = read_mesh_file(path, node_sets=ENDS)
    np.testing.assert_array_equal(mesh.surfaces["cavity"], hollow.surfaces["cavity"])
