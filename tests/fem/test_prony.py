"""A Prony series against the integral of its relaxation, and what it refuses."""

import numpy as np
import pytest
from scipy.integrate import quad

from pneumorph.fem.prony import PronySeries

SERIES = PronySeries((0.1, 0.2), (0.65, 0.03))


def test_modulus_falls_from_instantaneous_to_relaxed():
    assert SERIES.relaxation(np.array([0.0, 1e3])) == pytest.approx([1.0 / 0.7, 1.0])


def test_complex_modulus_is_the_transform_of_the_relaxation():
    """G*(w) = i w int_0^inf G(t) exp(-i w t) dt (Ferry, equation 3.3-3.4), G_inf apart."""
    w = 7.0
    integrals = [
        quad(lambda t: SERIES.relaxation(t) - 1.0, 0.0, np.inf, weight=part, wvar=w)[0]
        for part in ("cos", "sin")
    ]
    expected = 1.0 + 1j * w * (integrals[0] - 1j * integrals[1])
    assert SERIES.complex_modulus(w) == pytest.approx(expected, rel=1e-6)  # quad's tolerance


def test_secant_ratio_is_the_mean_relaxation_of_a_ramp():
    """Stress at the end of a ramp of length T is the strain times the mean of G over T."""
    duration = 0.5 / 0.23
    mean = quad(SERIES.relaxation, 0.0, duration)[0] / duration
    assert SERIES.secant_ratio(0.5, 0.23) == pytest.approx(mean, rel=1e-8)


@pytest.mark.parametrize(
    ("weights", "times", "message"),
    [
        ((0.6, 0.4), (1.0, 0.1), "weights sum to 1, expected less than 1"),
        ((0.1,), (0.0,), r"times_s\[0\] must be positive"),
        ((-0.1,), (1.0,), r"weights\[0\] must be positive"),
        ((0.1, 0.2), (1.0,), "2 weights and 1 times_s"),
        ((np.nan,), (1.0,), r"weights\[0\]"),
    ],
)
def test_series_that_are_none_are_refused(weights, times, message):
    with pytest.raises(ValueError, match=message):
        PronySeries(weights, times)
