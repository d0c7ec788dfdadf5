"""What a fit says of parameters that its paths tell, and of those that they do not."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.hardware.confidence import confidence_reach, effective_count
from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.parameter_fit import ParameterFitSettings, Parameters, fit_parameters
from pneumorph.hardware.trial import Trial

STEP_S = 0.01
TIME_S = STEP_S * np.arange(201)


def path_of(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
    """A marker whose speed is the modulus, and that friction says nothing of."""
    forward = 10.0 * values["modulus_factor"] * STEP_S * np.arange(len(driven_kPa) + 1)
    return np.column_stack([forward, np.zeros_like(forward)])


def test_a_parameter_that_no_path_changes_with_is_refused() -> None:
    """As friction is where every surface has a coefficient of its own."""
    zeros = np.zeros((len(TIME_S), 1))
    noise = 0.05 * np.random.default_rng(1).standard_normal((len(TIME_S), 2))
    track = np.column_stack([12.0 * TIME_S, np.zeros(len(TIME_S))]) + noise
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), MarkerTrack(TIME_S, track))
    start = {"modulus_factor": 1.0, "friction": 1.0}

    def fit(*names: str) -> tuple[float, float]:
        settings = ParameterFitSettings(names=names)
        return fit_parameters([trial], path_of, start, STEP_S, settings).intervals["modulus_factor"]

    low, high = fit("modulus_factor")
    assert 1.19 < low < high < 1.21
    with pytest.raises(ValueError, match=r"no path changes with friction.*friction_by_surface"):
        fit("modulus_factor", "friction")


def test_intervals_hold_the_truth_under_the_camera_s_noise() -> None:
    """Of 100 exact models 95 are expected within 95 % intervals, at least 86 with four standard
    errors. The frame at the gait's start is as noisy as the others."""
    zeros, held = np.zeros((len(TIME_S), 1)), 0
    rng, settings = np.random.default_rng(2), ParameterFitSettings(names=("modulus_factor",))
    for _ in range(100):
        noise = 0.2 * rng.standard_normal((len(TIME_S), 2))
        track = np.column_stack([10.0 * TIME_S, np.zeros(len(TIME_S))]) + noise
        trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), MarkerTrack(TIME_S, track))
        found = fit_parameters([trial], path_of, {"modulus_factor": 1.05}, STEP_S, settings)
        low, high = found.intervals["modulus_factor"]
        held += low < 1.0 < high
    assert held >= 86


def test_what_the_simulation_has_not_is_not_fitted() -> None:
    """Measured silicone has no stiffness damping, whose logarithm is fitted."""
    start = {"modulus_factor": 1.0, "stiffness_damping_s": 0.0, "friction": 0.6}
    assert ParameterFitSettings().resolved(start).names == ("modulus_factor", "friction")
    with pytest.raises(ValueError, match=r"stiffness_damping_s, which is 0 in the simulation"):
        ParameterFitSettings(names=("friction", "stiffness_damping_s")).resolved(start)


def test_a_fit_finds_the_deepest_of_many_minima() -> None:
    """A path that comes again and again near the measured one as the modulus changes, as that of a
    robot whose legs stick and slip: least squares alone stay where they begin."""

    def wavy(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
        apart = np.log(values["modulus_factor"] / 1.4)
        speeds = 10.0 + 2.0 * apart, 1.0 - np.cos(20.0 * apart)
        return np.outer(STEP_S * np.arange(len(driven_kPa) + 1), speeds)

    zeros = np.zeros((len(TIME_S), 1))
    measured = wavy({"modulus_factor": 1.4}, zeros[1:])
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), MarkerTrack(TIME_S, measured))

    def fit(search_count: int) -> float:
        settings = ParameterFitSettings(names=("modulus_factor",), search_count=search_count)
        start = {"modulus_factor": 1.0, "friction": 1.0}
        return fit_parameters([trial], wavy, start, STEP_S, settings).values["modulus_factor"]

    assert abs(np.log(fit(0) / 1.4)) > 0.1
    assert fit(32) == pytest.approx(1.4, rel=1e-3)


def test_a_fit_tells_how_far_it_is() -> None:
    """Of as many simulations as it may make, at least: it is never at its end before it ends."""
    zeros = np.zeros((len(TIME_S), 1))
    track = np.column_stack([12.0 * TIME_S, np.zeros(len(TIME_S))])
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), MarkerTrack(TIME_S, track))
    told: list[tuple[int, int]] = []
    fit_parameters(
        [trial], path_of, {"modulus_factor": 1.0, "friction": 1.0}, STEP_S,
        ParameterFitSettings(names=("modulus_factor",), search_count=8, evaluation_limit=5),
        lambda done, total, _: told.append((done, total)),
    )  # fmt: skip
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert told[0] == (1, 22)
    assert all(done < total for done, total in told[:-1])


def test_what_cannot_be_seen_is_not_certain() -> None:
    x = np.linspace(0.0, 1.0, 50)
    residual = 0.1 * np.random.default_rng(2).standard_normal(50)
    seen, unseen = confidence_reach(np.column_stack([x, np.zeros(50)]), residual, 50.0)
    # Least squares of a line through the origin: s / sqrt(sum x^2), two parameters taken off.
    error = np.sqrt(residual @ residual / 48.0 / (x @ x))
    assert seen == pytest.approx(2.0106 * error, rel=1e-4)  # Student's t for 48 degrees of freedom
    assert unseen == np.inf


def test_what_follows_from_what_was_before_counts_for_less() -> None:
    """Bayley and Hammersley's n (1 - r) / (1 + r), with r the correlation of neighbours."""
    # Four times +1, then -1: neighbours agree in 3 of 4 pairs, 15 pairs of 16 residuals.
    blocks = np.repeat([1.0, -1.0, 1.0, -1.0], 4)
    r = (12.0 - 3.0) / 16.0
    assert effective_count(blocks) == pytest.approx(16.0 * (1.0 - r) / (1.0 + r), rel=1e-12)
    # What alternates is taken for independent, not for more than there are.
    assert effective_count(np.tile([1.0, -1.0], 8)) == 16.0
    # Nothing is left over where nothing was off, and what never changes is one sample.
    assert effective_count(np.zeros(16)) == 16.0
    assert effective_count(np.ones(1000)) == 1.0
