"""The cubic volume polynomial against the volume of the moved surface."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part

from pneumorph.fem.cavity import Cavity
from pneumorph.reduction.cavity_polynomial import cavity_polynomial

PART = synthetic_part()
REDUCED = synthetic_reduced_part(6)
POLYNOMIAL = REDUCED.cavity(0)


def surface_volume(x: np.ndarray) -> float:
    a, b, c = (x[PART.mesh.surfaces["cavity"][:, corner]] for corner in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def test_rest_volume_is_the_box():
    # The hollow is 6 of 8 by 2 of 4 by 2 of 4 cubes of a 112 x 24 x 16 mm box.
    assert POLYNOMIAL.constant == pytest.approx(84.0 * 12.0 * 8.0, rel=1e-12)


def test_polynomial_is_exact_for_large_displacements():
    rng = np.random.default_rng(1)
    for _ in range(3):
        alpha = rng.normal(size=6)
        x = REDUCED.positions(alpha)
        assert np.abs(x - REDUCED.rest_nodes).max() > 5.0
        # Both sides are the same cubic; only rounding differs.
        assert POLYNOMIAL.volume(alpha) == pytest.approx(surface_volume(x), rel=1e-11)


def test_gradient_and_hessian_are_derivatives():
    # Central differences of a cubic are exact up to third derivative * step^2 / 6.
    alpha = np.random.default_rng(2).normal(size=6)
    step = 1e-4
    for mode, unit in enumerate(step * np.eye(6)):
        slope = (POLYNOMIAL.volume(alpha + unit) - POLYNOMIAL.volume(alpha - unit)) / (2 * step)
        assert POLYNOMIAL.gradient(alpha)[mode] == pytest.approx(slope, rel=1e-6, abs=1e-3)
        bend = (POLYNOMIAL.gradient(alpha + unit) - POLYNOMIAL.gradient(alpha - unit)) / (2 * step)
        assert np.allclose(POLYNOMIAL.hessian(alpha)[mode], bend, rtol=1e-6, atol=1e-4)


def test_polynomial_is_exact_under_quadratic_triangles_too():
    part, reduced = synthetic_part(quadratic=True), synthetic_reduced_part(4, quadratic=True)
    alpha = np.random.default_rng(1).normal(size=4)
    x = reduced.positions(alpha)
    assert np.abs(x - reduced.rest_nodes).max() > 5.0
    # Both sides are the same cubic; only rounding differs.
    assert reduced.cavity(0).volume(alpha) == pytest.approx(part.cavity_volume(x), rel=1e-11)
    force = np.einsum("ni,nia->a", part.pressure_force(x, 1.0), reduced.modes)
    assert np.allclose(reduced.cavity(0).gradient(alpha), force, rtol=1e-10)


def test_open_or_inverted_surfaces_are_refused():
    triangles = PART.mesh.surfaces["cavity"]
    with pytest.raises(ValueError, match="must be closed"):
        cavity_polynomial(PART.mesh.nodes, Cavity.of_surface(triangles[1:]), REDUCED.modes)
    with pytest.raises(ValueError, match="must be positive"):
        cavity_polynomial(PART.mesh.nodes, Cavity.of_surface(triangles[:, ::-1]), REDUCED.modes)
