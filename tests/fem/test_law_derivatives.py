"""Of every law: stress is the derivative of energy, tangent that of stress; objectivity; rest."""

import numpy as np
import pytest
from helpers.law_cases import (
    LAWS,
    SHEET_LAWS,
    case_material,
    points,
    product,
    rotations,
    strained,
)

from pneumorph.fem.corotational import Corotational
from pneumorph.fem.law import differentiated_stress
from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.geometry.pose import rotation_about

YOUNG = 100.0


def law_of(name: str, dimension: int, poisson: float = 0.4):
    return make_law(case_material(name, YOUNG, poisson), dimension)


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_stress_is_the_derivative_of_the_energy(name, dimension):
    law, gradient, step = law_of(name, dimension), strained(dimension), 1e-5
    stress = law.stress(gradient)
    for index in np.ndindex(3, dimension):
        ahead, behind = gradient.copy(), gradient.copy()
        ahead[index] += step
        behind[index] -= step
        slope = (law.energy(ahead) - law.energy(behind)) / (2.0 * step)
        # Central differences: step^2 times a third derivative of some 10 E, and rounding of 1e-11.
        np.testing.assert_allclose(slope, stress[index], atol=1e-8 * YOUNG)


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_tangent_is_the_derivative_of_the_stress(name, dimension):
    law, gradient = law_of(name, dimension), strained(dimension)
    # Rounding of 1e-16 over the step of 1e-6; a third derivative of some 100 E times 1e-12.
    np.testing.assert_allclose(
        law.tangent(gradient), differentiated_stress(law, gradient), atol=3e-8 * YOUNG
    )


@pytest.mark.parametrize("dimension", [3, 2])
def test_tangent_of_edge_based_rotations_is_the_derivative_too(dimension):
    law = Corotational(Material(YOUNG, 0.4), dimension, "edge")
    gradient, step = strained(dimension), 1e-5
    direction = np.random.default_rng(5).normal(size=gradient.shape)
    change = law.stress(gradient + step * direction) - law.stress(gradient - step * direction)
    expected = np.einsum("iajcp,jcp->iap", law.tangent(gradient), direction)
    # step^2 times a third derivative of some 1000 E: a short edge turns fast.
    np.testing.assert_allclose(change / (2.0 * step), expected, atol=1e-6 * YOUNG)


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_tangent_has_the_symmetry_of_a_potential(name, dimension):
    tangent = law_of(name, dimension).tangent(strained(dimension))
    swapped = np.transpose(tangent, (2, 3, 0, 1, 4))
    # Where it comes by differences, their error; else rounding.
    np.testing.assert_allclose(tangent, swapped, atol=1e-7 * YOUNG)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_at_rest_it_is_hookes_law(name, dimension, poisson):
    """dP/dF at a rotation R: lambda R (x) R + mu (R R^T)_ij delta_ac + mu R_ic R_ja."""
    material = case_material(name, YOUNG, poisson)
    lame_lambda, mu = material.lame_constants(dimension)
    law, turn = make_law(material, dimension), rotations(5)[:, :dimension]
    np.testing.assert_allclose(law.energy(turn), 0.0, atol=1e-12 * YOUNG)
    np.testing.assert_allclose(law.stress(turn), 0.0, atol=1e-12 * YOUNG)
    plane = np.einsum("iap,jap->ijp", turn, turn)
    expected = (
        lame_lambda * np.einsum("iap,jcp->iajcp", turn, turn)
        + mu * np.einsum("ijp,ac->iajcp", plane, np.eye(dimension))
        + mu * np.einsum("icp,jap->iajcp", turn, turn)
    )
    # Rounding; 1e-8 where the tangent comes by differences.
    np.testing.assert_allclose(law.tangent(turn), expected, atol=1e-8 * YOUNG)


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_law_turns_with_the_body(name, dimension):
    law, gradient = law_of(name, dimension), strained(dimension)
    turn = rotations(gradient.shape[2], seed=7)
    turned = product(turn, gradient)
    np.testing.assert_allclose(law.energy(turned), law.energy(gradient), atol=1e-12 * YOUNG)
    np.testing.assert_allclose(
        law.stress(turned), product(turn, law.stress(gradient)), atol=1e-12 * YOUNG
    )


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_law_knows_no_direction_of_the_material(name, dimension):
    """Isotropy: P(F Q) = P(F) Q for rotations Q of the material, of the plane for a sheet."""
    law, gradient = law_of(name, dimension), strained(dimension)
    turn = rotation_about("z", 50.0)[:dimension, :dimension]
    if dimension == 3:
        turn = turn @ rotation_about("x", -130.0)
    np.testing.assert_allclose(
        law.stress(np.einsum("iap,ab->ibp", gradient, turn)),
        np.einsum("iap,ab->ibp", law.stress(gradient), turn),
        atol=1e-12 * YOUNG,
    )


@pytest.mark.parametrize(("name", "dimension"), LAWS)
def test_cauchy_stress_is_symmetric(name, dimension):
    """P F^T = F P^T: no moment without one from outside."""
    gradient = strained(dimension)
    couple = np.einsum("iap,jap->ijp", law_of(name, dimension).stress(gradient), gradient)
    np.testing.assert_allclose(couple, np.swapaxes(couple, 0, 1), atol=1e-12 * YOUNG)


def test_stable_neo_hookean_goes_through_inversion():
    """Flat and inverted F: energy is finite, and stress and tangent are still its derivatives."""
    law, step = law_of("stable_neo_hookean", 3), 1e-5
    gradient = points(np.diag([1.2, 0.9, 0.0]), np.diag([0.8, 1.1, -0.5]), np.zeros((3, 3)))
    assert np.all(np.isfinite(law.energy(gradient)))
    np.testing.assert_allclose(
        law.tangent(gradient), differentiated_stress(law, gradient), atol=1e-7 * YOUNG
    )
    direction = np.random.default_rng(2).normal(size=gradient.shape)
    slope = law.energy(gradient + step * direction) - law.energy(gradient - step * direction)
    expected = np.sum(law.stress(gradient) * direction, axis=(0, 1))
    # step^2 times a third derivative of some 10 E times the direction's length cubed, about 30.
    np.testing.assert_allclose(slope / (2.0 * step), expected, atol=1e-7 * YOUNG)


@pytest.mark.parametrize("dimension", [3, 2])
@pytest.mark.parametrize("name", SHEET_LAWS)
def test_differentiated_stress_is_exact_to_rounding_over_the_step(name, dimension):
    law, gradient = law_of(name, dimension), strained(dimension)
    exact = law.tangent(gradient)
    # eps |P| / step with |P| of about E and a step of 1e-3: 1e-13; truncation step^2 = 1e-6.
    for step, tolerance in ((1e-3, 1e-4), (1e-4, 1e-6), (1e-6, 1e-8)):
        error = np.abs(differentiated_stress(law, gradient, step) - exact).max()
        assert error < tolerance * YOUNG, step


def test_edge_based_rotations_have_no_energy():
    law = Corotational(Material(YOUNG, 0.4), 3, "edge")
    with pytest.raises(ValueError, match="an energy needs rotation \"polar\", got 'edge'"):
        law.energy(strained(3))
