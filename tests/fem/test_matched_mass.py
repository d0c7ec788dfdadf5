"""Node masses of a mesh that are another body's."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.matched_mass import matched_node_mass
from pneumorph.geometry.mass_properties import MassProperties


def test_node_masses_match_all_ten_moments_where_the_mesh_allows() -> None:
    """A hollow box on the nodes of a full one, off centre."""
    mesh = box_mesh((10.0, 8.0, 6.0), (4, 4, 4))
    shell = box_mesh((10.0, 8.0, 6.0), (8, 8, 8), hollow=True)
    body = MassProperties.of_tetrahedra(shell.nodes, shell.tetrahedra, 1.0)
    place = np.array([0.2, -0.1, 0.3])
    body = MassProperties(body.mass_kg, body.centre_mm + place, 0.8 * body.inertia)
    mass = matched_node_mass(mesh, body)
    assert mass.min() > 0.0
    found = MassProperties.of_moments(
        float(mass.sum()), mass @ mesh.nodes, mesh.nodes.T @ (mass[:, None] * mesh.nodes)
    )
    np.testing.assert_allclose(found.centre_mm, body.centre_mm, rtol=1e-9)
    np.testing.assert_allclose(found.inertia, body.inertia, atol=1e-9 * np.trace(body.inertia))
    far = MassProperties(1.0, np.array([30.0, 0.0, 0.0]), np.eye(3))
    with pytest.raises(ValueError, match=r"no positive masses .* centre \(30\.0, 0\.0, 0\.0\) mm"):
        matched_node_mass(mesh, far)
