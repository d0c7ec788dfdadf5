"""Small legs that the verbs' tests share: one to reduce, and one reduced."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.geometry.mesh import Mesh


@pytest.fixture(scope="session")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg of one's own to reduce: a hollow box with a sheet under it."""
    box = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    leg = Mesh(
        box.nodes - np.array([20.0, 6.0, 0.0]),
        box.tetrahedra,
        {**box.surfaces, "sheet": box.surfaces["bottom"]},
        {"attachment": box.node_sets["left"], "outer_end_face": box.node_sets["right"]},
        contact_points=np.array([[20.0, -6.0, 0.0], [20.0, 6.0, 0.0]]),
    )
    return leg.save(tmp_path_factory.mktemp("mesh") / "mesh.npz")


@pytest.fixture(scope="session")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reduced leg of 4 modes."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    return part.save(tmp_path_factory.mktemp("leg") / "leg.npz")
