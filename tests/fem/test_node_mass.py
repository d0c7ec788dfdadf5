"""Sharing a part's mass among its nodes."""

import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.node_mass import node_mass
from pneumorph.geometry.quadratic import quadratic_mesh


def graded_box(quadratic: bool):
    """A box whose cells grow along x, so that evenly shared mass would be wrong."""
    mesh = box_mesh((8.0, 2.0, 2.0), (4, 2, 2))
    nodes = mesh.nodes.copy()
    nodes[:, 0] = nodes[:, 0] ** 2 / 8.0
    mesh = dataclasses.replace(mesh, nodes=nodes)
    return quadratic_mesh(mesh) if quadratic else mesh


@pytest.mark.parametrize("quadratic", [False, True])
def test_mass_by_volume_is_positive_and_has_the_solids_centre(quadratic):
    """Shape functions of order one at least: sums of m and m x are the solid's, to rounding."""
    mesh = graded_box(quadratic)
    mass = node_mass(mesh, 0.3, "volume")
    assert mass.min() > 0.0
    assert mass.sum() == pytest.approx(0.3, rel=1e-14)
    np.testing.assert_allclose(mass @ mesh.nodes / 0.3, [4.0, 1.0, 1.0], rtol=1e-14)
    even = node_mass(mesh, 0.3, "even")
    assert np.ptp(even) == 0.0
    assert even.sum() == pytest.approx(0.3, rel=1e-14)
    assert (even @ mesh.nodes / 0.3)[0] < 3.6  # what the lumping is for


@pytest.mark.parametrize(("quadratic", "share"), [(False, 1.0 / 5.0), (True, 7.0 / 135.0)])
def test_moment_of_inertia_is_too_large_by_what_lumping_costs(quadratic, share):
    """With S = sum of (x - mean)^2 over a tetrahedron's corners, its mean of (x - mean)^2 is S/20.

    Lumped it is S/4 with linear shape functions, and S/36 + 2S/27 with quadratic ones. S along an
    axis is 3/4, 1 and 3/4 h^2 for two each of the six tetrahedra of a cube of side h.
    """
    for cells in (2, 4):
        mesh = box_mesh((4.0, 4.0, 4.0), (cells,) * 3)
        mesh = quadratic_mesh(mesh) if quadratic else mesh
        moments = node_mass(mesh, 1.0, "volume") @ mesh.nodes**2
        expected = 16.0 / 3.0 + share * 5.0 / 6.0 * (4.0 / cells) ** 2
        np.testing.assert_allclose(moments, expected, rtol=1e-13)


def test_other_lumping_is_refused():
    with pytest.raises(ValueError, match='mass_lumping must be "even" or "volume", got'):
        node_mass(box_mesh(), 1.0, "consistent")
