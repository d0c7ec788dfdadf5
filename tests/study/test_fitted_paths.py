"""Which fits to trials are none, and what is told of those that are."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.deployment_log import read_log
from pneumorph.hardware.parameter_fit import ParameterFit
from pneumorph.study import fitted_paths
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.fitted_calibration import calibrate
from pneumorph.study.fitted_paths import fit_notes

FOUND = ParameterFit(
    values={"modulus_factor": 1.1, "friction": 0.9},
    intervals={"modulus_factor": (1.0, 1.2), "friction": (0.8, 1.0)},
    r_squared=0.9,
    rms_mm=1.5,
    start_rms_mm=12.0,
    effective_sample_count=30.0,
    simulation_count=60,
    converged=True,
)
ROBOT = RobotOptions.of("published")


@pytest.fixture(scope="module")
def deployed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short trial on the virtual rig."""
    folder = RunFolder(tmp_path_factory.mktemp("runs") / "B", "deploy")
    gait = ExpertGait(period_s=1.0, duration_s=0.5)
    settings = DeploymentSettings(expert=gait, trials=1, model="reduced")
    found = deploy_gait(None, settings, ROBOT, folder)
    folder.save_summary({"verb": "deploy", "design": found.design})
    (folder / "settings.json").write_text("{}")
    return folder.path


@pytest.fixture
def fitted(
    deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[ParameterFit], tuple[dict[str, Any], str]]:
    """Calibrate from a fit that is given; returns its figures and what was said."""

    def calibrated(found: ParameterFit) -> tuple[dict[str, Any], str]:
        monkeypatch.setattr(fitted_paths, "fit_parameters", lambda *_: found)
        said = io.StringIO()
        folder = RunFolder(tmp_path / "c", "calibrate", Progress(said))
        study = calibrate(CalibrationSettings(trials=deployed), ROBOT, folder)
        return study.found.fit["trajectories"], said.getvalue()

    return calibrated


@pytest.mark.parametrize("r_squared", [0.499, -3.0, -float("inf")])
def test_a_fit_that_explains_less_than_half_is_none(
    r_squared: float, fitted: Callable[[ParameterFit], Any], tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=r"expected 0\.5 or more") as refused:
        fitted(replace(FOUND, r_squared=r_squared))
    told = str(refused.value)
    assert f"r_squared is {r_squared:.2f}" in told
    assert "12.0 mm apart before the fit and 1.5 mm after it" in told
    for cause in ("heading-deg", "units-per-mm", "start-s", "another design", "hardly moved"):
        assert cause in told
    assert not (tmp_path / "c").exists()


def test_a_fit_that_explains_half_is_one(
    fitted: Callable[[ParameterFit], tuple[dict[str, Any], str]], tmp_path: Path
) -> None:
    quality, said = fitted(replace(FOUND, r_squared=0.5))
    assert quality["r_squared"] == 0.5
    assert quality["notes"] == []
    assert "bound" not in said
    assert (tmp_path / "c" / "calibration.json").exists()


def test_what_to_doubt_of_a_fit_is_told_and_kept(
    fitted: Callable[[ParameterFit], tuple[dict[str, Any], str]],
) -> None:
    values = {"modulus_factor": 2.4999, "friction": 0.9}
    quality, said = fitted(replace(FOUND, values=values, converged=False))
    bound, ended = quality["notes"]
    assert bound.startswith("modulus_factor is 2.5, at the bound of the 0.4 to 2.5 in which it")
    assert "--fit.evaluation-limit" in ended
    assert bound in said
    assert ended in said


def test_a_path_is_drawn_as_far_as_it_was_fitted(
    deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A camera that films on after the log sees no pressures."""
    run = shutil.copytree(deployed, tmp_path / "B")
    track = run / "trial_1" / "track.csv"
    track.write_text(track.read_text() + "3,0,0,0\n")
    logged_s = read_log(run / "trial_1" / "log.csv").time_s[-1]
    monkeypatch.setattr(fitted_paths, "fit_parameters", lambda *_: FOUND)
    folder = RunFolder(tmp_path / "c", "calibrate", Progress(io.StringIO()))
    path = calibrate(CalibrationSettings(trials=run), ROBOT, folder).path
    assert path is not None
    assert logged_s <= path.time_s[-1] < logged_s + 2.0 * ROBOT.physics.time_step_s
    assert len(path.time_s) == len(path.fitted_mm) == len(path.start_mm)


@pytest.mark.parametrize(
    ("friction", "at_bound"), [(0.2, True), (0.2019, True), (0.21, False), (2.47, False),
                               (2.48, True), (2.5, True)],
)  # fmt: skip
def test_a_value_within_one_percent_of_a_bound_lies_at_it(friction: float, at_bound: bool) -> None:
    assert bool(fit_notes(replace(FOUND, values={"friction": friction}))) == at_bound
