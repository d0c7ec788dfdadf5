"""The example's law in a model, and what the example prints."""

import numpy as np
import own_law
import pytest
from scipy.optimize import fsolve

from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material


def test_bars_stretch_as_their_laws_say():
    """The bar against a free one, which stretches evenly by the root of the law's own stress.

    The held end cannot thin. Saint-Venant: that reaches about one width of the bar's four, where
    the bar is stiffer by less than (lambda + 2 mu) / E = 3.8; the whole loses less than
    1/4 (1 - 1/3.8) = 18 % of its extension, and gains nothing.
    """
    for name, ratio in own_law.main().items():
        law = make_law(Material(1000.0, 0.45, name), 3)

        def unbalanced(stretches, law=law):
            along, across = stretches
            stress = law.stress(np.diag([along, across, across])[:, :, None])
            return stress[0, 0, 0] - own_law.STRESS_KPA, stress[1, 1, 0]

        free, thinned = fsolve(unbalanced, (1.6, 0.8))
        assert np.abs(unbalanced((free, thinned))).max() < 1e-6
        assert 0.82 * (free - 1.0) < ratio - 1.0 < free - 1.0, name


def test_a_sheet_is_refused():
    with pytest.raises(ValueError, match=r"is for solids \(dimension 3\), got 2"):
        make_law(Material(100.0, 0.3, "isochoric_neo_hookean"), 2)
