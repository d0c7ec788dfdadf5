"""What of the options of a mesh would be ignored is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.run_folder import RunFolder
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.netgen_mesher import MesherSettings, box, tetrahedralise
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.study.made_mesh import MEASURED_LEG, MeshSettings, PartName, make_mesh
from pneumorph.study.module_catalogue import read_catalogue

BESIDE = MeshSettings(file=Path("own_leg.msh"))


@pytest.mark.parametrize(
    ("settings", "flag"),
    [
        (replace(BESIDE, leg=replace(PneuNetShape(), tooth_height_mm=9.0)), r"--leg\.\*"),
        (replace(BESIDE, disk=replace(DiskShape(), height_mm=9.0)), r"--disk\.\*"),
        (replace(BESIDE, leg_mesher=MesherSettings(size_mm=3.0)), r"--leg-mesher\.\*"),
        (replace(BESIDE, disk_mesher=MesherSettings(size_mm=9.0)), r"--disk-mesher\.\*"),
    ],
)
def test_a_shape_or_mesher_beside_a_file_is_refused(
    settings: MeshSettings, flag: str, tmp_path: Path
) -> None:
    """Before the file is read: there is none of this name."""
    with pytest.raises(ValueError, match=rf"{flag} has no effect on the mesh of own_leg\.msh"):
        make_mesh("leg", settings, RunFolder(tmp_path / "m", "mesh"))
    assert not (tmp_path / "m").exists()
    replace(settings, file=None).refuse_unused("disk" if "disk" in flag else "leg")


def test_two_names_of_one_region_are_refused(tmp_path: Path) -> None:
    """The first would be lost."""
    settings = replace(BESIDE, regions=("1=cavity", "1=sheet"))
    with pytest.raises(ValueError, match="regions have number 1 twice, as 'cavity' and 'sheet'"):
        make_mesh("leg", settings, RunFolder(tmp_path / "m", "mesh"))


def test_what_changes_the_mesh_of_a_file_is_taken() -> None:
    """A mesher's settings are the usual preset's, which nobody need have asked for."""
    preset = MeshSettings(**MEASURED_LEG)
    replace(preset, file=BESIDE.file, scale=1000.0, quadratic=True).refuse_unused("leg")


@pytest.mark.parametrize(
    "given",
    [
        {"regions": ("1=cavity",)},
        {"scale": 1000.0},
        {"surfaces": ()},
        {"node_sets": ("attachment",)},
        {"contact_spacing_mm": 5.0},
    ],
)
@pytest.mark.parametrize("part", ["leg", "disk"])
def test_how_a_file_is_read_is_refused_without_one(
    given: dict[str, Any], part: PartName, tmp_path: Path
) -> None:
    """Such as a scale of metres, with which a leg would still be as large as its shape says."""
    (name,) = given
    settings = MeshSettings(**MEASURED_LEG, **given)
    told = rf"--{name.replace('_', '-')} has no effect on a {part} that is made from its shape"
    with pytest.raises(ValueError, match=told) as refusal:
        make_mesh(part, settings, RunFolder(tmp_path / "m", "mesh"))
    assert not (tmp_path / "m").exists()
    of_leg = part == "leg" and name == "contact_spacing_mm"
    assert ("--leg.contact-spacing-mm" in str(refusal.value)) == of_leg


@pytest.mark.parametrize(
    ("part", "given", "flag"),
    [
        ("disk", {"leg": PneuNetShape(tooth_height_mm=9.0)}, "leg"),
        ("disk", {"leg_mesher": MesherSettings(size_mm=3.0)}, "leg-mesher"),
        ("leg", {"disk": DiskShape(height_mm=9.0)}, "disk"),
        ("leg", {"disk_mesher": MesherSettings(size_mm=9.0)}, "disk-mesher"),
    ],
)
def test_the_shape_of_another_part_is_refused(
    part: PartName, given: dict[str, Any], flag: str
) -> None:
    told = rf"--{flag}\.\* has no effect on the mesh of a {part}, expected none: it is of the "
    with pytest.raises(ValueError, match=told):
        MeshSettings(**given).refuse_unused(part)
    MeshSettings(**given).refuse_unused("leg" if part == "disk" else "disk")


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("mesh.scale = 1000", r"mesh\.scale is 1000\.0, expected none: it is of a mesh file"),
        ("mesh.disk.height_mm = 9", r"mesh\.disk is .*, expected none: "),
        (
            "mesh.leg.connector_mm = [60, 2, 2]",
            r"connector_mm is 60 mm long, expected more than",
        ),
    ],
)
def test_what_would_change_nothing_of_a_module_is_refused(
    line: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "legs.toml"
    path.write_text(f"[modules.mine]\n{line}\n")
    with pytest.raises(ArtefactError, match=rf"legs\.toml: module mine: .*{told}"):
        read_catalogue(path)


def test_a_cavity_of_several_pieces_is_told(tmp_path: Path) -> None:
    """Of two chambers without a way between them."""
    pytest.importorskip("meshio")
    pytest.importorskip("netgen")
    leg = box((0.0, 0.0, 0.0), (40.0, 12.0, 10.0))
    for x in (4.0, 22.0):
        leg -= box((x, 3.0, 3.0), (14.0, 6.0, 4.0))
    nodes, tetrahedra = tetrahedralise(leg, MesherSettings(size_mm=6.0))
    faces = boundary_triangles(tetrahedra)
    corners = nodes[faces]
    inside = np.all((corners > 1e-6) & (corners < np.array([40.0, 12.0, 10.0]) - 1e-6), axis=(1, 2))
    bottom = np.all(corners[:, :, 2] < 1e-6, axis=1)
    meshio = pytest.importorskip("meshio")
    for name, first in (("one.vtu", nodes.max()), ("two.vtu", 20.0)):
        left = inside & (corners[:, :, 0].mean(axis=1) < first)
        tags = [np.where(bottom, 2, np.where(left, 1, np.where(inside, 3, 9))), np.full(1, 0)]
        tags[1] = np.zeros(len(tetrahedra), dtype=tags[0].dtype)
        cells = [("triangle", faces), ("tetra", tetrahedra)]
        meshio.Mesh(nodes, cells, cell_data={"region": tags}).write(tmp_path / name)
    settings = MeshSettings(file=tmp_path / "one.vtu", regions=("1=cavity", "2=sheet"))
    settings = replace(settings, node_sets=())
    made = make_mesh("leg", settings, RunFolder(tmp_path / "one", "mesh"))
    note, apart = made.notes
    assert note.startswith("the cavity 'cavity' is 2 closed pieces, of 336, 336 mm^3, which are in")
    assert "mirror images of a design walk alike only" in apart  # its middle is y = 6 mm
    regions = ("1=cavity_left", "2=sheet", "3=cavity_right")
    settings = replace(settings, file=tmp_path / "two.vtu", regions=regions)
    assert make_mesh("leg", settings, RunFolder(tmp_path / "two", "mesh")).notes == (apart,)
