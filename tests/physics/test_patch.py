"""Patch tests: a mesh of unequal elements reproduces an even strain exactly."""

import numpy as np
import pytest
from helpers.element_cases import ORDERS, irregular_box
from helpers.law_cases import SHEET_LAWS, SOLIDS, case_material
from helpers.surface_load import traction_load

from pneumorph.fem.cavity import Cavity
from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import static_equilibrium

AFFINE = np.array([[1.15, 0.10, 0.02], [-0.05, 1.08, 0.12], [0.06, -0.08, 0.95]])
SHIFT = np.array([0.3, -0.2, 1.0])


def assert_patch(part: PartModel, noise: np.ndarray) -> None:
    """Nodes outside are moved affinely; those inside, started elsewhere, must follow."""
    expected = part.rest_nodes @ AFFINE.T + SHIFT
    outside = part.mesh.node_set("outside")
    start = expected + noise
    start[outside] = expected[outside]
    assert np.abs(start - expected).max() > 0.02
    result = static_equilibrium(part, 0.0, outside, start=start, rotation="polar")
    assert result.converged
    # The residual of 1e-8 mN over a stiffness of at least 1 mN/mm.
    np.testing.assert_allclose(result.positions, expected, atol=1e-8)
    for group in part.element_groups:
        stress = group.law.stress(group.deformation_gradients(result.positions))
        # In each element's own frame the stress differs; its size and its work do not.
        size = np.sum(stress**2, axis=(0, 1))
        np.testing.assert_allclose(size, size[0], rtol=1e-7)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", SOLIDS)
def test_solid(law, order):
    part = PartModel(irregular_box(order), case_material(law), 0.1)
    noise = np.random.default_rng(1).uniform(-0.05, 0.05, part.rest_nodes.shape)
    assert_patch(part, noise)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", SHEET_LAWS)
def test_sheet(law, order):
    """A stiff sheet in the middle of a solid a thousand times softer."""
    sheet = Membrane("middle", Material(1000.0, 0.4, law), 1.0)
    part = PartModel(irregular_box(order), Material(1.0, 0.0), 0.1, (sheet,))
    noise = np.random.default_rng(1).uniform(-0.05, 0.05, part.rest_nodes.shape)
    assert_patch(part, noise)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", SOLIDS)
def test_even_pressure_all_round_makes_an_even_stress(law, order):
    """At F = s I the surface load p dV/dx with p = -P(s) / s^2 balances every node exactly."""
    mesh, stretch, material = irregular_box(order), 0.9, case_material(law)
    part = PartModel(mesh, material, 0.1)
    x = stretch * mesh.nodes
    pressure = -make_law(material, 3).stress(stretch * np.eye(3)[:, :, None])[0, 0, 0] / stretch**2
    load = -pressure * Cavity.of_surface(mesh.surface_connectivity("skin")).gradient(x)
    assert pressure > 10.0
    assert np.abs(load).max() > 1.0
    # Rounding of forces of 10 to 100 mN.
    np.testing.assert_allclose(part.internal_force(x, "polar"), -load, atol=1e-11)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", ["corotational", "stable_neo_hookean"])
def test_even_traction_makes_an_even_stress(law, order):
    """Uniaxial tension: consistent loads on the two ends balance every node, sides are free."""
    mesh, material = irregular_box(order), Material(100.0, 0.3, law)
    part = PartModel(mesh, material, 0.1)
    strain = 0.2
    if law == "corotational":
        across, pull = 1.0 - 0.3 * strain, 100.0 * strain
    else:  # s t^2 = 1 + mu / lambda' (1 - 1 / s), lambda' = mu / (1 - 2 nu)
        across = np.sqrt((1.0 + 0.4 * (1.0 - 1.0 / 1.2)) / 1.2)
        pull = 100.0 / 2.6 * (1.2 - across**2 / 1.2)
    x = mesh.nodes * [1.0 + strain, across, across]
    skin = mesh.surface_connectivity("skin")
    load = np.zeros_like(x)
    for place, direction in ((0.0, -1.0), (4.0, 1.0)):
        end = skin[np.all(np.abs(mesh.nodes[skin[:, :3], 0] - place) < 1e-9, axis=1)]
        load += traction_load(mesh.nodes, end, np.array([direction * pull, 0.0, 0.0]))
    assert load[:, 0].max() > 1.0
    # The integration rule's constants have 15 digits.
    np.testing.assert_allclose(part.internal_force(x, "polar"), -load, atol=1e-11)
