"""A small leg of one's own: a hollow box with a sheet under it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from box_mesh import box_mesh

from pneumorph.geometry.mesh import Mesh


@pytest.fixture(scope="session")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    box = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    leg = Mesh(
        box.nodes - np.array([20.0, 6.0, 0.0]),
        box.tetrahedra,
        {**box.surfaces, "paper": box.surfaces["bottom"]},
        {"attachment": box.node_sets["left"], "outer_end_face": box.node_sets["right"]},
        contact_points=np.array([[20.0, -6.0, 0.0], [20.0, 6.0, 0.0]]),
    )
    return leg.save(tmp_path_factory.mktemp("mesh") / "mesh.npz")
