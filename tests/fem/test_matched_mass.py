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


def moments(height: float, cells: int, spread: tuple[float, float, float]) -> MassProperties:
    """What the matched masses of a box are together.

    Args:
        height: The box's [mm].
        cells: Its layers.
        spread: Of the body of 0.1 kg in its middle that is asked for, along each axis [mm].
    """
    mesh = box_mesh((100.0, 60.0, height), (4, 3, cells))
    middle = np.array([50.0, 30.0, 0.5 * height])
    squares = 0.1 * np.array(spread) ** 2
    body = MassProperties(0.1, middle, np.diag(squares.sum() - squares))
    mass = matched_node_mass(mesh, body)
    return MassProperties.of_moments(
        float(mass.sum()), mass @ mesh.nodes, mesh.nodes.T @ (mass[:, None] * mesh.nodes)
    )


def test_an_inertia_that_the_heights_of_the_nodes_do_not_allow_is_refused() -> None:
    """Masses between the bottom and the top of 45 mm spread by 22.5 mm at most."""
    np.testing.assert_allclose(
        np.diag(moments(45.0, 3, (25.0, 15.0, 16.0)).inertia), [48.1, 88.1, 85.0], rtol=1e-9
    )
    with pytest.raises(ValueError, match="no positive masses on the mesh's 80 nodes"):
        moments(45.0, 3, (25.0, 15.0, 24.0))


def test_a_mesh_of_two_levels_keeps_its_spread_in_height() -> None:
    """Half of the mass on each: 7.5 mm about the middle whatever is asked for."""
    found = moments(15.0, 1, (25.0, 15.0, 16.0))
    np.testing.assert_allclose(found.centre_mm, [50.0, 30.0, 7.5], rtol=1e-9)
    expected = 0.1 * np.array([15.0**2 + 7.5**2, 25.0**2 + 7.5**2, 25.0**2 + 15.0**2])
    np.testing.assert_allclose(np.diag(found.inertia), expected, rtol=1e-9)
