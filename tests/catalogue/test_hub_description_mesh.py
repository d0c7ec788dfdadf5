"""A hub's mesh is checked before its mass is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.simple_solids import box_solid

BOX = box_solid(60.0, 40.0, 10.0, 0.0)
HUB = HubDescription("mesh", mesh=Path("hub.npz"), density_g_per_ml=1.2, contact="spread")


def test_a_hubs_mesh_that_is_whole_is_taken(tmp_path: Path) -> None:
    Mesh(BOX.nodes, BOX.tetrahedra).save(tmp_path / "hub.npz")
    assert HUB.spec(tmp_path).mass_kg == pytest.approx(60.0 * 40.0 * 10.0 * 1.2e-6)


@pytest.mark.parametrize("wall_mm", [1.0, 2.0, 4.0])
def test_a_hollow_box_weighs_the_same_as_a_mesh(wall_mm: float, tmp_path: Path) -> None:
    Mesh(BOX.nodes, BOX.tetrahedra).save(tmp_path / "hub.npz")
    as_box = HubDescription(
        "box", 60.0, 40.0, height_mm=10.0, bottom_mm=0.0, density_g_per_ml=1.2, wall_mm=wall_mm
    )
    found = replace(HUB, wall_mm=wall_mm).spec(tmp_path)
    expected = as_box.spec(tmp_path)
    np.testing.assert_allclose(found.mass_numbers(), expected.mass_numbers(), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("elements", "told"),
    [
        (np.concatenate([BOX.tetrahedra[:1, [1, 0, 2, 3]], BOX.tetrahedra[1:]]), "are inverted"),
        (np.concatenate([BOX.tetrahedra, BOX.tetrahedra[:5]]), "elements are doubled"),
    ],
)
def test_a_hub_of_inverted_or_doubled_elements_is_refused(
    elements: np.ndarray, told: str, tmp_path: Path
) -> None:
    """It would weigh less, or more, than it does."""
    Mesh(BOX.nodes, elements).save(tmp_path / "hub.npz")
    with pytest.raises(ArtefactError, match=rf"mesh of \[hub\]: .*hub\.npz: .*{told}"):
        HUB.spec(tmp_path)
