"""The reward is the travel in cm, and a failure never pays."""

import numpy as np

from pneumorph.environment.reward import reward_terms


def test_travel_is_paid_in_centimetres_and_failures_are_not_paid() -> None:
    travel_mm = np.array([25.0, -3.0, 1e6, np.nan, np.inf])
    failed = np.array([False, False, True, True, False])
    np.testing.assert_allclose(
        reward_terms(travel_mm, failed)["forward_travel_cm"], [2.5, -0.3, 0.0, 0.0, 0.0]
    )
