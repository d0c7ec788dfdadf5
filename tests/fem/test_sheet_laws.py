"""A sheet's law is the solid's with no stress across the sheet, whatever stretch that takes."""

import numpy as np
import pytest
from helpers.law_cases import SHEET_LAWS, strained
from scipy.optimize import brentq

from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("name", SHEET_LAWS)
def test_sheet_is_a_solid_free_of_stress_across(name, poisson):
    material = Material(100.0, poisson, name)
    solid, sheet = make_law(material, 3), make_law(material, 2)
    gradient = strained(2, size=0.15)
    normal = np.cross(gradient[:, 0], gradient[:, 1], axis=0)
    normal /= np.linalg.norm(normal, axis=0)
    whole = np.concatenate([gradient, normal[:, None]], axis=1)

    def stress_across(stretch: float, point: int) -> float:
        there = whole[:, :, point : point + 1].copy()
        there[:, 2] *= stretch
        return float(solid.stress(there)[:, 2, 0] @ normal[:, point])

    stretches = [
        brentq(stress_across, 0.3, 3.0, args=(point,), xtol=1e-15) for point in range(len(normal.T))
    ]
    assert np.ptp(stretches) > 0.1 or poisson == 0.0
    whole[:, 2] *= stretches
    stress = solid.stress(whole)
    # The root to rounding, times a stiffness of E / (1 - 2 nu).
    np.testing.assert_allclose(stress[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(sheet.stress(gradient), stress[:, :2], atol=1e-9)
    np.testing.assert_allclose(sheet.energy(gradient), solid.energy(whole), atol=1e-9)
