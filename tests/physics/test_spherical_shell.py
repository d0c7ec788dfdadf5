"""A thick rubber balloon: finite inflation of a spherical shell of neo-Hookean and Yeoh's rubber.

An octant with its three planes of symmetry, quadratic tetrahedra. The reference is the radial
equation of equilibrium, dP_r/dR + 2 (P_r - P_t) / R = 0, solved as a boundary value problem.
"""

import numpy as np
import pytest
from helpers.law_cases import points
from helpers.round_mesh import round_sector, symmetry_unknowns
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq
from scipy.sparse.linalg import splu

from pneumorph.fem.assembly import Assembly
from pneumorph.fem.cavity import Cavity
from pneumorph.fem.law import Law
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.yeoh import Yeoh
from pneumorph.fem.yeoh_constants import yeoh_material

INNER, OUTER, YOUNG = 1.0, 2.0, 100.0


def incompressible_pressure(inner_stretch: float, mu: float) -> float:
    """p = int W' / (s^3 - 1) ds from the outer hoop stretch s_b to the inner, W' = 2 mu (s - s^-5).

    That is 2 mu [-1/s - 1/(4 s^4)]; volume kept gives b^3 - B^3 = a^3 - A^3 (Ogden, Non-linear
    Elastic Deformations, section 5.3).
    """
    outer_stretch = (1.0 + (inner_stretch**3 - 1.0) * (INNER / OUTER) ** 3) ** (1.0 / 3.0)

    def primitive(stretch: float) -> float:
        return -1.0 / stretch - 0.25 / stretch**4

    return 2.0 * mu * (primitive(inner_stretch) - primitive(outer_stretch))


def inner_radius(pressure: float, material: Material) -> float:
    """Radius of the inflated stable neo-Hookean shell, by the radial equation [mm].

    With the hoop stretch t = r / R, P_r = mu s + (lambda' (s t^2 - 1) - mu) t^2 gives the radial
    stretch s, and P_t = mu t + (lambda' (s t^2 - 1) - mu) s t.
    """
    mu, bulk = material.lame_mu, material.lame_lambda + material.lame_mu

    def rates(place, state):
        radius, radial_stress = state
        hoop = radius / place
        stretch = (radial_stress + (bulk + mu) * hoop**2) / (mu + bulk * hoop**4)
        hoop_stress = mu * hoop + (bulk * (stretch * hoop**2 - 1.0) - mu) * stretch * hoop
        return np.stack([stretch, -2.0 * (radial_stress - hoop_stress) / place])

    def boundary(inner, outer):
        return np.array([inner[1] + pressure * (inner[0] / INNER) ** 2, outer[1]])

    place = np.linspace(INNER, OUTER, 40)
    guess = np.stack([np.cbrt(place**3 + 1.0), np.linspace(-pressure, 0.0, 40)])
    solution = solve_bvp(rates, boundary, place, guess, tol=1e-8, max_nodes=20000)
    assert solution.success
    return float(solution.y[0, 0])


def shell_pressure(law: Law, inner_stretch: float) -> float:
    """Pressure that inflates a shell of any law to a hoop stretch of its bore, by shooting.

    From the bore outward dr/dR = s and dP_r/dR = -2 (P_r - P_t) / R, s(P_r, r / R) by the law; the
    radial stress at the bore is sought that leaves none outside.
    """

    def stress(radial: float, hoop: float) -> np.ndarray:
        return law.stress(points(np.diag([radial, hoop, hoop])))[:, :, 0]

    def rates(place: float, state: np.ndarray) -> list[float]:
        hoop, radial_stress = state[0] / place, state[1]
        kept = hoop**-2
        radial = brentq(
            lambda s: stress(s, hoop)[0, 0] - radial_stress, 0.9 * kept, 1.1 * kept, xtol=1e-14
        )
        return [radial, -2.0 * (radial_stress - stress(radial, hoop)[1, 1]) / place]

    def outside(radial_stress: float) -> float:
        start = [INNER * inner_stretch, radial_stress]
        return solve_ivp(rates, (INNER, OUTER), start, rtol=1e-9, atol=1e-9).y[1, -1]

    found = brentq(outside, -1000.0, 0.0, xtol=1e-9)
    return -found / inner_stretch**2


def inflated(
    part: PartModel, bore: Cavity, pressure: float, shares: tuple[float, ...] = (0.4, 0.75, 1.0)
) -> np.ndarray:
    """Newton's method in load steps on the unknowns that symmetry leaves free."""
    fixed = symmetry_unknowns(part.mesh)
    free = np.setdiff1d(np.arange(3 * part.node_count), fixed)
    follower = Assembly(part.node_count, [bore.triangles])
    rows, columns = np.triu_indices(9)
    x = part.rest_nodes.copy()
    for load in pressure * np.array(shares):
        for _ in range(12):
            residual = (part.internal_force(x, "polar") + load * bore.gradient(x)).ravel()[free]
            if np.linalg.norm(residual) < 1e-9 * pressure:
                break
            blocks = bore.hessian_blocks(x)[:, rows, columns].T
            geometric = follower.matrix(follower.symmetric_data([blocks]))
            tangent = part.tangent(x, rotation="polar") - load * geometric
            x.ravel()[free] += splu(tangent.tocsc()[free][:, free].tocsc()).solve(residual)
        else:
            pytest.fail(f"no equilibrium at {load} kPa")
    return x


def test_reference_becomes_the_incompressible_closed_form():
    """The radius at the pressure of a hoop stretch of 1.5 tends to 1.5 in proportion to mu / K."""
    errors = []
    for poisson in (0.49, 0.499):
        material = Material(YOUNG, poisson)
        pressure = incompressible_pressure(1.5, material.lame_mu)
        errors.append(inner_radius(pressure, material) - 1.5)
    # Dilatation is p / K at most, 2 %, and swells the hole by a like share of the wall.
    assert 0.0 < errors[0] < 0.05
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


def test_inflated_shell():
    material = Material(YOUNG, 0.49, "stable_neo_hookean")
    pressure = incompressible_pressure(1.5, material.lame_mu)
    exact = inner_radius(pressure, material)
    errors = []
    for cells in (2, 4):
        mesh = round_sector(cells, 3, quadratic=True)
        part = PartModel(mesh, material, 0.1)
        bore = Cavity.of_surface(mesh.surface_connectivity("inner"))
        x = inflated(part, bore, pressure)
        on_bore = np.unique(mesh.surface_connectivity("inner"))
        radius = np.linalg.norm(x[on_bore], axis=1)
        errors.append(abs(radius.mean() - exact) / (exact - INNER))
    # Order 3 (h^(p+1)) is reached from below where rubber is nearly incompressible: one element
    # through the wall errs by 6 %, two by 1.1 %, three by 0.4 % (measured), so 2.5 and 2.75.
    assert errors[1] < 0.02
    assert np.log2(errors[0] / errors[1]) > 2.0


def test_shooting_finds_the_closed_form_of_incompressible_rubber():
    """C2 = C3 = 0 is neo-Hookean: the pressure tends to the closed form in proportion to mu / K."""
    c1 = 20.0
    exact = incompressible_pressure(1.5, 2.0 * c1)
    errors = [
        shell_pressure(Yeoh(yeoh_material(c1, bulk_over_shear=ratio), 3), 1.5) / exact - 1.0
        for ratio in (1e3, 1e4)
    ]
    assert abs(errors[0]) < 5e-3
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def test_inflated_shell_of_nearly_incompressible_silicone():
    """Yeoh's Dragon Skin 30 at K / mu = 200, one and two elements through the wall."""
    material, stretch = yeoh_material(86.6, 13.8, -1.47, bulk_over_shear=200.0), 1.5
    pressure = shell_pressure(Yeoh(material, 3), stretch)
    errors = []
    for cells in (2, 4):
        mesh = round_sector(cells, 3, quadratic=True)
        part = PartModel(mesh, material, 0.1)
        triangles = mesh.surface_connectivity("inner")
        x = inflated(part, Cavity.of_surface(triangles), pressure, tuple(np.linspace(0.1, 1.0, 10)))
        radius = np.linalg.norm(x[np.unique(triangles)], axis=1).mean()
        errors.append((radius - INNER * stretch) / (INNER * (stretch - 1.0)))
    # Where four points hold the volume, one element misses 6 to 7 % (above, and at this K).
    assert np.abs(errors).max() < 0.01, errors
