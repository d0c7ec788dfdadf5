"""What a fit says of parameters that its paths tell, and of those that they do not."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.hardware.confidence import Course, confidence, effective_count
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


def test_a_fit_does_not_believe_the_line_through_a_gap() -> None:
    """A robot that goes to and fro while its marker is not seen, from 0.5 to 1.5 s of 2 s: a
    straight line stands in its track, which no modulus explains."""
    lost = (TIME_S > 0.5) & (TIME_S < 1.5)

    def to_and_fro(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
        time_s = STEP_S * np.arange(len(driven_kPa) + 1)
        away = np.where((time_s > 0.5) & (time_s < 1.5), np.sin(np.pi * (time_s - 0.5)), 0.0)
        forward = values["modulus_factor"] * (10.0 * time_s - 40.0 * away)
        return np.column_stack([forward, np.zeros_like(forward)])

    zeros = np.zeros((len(TIME_S), 1))
    measured = to_and_fro({"modulus_factor": 1.2}, zeros[1:])
    track = MarkerTrack(TIME_S[~lost], measured[~lost])
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), track)
    settings = ParameterFitSettings(names=("modulus_factor",))
    found = fit_parameters([trial], to_and_fro, {"modulus_factor": 1.0}, STEP_S, settings)
    assert found.values["modulus_factor"] == pytest.approx(1.2, rel=1e-4)
    assert found.r_squared > 1.0 - 1e-6
    short = Trial("two", trial.pressures, MarkerTrack(TIME_S[:4], measured[:4]))
    with pytest.raises(ValueError, match=r"two lasts 0\.03 s, of which its track tells 0 samples"):
        fit_parameters([short], to_and_fro, {"modulus_factor": 1.0}, STEP_S, settings)


def test_nothing_of_a_path_that_stands_still_is_explained() -> None:
    zeros = np.zeros((len(TIME_S), 1))
    track = MarkerTrack(TIME_S, np.zeros((len(TIME_S), 2)))
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), track)
    settings = ParameterFitSettings(names=("modulus_factor",))
    found = fit_parameters([trial], path_of, {"modulus_factor": 1.0}, STEP_S, settings)
    assert found.r_squared == -np.inf


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


def test_derivatives_are_of_the_whole_step_from_wherever_a_fit_begins() -> None:
    """Also from 1, whose logarithm is 0. A ripple of contact, whose own slope is five times that of
    the path, hides the modulus from much smaller steps."""
    zeros = np.zeros((len(TIME_S), 1))
    seen: list[float] = []

    def rippled(values: Parameters, driven_kPa: np.ndarray) -> np.ndarray:
        seen.append(np.log(values["modulus_factor"]))
        ripple = 5e-5 * np.sin(1e5 * seen[-1])
        speed = 10.0 * (values["modulus_factor"] + ripple)
        forward = speed * STEP_S * np.arange(len(driven_kPa) + 1)
        return np.column_stack([forward, np.zeros_like(forward)])

    measured = path_of({"modulus_factor": 1.1}, zeros[1:])
    trial = Trial("one", LoggedPressures(TIME_S, zeros, zeros, ()), MarkerTrack(TIME_S, measured))
    settings = ParameterFitSettings(names=("modulus_factor",), search_count=0)
    found = fit_parameters([trial], rippled, {"modulus_factor": 1.0}, STEP_S, settings)
    # The start, least squares there again, and their first derivative.
    assert seen[:4] == pytest.approx([0.0, 0.0, settings.step, -settings.step])
    assert found.values["modulus_factor"] == pytest.approx(1.1, abs=2e-4)


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
    r = residual[1:] @ residual[:-1] / (residual @ residual)
    assert r < 0.0  # they count as independent
    found = confidence([Course(np.column_stack([x, np.zeros(50)]), residual)])
    # Least squares of a line through the origin: s / sqrt(sum x^2), the one that is seen taken off.
    error = np.sqrt(residual @ residual / 49.0 / (x @ x))
    assert found.reach[0] == pytest.approx(2.00958 * error, rel=1e-5)  # Student's t for 49
    assert found.reach[1] == np.inf
    assert found.effective == pytest.approx(50.0)


def test_samples_that_say_nothing_make_nothing_surer() -> None:
    """A robot that walks ahead: what its model misses drifts along the way, and its camera's noise
    across it, which knows of no parameter. Of 100 intervals 95 hold the truth, at least 86 with
    four standard errors; samples that are counted together would hold it in some 47."""
    rng, held, alone = np.random.default_rng(3), 0, []
    time = np.linspace(-1.0, 1.0, 200)
    for _ in range(100):
        steps = rng.standard_normal(200)
        along = np.empty(200)
        along[0] = steps[0]
        for place in range(1, 200):  # stationary, of deviation 1
            along[place] = 0.8 * along[place - 1] + 0.6 * steps[place]
        across = 0.1 * rng.standard_normal(200)
        slope = float(time @ along / (time @ time))
        left, column = along - along.mean() - slope * time, time[:, None]
        ahead = Course(column, left, mean_removed=True)
        aside = Course(0.0 * column, across - across.mean(), mean_removed=True)
        reach = float(confidence([ahead, aside]).reach[0])
        held += abs(slope) < reach
        alone.append(reach / float(confidence([ahead]).reach[0]))
    assert held >= 86
    assert alone == pytest.approx([1.0] * 100)


def test_courses_are_weighed_by_what_they_say() -> None:
    """Two lines through the origin, one ten times as noisy: the variance of the slope is
    sum s_c^2 A_c / A^2, as is known of least squares that are not weighed (White 1980)."""
    rng, x = np.random.default_rng(5), np.linspace(0.5, 1.5, 4000)
    slopes, courses = [], []
    for scale, noise in ((1.0, 0.1), (2.0, 1.0)):
        courses.append(Course(scale * x[:, None], noise * rng.standard_normal(4000)))
        slopes.append((noise * scale) ** 2 * x @ x)
    total = (1.0 + 4.0) * x @ x
    error = np.sqrt(sum(slopes)) / total
    # Deviations of 4000 samples are known to 1.1 %, and white noise's correlation to 0.016.
    assert confidence(courses).reach[0] == pytest.approx(1.96 * error, rel=0.06)


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


def test_a_mean_that_was_taken_off_hides_correlation() -> None:
    """Lag-one correlations of 20 samples of r = 0.5 about their own mean are 0.12 too small on
    average (Marriott and Pope 1954), by a formula of first order in 1/20."""
    rng, found = np.random.default_rng(7), []
    for _ in range(2000):
        course = [rng.standard_normal()]
        for _ in range(19):
            course.append(0.5 * course[-1] + np.sqrt(0.75) * rng.standard_normal())
        left = np.array(course) - np.mean(course)
        found.append(left[1:] @ left[:-1] / (left @ left))
    assert np.mean(found) + (1.0 + 3.0 * 0.5) / 20.0 == pytest.approx(0.5, abs=0.03)
    # 16 samples with r = 0.5625: 16 (1 - r') / (1 + r') - 1 with r' = r + (1 + 3 r) / 16.
    left = np.repeat([1.0, -1.0, 1.0, -1.0], 4)
    r = 9.0 / 16.0 + (1.0 + 27.0 / 16.0) / 16.0
    expected = 16.0 * (1.0 - r) / (1.0 + r) - 1.0
    assert effective_count(left, mean_removed=True) == pytest.approx(expected, rel=1e-12)
