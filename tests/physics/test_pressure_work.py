"""What a pressure does on a cavity's volume is stored as elastic energy, at finite strain."""

import numpy as np
import pytest
from helpers.element_cases import box_part

from pneumorph.fem.static import StaticSettings, static_equilibrium


@pytest.mark.parametrize(
    ("law", "order", "highest"),
    [
        ("corotational", "linear", 45.0),
        ("st_venant_kirchhoff", "linear", 45.0),
        ("stable_neo_hookean", "quadratic", 22.0),
        ("isochoric_neo_hookean", "linear", 45.0),
    ],
)
def test_energy_is_the_work_of_the_pressure(law, order, highest):
    """psi(P) = int p dV = P V(P) - int_0^P V dp, over equilibria at Gauss's points of pressure."""
    part = box_part(law, order, young=100.0, hollow=True)
    abscissae, weights = np.polynomial.legendre.leggauss(5)
    pressures = np.append(0.5 * highest * (1.0 + abscissae), highest)
    x, before, volumes = part.rest_nodes, 0.0, []
    for pressure in pressures:
        result = static_equilibrium(
            part,
            pressure,
            part.mesh.node_set("left"),
            start=x,
            start_pressure_kPa=before,
            rotation="polar",
            settings=StaticSettings(tolerance=1e-10),
        )
        assert result.converged
        x, before = result.positions, pressure
        volumes.append(part.cavity_volume(x))
    swelling = volumes[-1] / part.cavity_volume(part.rest_nodes)
    assert swelling > 1.2
    work = highest * volumes[-1] - 0.5 * highest * weights @ volumes[:-1]
    # Five points integrate a polynomial of degree 9; V(p) is analytic with its limit of pressure
    # well above P: some 1e-8 of P V, of which the energy is a tenth.
    assert part.elastic_energy(x) == pytest.approx(work, rel=1e-6)
