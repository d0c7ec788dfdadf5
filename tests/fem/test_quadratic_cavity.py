"""The volume within quadratic triangles, flat and curved, and its derivatives."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.round_mesh import rounded
from helpers.surface_load import pressure_load

from pneumorph.fem.cavity import Cavity
from pneumorph.geometry.quadratic import quadratic_mesh


@pytest.fixture(scope="module")
def mesh():
    return quadratic_mesh(box_mesh((9.0, 9.0, 9.0), (3, 3, 3), hollow=True))


@pytest.fixture(scope="module")
def triangles(mesh):
    return mesh.surface_connectivity("cavity")


@pytest.fixture(scope="module")
def wobbled(mesh):
    """Curved and crumpled, far from the origin."""
    return mesh.nodes + np.random.default_rng(3).uniform(-0.4, 0.4, mesh.nodes.shape) + [20, 0, -7]


def test_flat_quadratic_triangles_hold_the_linear_volume(mesh, triangles):
    assert Cavity.of_surface(triangles).volume(mesh.nodes) == pytest.approx(27.0, rel=1e-13)


def test_volume_of_a_parabolic_dome_is_exact():
    """A cube whose top's nodes are raised by 0.3 (1 - x^2) with x in [-1, 1]: 8 + 4 (0.3) 2/3."""
    box = quadratic_mesh(box_mesh((2.0, 2.0, 2.0), (2, 2, 2)))
    x = box.nodes - 1.0
    x[:, 2] += np.where(x[:, 2] > 0.99, 0.3 * (1.0 - x[:, 0] ** 2), 0.0)
    volume = Cavity.of_surface(box.surface_connectivity("skin")).volume(x)
    # The triangles of the sides at y = +-1 follow the dome's edge, so the body is closed.
    assert volume == pytest.approx(8.0 + 0.3 * 8.0 / 3.0, rel=1e-13)


@pytest.mark.parametrize(("quadratic", "order"), [(False, 2), (True, 4)])
def test_volume_of_a_sphere_converges(quadratic, order):
    """Flat triangles err by h^2; quadratic ones through midside nodes on the sphere by h^4."""
    errors = []
    for cells in (4, 8):
        box = box_mesh((2.0, 2.0, 2.0), (cells,) * 3, keep=lambda cell: True)
        box = quadratic_mesh(box) if quadratic else box
        cavity = Cavity.of_surface(box.surface_connectivity("skin"))
        errors.append(4.0 * np.pi / 3.0 - cavity.volume(rounded(box.nodes - 1.0, 3)))
    # Within 0.2 of the order on these meshes.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


def test_volume_does_not_depend_on_the_origin(triangles, wobbled):
    cavity = Cavity.of_surface(triangles)
    # Terms of 30^3 cancel to 27: rounding of some 1e-16 x 27000 x 10.
    assert cavity.volume(wobbled) == pytest.approx(cavity.volume(wobbled - 20.0), abs=1e-10)


def test_load_is_the_integral_of_the_pressure(triangles, wobbled):
    """dV/dx_n = int N_n n dA: no consistent load is lost where the volume is put differently."""
    np.testing.assert_allclose(
        Cavity.of_surface(triangles).gradient(wobbled),
        pressure_load(wobbled, triangles, 1.0),
        atol=1e-11,  # rounding of products of 30 x 30; the rule's constants have 15 digits
    )


def test_gradient_is_the_derivative_of_the_volume(triangles, wobbled):
    cavity, step = Cavity.of_surface(triangles), 1e-3
    direction = np.random.default_rng(4).normal(size=wobbled.shape)

    def change(size):
        return cavity.volume(wobbled + size * direction) - cavity.volume(wobbled - size * direction)

    # V is a cubic: two central differences give its first derivative without truncation.
    slope = (8.0 * change(step) - change(2.0 * step)) / (12.0 * step)
    assert slope == pytest.approx(np.sum(cavity.gradient(wobbled) * direction), rel=1e-8)


def test_hessian_is_the_derivative_of_the_gradient(triangles, wobbled):
    cavity = Cavity.of_surface(triangles)
    direction = np.random.default_rng(5).normal(size=wobbled.shape)
    # The gradient is quadratic: central differences are exact.
    change = (cavity.gradient(wobbled + direction) - cavity.gradient(wobbled - direction)) / 2.0
    product = np.zeros_like(wobbled)
    blocks = cavity.hessian_blocks(wobbled)
    moved = direction[cavity.triangles].reshape(-1, 9)
    np.add.at(product, cavity.triangles, np.einsum("tij,tj->ti", blocks, moved).reshape(-1, 3, 3))
    np.testing.assert_allclose(product, change, atol=1e-11)


def test_pressure_has_no_resultant(triangles, wobbled):
    force = Cavity.of_surface(triangles).gradient(wobbled)
    assert np.abs(force).max() > 0.5
    # Rounding of products of coordinates of 30 mm.
    assert np.abs(force.sum(axis=0)).max() < 1e-11
    assert np.abs(np.cross(wobbled, force).sum(axis=0)).max() < 1e-9
