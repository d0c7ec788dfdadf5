"""Meshes that several tests share."""

import pytest

from pneumorph.geometry.mesh import Mesh


@pytest.fixture(scope="session")
def leg_mesh() -> Mesh:
    pytest.importorskip("netgen")
    from pneumorph.geometry.pneunet import mesh_pneunet

    return mesh_pneunet()
