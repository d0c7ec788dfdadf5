"""The two tolerances of the published experiment, against their formulas."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.ecsw import EcswSettings, ecsw
from pneumorph.reduction.errors import force_errors
from pneumorph.reduction.pod import pod
from pneumorph.reduction.reduction_settings import ReductionSettings

PART = synthetic_part((6, 4, 4))


@pytest.mark.parametrize("tolerance", [0.05, 0.0032])
def test_mode_tolerance_is_the_share_of_the_singular_values_left_out(tolerance):
    rng = np.random.default_rng(0)
    modes = vibration_modes(PART, 30)
    snapshots = np.moveaxis(
        modes @ (0.6 ** np.arange(30)[:, None] * rng.normal(size=(30, 50))), 2, 0
    )
    # Equal node masses: the norm of mass is the Euclidean one of the positions.
    values = np.linalg.svd(snapshots.reshape(50, -1), compute_uv=False)
    left = np.sqrt(np.append(np.cumsum(values[::-1] ** 2)[::-1], 0.0) / np.sum(values**2))
    basis = pod(snapshots, PART.node_mass, tolerance=tolerance, mode_limit=100)
    count = basis.modes.shape[2]
    assert count == int(np.argmax(left <= tolerance))  # the fewest that meet it
    assert basis.projection_error == pytest.approx(left[count], rel=1e-6)
    assert left[count] <= tolerance < left[count - 1]


@pytest.mark.parametrize(
    "name", ["mode_tolerance", "pressure_tolerance", "curve_tolerance", "hyperreduction_tolerance"]
)
def test_a_tolerance_that_nothing_at_all_meets_is_refused(name):
    settings = EcswSettings if name == "hyperreduction_tolerance" else ReductionSettings
    settings(**{name: 0.999})
    for wrong in (1.0, 1.5):
        with pytest.raises(ValueError, match=rf"{name} must be .*below 1, got {wrong}; a relative"):
            settings(**{name: wrong})


@pytest.mark.parametrize("tolerance", [0.05, 0.001])
def test_hyperreduction_tolerance_is_the_relative_residual_of_the_rows(tolerance):
    rng = np.random.default_rng(1)
    modes = vibration_modes(PART, 5)
    reach = np.abs(modes).max(axis=(0, 1))
    states = 3.0 * rng.normal(size=(12, 5)) / reach  # some millimetres of each mode
    settings = EcswSettings(
        hyperreduction_tolerance=tolerance,
        element_limit=1000,
        stiffness_state_count=0,
        force_floor=1e-9,
    )
    found = ecsw(PART.element_groups, modes, states, settings, rotation="polar")
    assert found.converged
    every = assemble_reduced_part(PART, modes)
    sampled = assemble_reduced_part(PART, modes, found.cubatures)
    # Polar rotations leave no moment, and every state's rows are divided by their own size, so
    # ||G w - b|| / ||b|| is the root mean square of the states' relative force errors. Modes are
    # rounded to single precision on the way, 1e-7 of the whole force.
    measured = np.sqrt(np.mean(force_errors(sampled, every, states, "polar") ** 2))
    assert measured == pytest.approx(found.relative_residual, rel=1e-2, abs=1e-6)
    assert found.relative_residual <= tolerance
