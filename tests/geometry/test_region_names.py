"""A mesh of an earlier version, whose sheet was called paper, is the same mesh."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.artefact import load_artefact
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.fem.material import LegMaterials, Material, Membrane
from pneumorph.fem.part_ingredients import ingredients, materials_text
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh


def test_a_sheet_of_an_earlier_version_is_found_and_written_by_its_name_of_now(
    tmp_path: Path,
) -> None:
    box = box_mesh((2.0, 2.0, 2.0), (1, 1, 1))
    older = replace(box, surfaces={"paper": box.surfaces["bottom"], "skin": box.surfaces["skin"]})
    assert list(older.surfaces) == ["sheet", "skin"]
    assert np.array_equal(older.surface("paper"), box.surfaces["bottom"])
    arrays, _ = load_artefact(older.save(tmp_path / "mesh.npz"), "Mesh", 1)
    assert "surface:sheet" in arrays
    assert "surface:paper" not in arrays
    both = replace(box, surfaces={name: box.surfaces["bottom"] for name in ("paper", "sheet")})
    assert sorted(both.surfaces) == ["paper", "sheet"]


@pytest.mark.parametrize("name", ["leg_mesh.npz", "leg_mesh_quadratic.npz", "disk_mesh.npz"])
def test_digests_of_earlier_versions_hold(name: str, tmp_path: Path) -> None:
    """What was reduced and walked is found by the digest that its mesh had when it was written."""
    _, metadata = load_artefact(data_file(name), "Mesh", 1, 2)
    mesh = Mesh.load(data_file(name))
    assert mesh.digest() == metadata["digest"]
    assert Mesh.load(mesh.save(tmp_path / name)).digest() == metadata["digest"]


def test_what_a_leg_is_made_of_is_described_as_it_was() -> None:
    materials = LegMaterials()
    described = [
        PartModel(paper_leg_mesh(), materials.silicone, 0.105, (each,), cavity="cavity")
        for each in (Membrane("sheet", Material(9.0, 0.4)), Membrane("paper", Material(9.0, 0.4)))
    ]
    assert ingredients(described[0]) == ingredients(described[1])
    assert ingredients(described[0])["membranes"][0]["surface"] == "paper"
    assert materials_text(described[0]) == [
        repr(materials.silicone),
        "(Membrane(surface='paper', material=" + repr(Material(9.0, 0.4)) + ", thickness_mm=1.0),)",
    ]
