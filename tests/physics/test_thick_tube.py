"""A thick-walled tube under inner pressure: Lame's solution in plane strain."""

import numpy as np
import pytest
from helpers.linear_solution import linear_solution, relative_error
from helpers.round_mesh import round_sector, symmetry_unknowns
from helpers.surface_load import pressure_load

from pneumorph.fem.cavity import Cavity
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh

INNER, OUTER, PRESSURE, YOUNG = 1.0, 2.0, 10.0, 1000.0


def lame(nodes: np.ndarray, poisson: float) -> np.ndarray:
    """u_r = (1 + nu) / E p a^2 / (b^2 - a^2) ((1 - 2 nu) r + b^2 / r); u_z = 0."""
    radius = np.linalg.norm(nodes[:, :2], axis=1)
    factor = (1.0 + poisson) / YOUNG * PRESSURE * INNER**2 / (OUTER**2 - INNER**2)
    radial = factor * ((1.0 - 2.0 * poisson) * radius + OUTER**2 / radius)
    return nodes * [1.0, 1.0, 0.0] * (radial / radius)[:, None]


def quarter_tube(cells: int, quadratic: bool) -> Mesh:
    """One layer of cubes along the axis: nothing depends on z, and needles would err there."""
    return round_sector(cells, 2, quadratic, (OUTER, OUTER, OUTER / cells))


def displaced(cells: int, quadratic: bool, material: Material) -> tuple[PartModel, np.ndarray]:
    """The tube, and its displacements under the pressure."""
    mesh = quarter_tube(cells, quadratic)
    part = PartModel(mesh, material, 0.1)
    end = np.flatnonzero(mesh.nodes[:, 2] > OUTER / cells - 1e-9)
    fixed = np.union1d(symmetry_unknowns(mesh), 3 * end + 2)
    load = pressure_load(mesh.nodes, mesh.surface_connectivity("inner"), PRESSURE)
    return part, linear_solution(part, fixed, np.zeros_like(mesh.nodes), load)[0]


def error_of(cells: int, quadratic: bool, poisson: float) -> float:
    part, found = displaced(cells, quadratic, Material(YOUNG, poisson))
    return relative_error(found, lame(part.rest_nodes, poisson))


@pytest.mark.parametrize(("quadratic", "order"), [(False, 2), (True, 3)])
def test_displacement_converges(quadratic, order):
    """h^(p+1) in the mean square (Ciarlet 1978); midside nodes lie on the circles, so the shape
    of quadratic elements errs by no lower order."""
    errors = [error_of(cells, quadratic, 0.3) for cells in (8, 16)]
    # The next order, about h of the first, is still felt: 1.90, 3.16 (measured).
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


def test_linear_tetrahedra_lock_where_volume_is_kept_and_quadratic_do_not():
    """nu = 0.49: a bulk modulus of 50 times the shear modulus asks every element to keep its
    volume. Linear tetrahedra, of which there are more than unknowns, then hardly move: four through
    the wall miss a quarter of the displacement; two quadratic ones 1.4 % (measured).
    """
    linear, quadratic = error_of(8, False, 0.49), error_of(4, True, 0.49)
    assert linear > 0.2
    assert quadratic < 0.02


@pytest.mark.parametrize("quadratic", [False, True])
def test_volume_gradient_of_the_bore_is_the_load(quadratic):
    """At nodes inside the open bore, p dV/dx is the integral of the pressure as well."""
    mesh = quarter_tube(4, quadratic)
    triangles = mesh.surface_connectivity("inner")
    within = np.all((mesh.nodes > 1e-9) & (mesh.nodes[:, 2:] < OUTER / 4 - 1e-9), axis=1)
    load = pressure_load(mesh.nodes, triangles, 3.0)
    np.testing.assert_allclose(
        3.0 * Cavity.of_surface(triangles).gradient(mesh.nodes)[within], load[within], atol=1e-13
    )


def test_pressure_of_nearly_incompressible_elements_is_even():
    """In plane strain without change of volume the mean stress is the same everywhere,
    -p a^2 / (b^2 - a^2): elements must agree, and not alternate about it."""
    poisson = 0.4999
    material = Material(YOUNG, poisson, "yeoh", dilatation="mean")
    part, found = displaced(8, True, material)
    assert relative_error(found, lame(part.rest_nodes, poisson)) < 2e-3  # measured 6e-4
    step = 1e-5
    group, rest = part.volume_group, part.rest_nodes
    pressure = (group.pressures(rest + step * found) - group.pressures(rest)) / step
    exact = -PRESSURE * INNER**2 / (OUTER**2 - INNER**2)
    # lambda over the bulk modulus is 1 - 2e-4; the rest is the error of the shape.
    assert group.rest_volume @ pressure / group.rest_volume.sum() == pytest.approx(exact, rel=1e-3)
    # First order in the size, as constant pressures are: 2.0 % of the load (measured).
    scatter = np.sqrt(group.rest_volume @ (pressure - exact) ** 2 / group.rest_volume.sum())
    assert scatter < 0.03 * PRESSURE
