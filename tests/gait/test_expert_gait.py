"""The expert's gait is its formula, held between updates of the command."""

import numpy as np
import pytest

from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands


def test_waves_follow_the_formula() -> None:
    gait = ExpertGait(phase_deg=90.0, command_interval_s=0.0)
    for time_s in (0.0, 0.3, 1.0, 2.7, 11.1):
        late = max(time_s - 1.0, 0.0)  # 90 degrees of 4 s
        np.testing.assert_allclose(
            gait.pressure_kPa(time_s),
            [45 - 45 * np.cos(np.pi * time_s / 2), 45 - 45 * np.cos(np.pi * late / 2), 0.0],
            atol=1e-12,  # rounding at 45 kPa
        )


def test_regulator_2_waits_for_its_wave() -> None:
    commands = sample_commands(ExpertGait(phase_deg=180.0), 0.01, 2000)
    assert commands.shape == (2000, 3)
    assert (commands[:198, 1] == 0.0).all()
    assert commands[240, 1] > 0.0
    assert commands.min() >= 0.0
    assert commands.max() <= 90.0


def test_commands_are_updated_every_third_of_a_second() -> None:
    commands = sample_commands(ExpertGait(phase_deg=50.0), 0.01, 2000)
    changes = np.flatnonzero((np.diff(commands, axis=0) != 0).any(axis=1)) + 1
    np.testing.assert_array_equal(changes % 33, 0)
    np.testing.assert_array_equal(np.diff(changes), 33)
    wave = ExpertGait(phase_deg=50.0, command_interval_s=0.0)
    for update in (1, 7, 60):
        np.testing.assert_allclose(
            commands[33 * update], wave.pressure_kPa(0.33 * update), atol=1e-12
        )


def test_impossible_gaits_are_refused() -> None:
    with pytest.raises(ValueError, match=r"period_s must be at least 1e-09, got 0\.0"):
        ExpertGait(period_s=0.0)
    with pytest.raises(ValueError, match="phase_deg must be finite, got nan"):
        ExpertGait(phase_deg=float("nan"))
    with pytest.raises(
        ValueError, match="regulator_count must be at least 2, got 1; one wave each"
    ):
        ExpertGait(regulator_count=1)
