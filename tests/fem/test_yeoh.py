"""Yeoh's law against the closed forms of incompressible rubber, and the constants it refuses."""

import numpy as np
import pytest
from helpers.law_cases import points
from scipy.optimize import brentq

from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.fem.yeoh import Yeoh
from pneumorph.fem.yeoh_constants import tension_stress, turning_invariant, yeoh_material

CONSTANTS = (86.6, 13.8, -1.47)
"""Dragon Skin 30 [kPa]."""
STRETCHES = (0.7, 1.2, 1.6)


def slope(y: float) -> float:
    """psi'(y) [kPa]."""
    return CONSTANTS[0] + 2.0 * CONSTANTS[1] * y + 3.0 * CONSTANTS[2] * y**2


def stress_at(bulk_over_shear: float, gradient_of, kept: float) -> float:
    """P_11 where P_33 vanishes, near the stretch across that keeps the volume."""
    law = Yeoh(yeoh_material(*CONSTANTS, bulk_over_shear=bulk_over_shear), 3)

    def stress(free: float) -> np.ndarray:
        return law.stress(points(np.diag(gradient_of(free))))[:, :, 0]

    return stress(brentq(lambda free: stress(free)[2, 2], 0.9 * kept, 1.1 * kept, xtol=1e-15))[0, 0]


@pytest.mark.parametrize("stretch", STRETCHES)
@pytest.mark.parametrize("test", ["one way", "two ways", "constant width"])
def test_curves_are_those_of_incompressible_rubber(test, stretch):
    """P = 2 (s - s^-n) psi'(y); the error falls in proportion to mu / K."""
    s = stretch
    exponent, kept, gradient = {
        "one way": (2, s**-0.5, lambda t: (s, t, t)),
        "two ways": (5, s**-2, lambda t: (s, s, t)),
        "constant width": (3, s**-1, lambda t: (s, 1.0, t)),
    }[test]
    y = np.sum(np.square(gradient(kept))) - 3.0
    exact = 2.0 * (s - s**-exponent) * slope(y)
    errors = [stress_at(ratio, gradient, kept) - exact for ratio in (1e3, 1e4)]
    # J - 1 is about P / K = 3 mu / K at most, and changes P by a few times its share.
    assert abs(errors[0]) < 0.02 * abs(exact)
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.03)
    if test == "one way":
        assert tension_stress(np.array([stretch]), *CONSTANTS)[0] == pytest.approx(exact)


def test_simple_shear():
    """F = I + g e_1 (x) e_2: P = 2 psi'(g^2) (F - (3 + g^2) / 3 F^-T), whatever K."""
    law, amount = Yeoh(yeoh_material(*CONSTANTS), 3), 0.8
    gradient = np.eye(3)
    gradient[0, 1] = amount
    expected = gradient - (3.0 + amount**2) / 3.0 * np.linalg.inv(gradient).T
    expected *= 2.0 * slope(amount**2)
    # Rounding.
    np.testing.assert_allclose(law.stress(points(gradient))[:, :, 0], expected, atol=1e-10)


def test_change_of_volume_alone_is_resisted_by_the_bulk_modulus():
    """F = s I: P = K (s^3 - 1) s^2 I and psi = K/2 (s^3 - 1)^2, K = 200 * 2 C1."""
    law, stretch, bulk = Yeoh(yeoh_material(*CONSTANTS), 3), 1.1, 400.0 * CONSTANTS[0]
    gradient = points(stretch * np.eye(3))
    swelling = stretch**3 - 1.0
    np.testing.assert_allclose(
        law.stress(gradient)[:, :, 0], bulk * swelling * stretch**2 * np.eye(3), atol=1e-8 * bulk
    )
    assert law.energy(gradient)[0] == pytest.approx(0.5 * bulk * swelling**2)


def test_constants_are_those_of_the_material():
    material = yeoh_material(*CONSTANTS, bulk_over_shear=50.0)
    assert material.lame_mu == pytest.approx(2.0 * CONSTANTS[0])
    bulk = material.lame_lambda + 2.0 / 3.0 * material.lame_mu
    assert bulk / material.lame_mu == pytest.approx(50.0)
    assert material.stiffer(2.0).lame_mu == pytest.approx(4.0 * CONSTANTS[0])
    assert material.stiffer(2.0).yeoh_c2_over_c1 == material.yeoh_c2_over_c1


def test_a_point_turned_inside_out_has_no_energy():
    law = Yeoh(yeoh_material(*CONSTANTS), 3)
    turned = points(np.diag([1.0, 1.0, -0.5]), np.eye(3))
    assert np.isnan(law.energy(turned)).tolist() == [True, False]
    assert np.isnan(law.stress(turned)[0, 0]).tolist() == [True, False]


def test_where_the_stress_turns_down():
    """C3 < 0 turns: of the three tests at the first root of the derivative of the stress."""
    turn = turning_invariant(*CONSTANTS)

    def rate(stretch: float) -> float:  # d/ds (s - s^-5) psi'(y), two ways alike
        y, dy = 2.0 * stretch**2 + stretch**-4 - 3.0, 4.0 * (stretch - stretch**-5)
        curve = 2.0 * CONSTANTS[1] + 6.0 * CONSTANTS[2] * y
        return (1.0 + 5.0 * stretch**-6) * slope(y) + (stretch - stretch**-5) * curve * dy

    stretch = brentq(rate, 1.5, 3.0)
    # The grid of stretches is 1.5e-4 apart, so y is known to 4 s ds.
    assert turn == pytest.approx(2.0 * stretch**2 + stretch**-4 - 3.0, abs=3e-3)
    assert turning_invariant(86.0, 13.7, 0.0) == np.inf


def test_unstable_constants_are_refused():
    with pytest.raises(ValueError, match="c1_kPa must be positive and finite, got -3"):
        yeoh_material(-3.0, 10.0)
    with pytest.raises(ValueError, match=r"falls from I1 - 3 = .* expected a rising one up to 2"):
        yeoh_material(86.6, -30.0, 0.0)
    with pytest.raises(ValueError, match="bulk_over_shear must be finite and at least 2/3"):
        yeoh_material(86.6, bulk_over_shear=0.5)
    with pytest.raises(ValueError, match="stress that falls"):
        make_law(Material(500.0, 0.4, "yeoh", -0.5), 3)
    with pytest.raises(ValueError, match=r"yeoh is a law of solids \(dimension 3\), got 2"):
        make_law(Material(500.0, 0.4, "yeoh"), 2)
