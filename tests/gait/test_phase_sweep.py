"""The phase sweep of a crawler whose answer symmetry tells."""

from pathlib import Path

import numpy as np
import pytest

from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweep, PhaseSweepSettings, sweep_phases


@pytest.fixture(scope="module")
def sweep() -> PhaseSweep:
    return sweep_phases(viscous_crawler_robot, ViscousCrawler)


def test_sweep_has_the_papers_phases(sweep: PhaseSweep) -> None:
    np.testing.assert_array_equal(sweep.phase_deg, np.arange(0, 181, 10))
    assert sweep.forward_cm.shape == (len(sweep.time_s), 19)
    np.testing.assert_array_equal(sweep.forward_cm[-1], sweep.distance_cm)


def test_waves_in_phase_get_nowhere(sweep: PhaseSweep) -> None:
    # Fore and hind legs pull alike, so the forces cancel at every instant, up to rounding.
    assert abs(sweep.distance_cm[0]) < 1e-12


def test_quarter_wave_is_furthest_and_half_wave_nearly_nowhere(sweep: PhaseSweep) -> None:
    # The loop in the plane of the two pressures is a circle at 90 degrees and a line at 180;
    # the commands' hold of 0.33 s and the late start of the second wave blur both.
    travelled = np.abs(sweep.distance_cm)
    assert abs(sweep.phase_deg[travelled.argmax()] - 90.0) <= 10.0
    assert travelled[-1] < 0.25 * travelled.max()


def test_file_round_trip(sweep: PhaseSweep, tmp_path: Path) -> None:
    read = PhaseSweep.load(sweep.save(tmp_path / "sweep.npz"))
    np.testing.assert_array_equal(read.forward_cm, sweep.forward_cm)
    assert read.best_phase_deg == sweep.best_phase_deg
    assert read.settings == sweep.settings
    assert read.settings["gait"]["period_s"] == 4.0


def test_settings_are_checked() -> None:
    with pytest.raises(ValueError, match="phase_step_deg must be positive, got 0"):
        PhaseSweepSettings(phase_step_deg=0.0)
    with pytest.raises(ValueError, match="to regulator 4, expected 1 to 3"):
        sweep_phases(
            viscous_crawler_robot, ViscousCrawler, PhaseSweepSettings(design="4.1.1.0.0.0.0.0")
        )


def test_failure_at_every_phase_is_said() -> None:
    class Broken(ViscousCrawler):
        @property
        def status(self) -> np.ndarray:
            return np.ones(len(self._forward_mm), dtype=np.uint8)

    settings = PhaseSweepSettings(phase_step_deg=90.0, gait=ExpertGait(duration_s=4.0))
    with pytest.raises(ValueError, match="failed at every phase"):
        sweep_phases(viscous_crawler_robot, Broken, settings)


def test_a_gait_shorter_than_its_period_is_refused_before_anything_walks() -> None:
    def build(_: object) -> object:
        raise AssertionError("nothing is to be built")

    settings = PhaseSweepSettings(gait=ExpertGait(duration_s=3.0))
    with pytest.raises(
        ValueError, match=r"gait\.duration_s is 3, expected at least gait\.period_s"
    ):
        sweep_phases(build, ViscousCrawler, settings)
    whole = PhaseSweepSettings(phase_step_deg=90.0, gait=ExpertGait(duration_s=4.0))
    assert len(sweep_phases(viscous_crawler_robot, ViscousCrawler, whole).backsliding_cm) == 3
