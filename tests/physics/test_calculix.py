"""Static equilibria against CalculiX, an independent finite-element code; reproduce/calculix.

Both codes have the same elements; only the pressure on curved 6-node faces is integrated otherwise
(three points there, exactly here), and sheets are very thin, shear-soft shells there. The leg that
ships: tests/catalogue/test_leg_in_calculix.py.
"""

from __future__ import annotations

import numpy as np
import pytest
from bend_comparison import YEOH_RATIOS
from calculix_deck import calculix_deck
from calculix_laws import CalculixCorotational, CalculixNeoHooke
from calculix_run import calculix_command, read_displacements, run_calculix
from helpers.box_mesh import box_mesh

from pneumorph.fem.corotational import Corotational
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import static_equilibrium
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.quadratic import quadratic_mesh

needs_calculix = pytest.mark.skipif(
    calculix_command() is None, reason="CalculiX is not installed (apt install calculix-ccx)"
)
MATERIAL = Material(1000.0, 0.3)
SHEET = Membrane("bottom", Material(2000.0, 0.4, "st_venant_kirchhoff"), 0.5)


@needs_calculix
@pytest.mark.parametrize(
    ("order", "tolerance"),
    [
        # The sheet's replacement. Measured: 1.0e-4.
        (4, 3e-4),
        # The pressure on curved faces: without the sheet the difference is the same, and a tenth
        # of it at a tenth of the pressure. Measured: 5.4e-4.
        (10, 2e-3),
    ],
)
@pytest.mark.parametrize(
    "law",
    [
        "st_venant_kirchhoff",
        "calculix_neo_hooke",
        "stable_neo_hookean",
        "yeoh",
        "calculix_corotational",
    ],
)
def test_inflated_box_moves_as_in_calculix(order, tolerance, law):
    """A box with a cavity, a sheet below, held at its left end: the displacement of every node."""
    mesh = box_mesh(cells=(5, 4, 3), hollow=True)
    if order == 10:
        mesh = quadratic_mesh(mesh)
    ratios = YEOH_RATIOS if law == "yeoh" else (0.0, 0.0)
    material = Material(MATERIAL.young_modulus_kPa, MATERIAL.poisson_ratio, law, *ratios)
    deck = calculix_deck(mesh, material, [60.0], held="left", membranes=(SHEET,))
    result = run_calculix(deck, len(mesh.nodes), time_limit_s=120.0)
    assert result.message == ""
    (theirs,) = result.displacements
    part = PartModel(mesh, material, 0.1, (SHEET,), "cavity")
    found = static_equilibrium(part, 60.0, mesh.node_set("left"), rotation="edge")
    assert found.converged
    ours = found.positions - mesh.nodes
    assert np.abs(theirs).max() > 0.15
    assert np.abs(ours - theirs).max() < tolerance * np.abs(theirs).max()


@needs_calculix
def test_silicone_at_finite_strain_moves_as_in_calculix():
    """Dragon Skin 30 in Yeoh's law, a hollow box swollen by a quarter of its height."""
    mesh = quadratic_mesh(box_mesh(cells=(5, 4, 3), hollow=True))
    material = yeoh_material(86.6, 13.8, -1.47, bulk_over_shear=5.0, dilatation="pointwise")
    deck = calculix_deck(mesh, material, [40.0, 80.0], held="left")
    result = run_calculix(deck, len(mesh.nodes), time_limit_s=120.0)
    assert result.message == ""
    part = PartModel(mesh, material, 0.1, (), "cavity")
    found = static_equilibrium(part, 80.0, mesh.node_set("left"), rotation="polar")
    assert found.converged
    gradient = part.element_groups[0].deformation_gradients(found.positions)
    # I1 of a bar pulled to 1.6 times its length.
    assert np.sum(gradient**2, axis=(0, 1)).max() > 3.8
    ours, theirs = found.positions - mesh.nodes, result.displacements[-1]
    assert np.abs(theirs).max() > 0.9
    # The pressure on curved faces, as above but more curved. Measured: 1.3e-3.
    assert np.abs(ours - theirs).max() < 4e-3 * np.abs(theirs).max()


def strained_gradients(size: float) -> np.ndarray:
    """Turned and strained F, (3, 3, point)."""
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    strain = np.eye(3)[:, :, None] + size * rng.uniform(-1.0, 1.0, (3, 3, 5))
    return np.einsum("ij,jkp->ikp", turn, strain)


def test_stress_of_neo_hooke_is_the_derivative_of_its_energy():
    law, gradient, step = CalculixNeoHooke(MATERIAL, 3), strained_gradients(0.2), 1e-6
    stress = law.stress(gradient)
    for axis in range(3):
        for column in range(3):
            change = np.zeros_like(gradient)
            change[axis, column] = step
            rise = law.energy(gradient + change) - law.energy(gradient - change)
            # Central differences: rounding of 1e-16 times an energy of 1e2 over the step.
            np.testing.assert_allclose(rise / (2.0 * step), stress[axis, column], atol=1e-6)


def test_corotational_laws_differ_in_the_second_order_of_the_strain():
    theirs, ours = CalculixCorotational(MATERIAL, 3), Corotational(MATERIAL, 3)
    apart = [
        np.abs(theirs.stress(gradient) - ours.stress(gradient)).max()
        for gradient in (strained_gradients(1e-3), strained_gradients(1e-4))
    ]
    # A tenth of the strain, a hundredth of the difference, up to its third order.
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.01)


def test_laws_that_calculix_lacks_are_refused():
    mesh = box_mesh(cells=(4, 3, 3), hollow=True)
    with pytest.raises(ValueError, match="nearest to corotational is calculix_corotational"):
        calculix_deck(mesh, MATERIAL, [1.0], held="left")
    solid = Material(1000.0, 0.3, "st_venant_kirchhoff")
    sheet = Membrane("bottom", Material(1000.0, 0.3, "stable_neo_hookean"))
    with pytest.raises(ValueError, match="law of a sheet must be st_venant_kirchhoff"):
        calculix_deck(mesh, solid, [1.0], held="left", membranes=(sheet,))
    with pytest.raises(ValueError, match="is a law of solids"):
        CalculixNeoHooke(solid, 2)


def test_printed_displacements_are_read_and_checked():
    heading = " displacements (vx,vy,vz) for set ALL and time  0.1000000E+01\n\n"
    whole = heading + "  1  1.0E-01 -2.0E+00  3.0E+00\n  2  0.0E+00  0.0E+00  5.0E-01\n\n"
    (first, second) = read_displacements(whole * 2, node_count=2)
    np.testing.assert_array_equal(first, [[0.1, -2.0, 3.0], [0.0, 0.0, 0.5]])
    np.testing.assert_array_equal(first, second)
    # A run that was ended while it printed.
    assert len(read_displacements(whole + whole[:-30], node_count=2)) == 1
    with pytest.raises(ValueError, match=r"step 1 must print nodes 1 \.\. 1,"):
        read_displacements(whole, node_count=1)
