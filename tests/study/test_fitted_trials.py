"""Which trials of a deployment are fitted to: none that ended before its gait."""

from __future__ import annotations

import io
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.deployment_log import STOPPED
from pneumorph.hardware.parameter_fit import ParameterFit
from pneumorph.hardware.trial import folders_to_fit, read_trials
from pneumorph.physics.calibration import Calibration
from pneumorph.study import fitted_paths, fitted_valves
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.fitted_calibration import calibrate

ROBOT = RobotOptions.of("published")
LEFT_OUT = "trial_2, trial_3: stopped or cut off before the gait's end; left out"


class _Given(Exception):
    """Ends a calibration, with what its fit was given."""


@pytest.fixture(scope="module")
def deployed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four trials on the virtual rig, of which the second was stopped and the third cut off."""
    folder = RunFolder(tmp_path_factory.mktemp("runs") / "B", "deploy")
    settings = DeploymentSettings(
        expert=ExpertGait(period_s=1.0, duration_s=1.0), trials=1, model="reduced"
    )
    found = deploy_gait(None, settings, ROBOT, folder)
    folder.save_summary({"verb": "deploy", "design": found.design})
    (folder / "settings.json").write_text("{}")
    first = folder.path / "trial_1"
    for number in (2, 3, 4):
        shutil.copytree(first, folder.path / f"trial_{number}")
    lines = (first / "log.csv").read_text().splitlines()
    head = next(n for n, line in enumerate(lines) if line.startswith("time_s"))
    half = [line for line in lines[: head + 1]]
    half += [line for line in lines[head + 1 :] if float(line.split(",")[0]) < 0.6]
    stop = f"0.6,{',' * (lines[head].count(',') - 2)},{STOPPED}the hose came off"
    for number, more in ((2, [stop]), (3, [])):
        (folder.path / f"trial_{number}" / "log.csv").write_text("\n".join([*half, *more]) + "\n")
    return folder.path


def _calibrate(
    settings: CalibrationSettings, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Any, str]:
    """What the fit was given first, and what was said before."""

    def given(first: Any, *_: Any) -> None:
        raise _Given(first)

    monkeypatch.setattr(fitted_paths, "fit_parameters", given)
    monkeypatch.setattr(fitted_valves, "fit_air", given)
    said = io.StringIO()
    with pytest.raises(_Given) as ended:
        calibrate(settings, ROBOT, RunFolder(folder / "c", "calibrate", Progress(said)))
    return ended.value.args[0], said.getvalue()


def test_paths_of_trials_that_ended_early_are_not_fitted_to(
    deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trials, said = _calibrate(CalibrationSettings(trials=deployed), tmp_path, monkeypatch)
    assert [trial.name for trial in trials] == ["trial_1", "trial_4"]
    assert LEFT_OUT in said
    fewer = CalibrationSettings(trials=deployed, trial_count=1)
    trials, _ = _calibrate(fewer, tmp_path, monkeypatch)
    assert [trial.name for trial in trials] == ["trial_1"]


@pytest.mark.parametrize("fitted", ["stiffness_damping_s", "friction"])
def test_a_damping_of_the_bench_is_relative_to_that_of_before(
    fitted: str, deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a damping that is fitted anew it would count twice."""
    found = ParameterFit({fitted: 0.3}, {}, 0.9, 1.0, 2.0, 10.0, 1, True)
    monkeypatch.setattr(fitted_paths, "fit_parameters", lambda *_: found)
    measured = {"damping_factor": (1.2, 0.1), "mass_factor": (1.0, 0.02)}
    file = Calibration(stiffness_damping_s=0.1, measured=measured).save(tmp_path / "before.json")
    said = io.StringIO()
    folder = RunFolder(tmp_path / "c", "calibrate", Progress(said))
    robot = replace(ROBOT, calibration=file)
    calibrate(CalibrationSettings(trials=deployed), robot, folder)
    kept = Calibration.load(folder / "calibration.json")
    anew = fitted == "stiffness_damping_s"
    assert kept.stiffness_damping_s == (0.3 if anew else 0.1)
    assert kept.measured.keys() == measured.keys() - ({"damping_factor"} if anew else set())
    assert ("damping_factor that a bench test found before" in said.getvalue()) == anew


def test_neither_are_their_pressures(
    deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs, said = _calibrate(CalibrationSettings(air=deployed), tmp_path, monkeypatch)
    assert [len(log.time_s) for log in logs] == [len(logs[0].time_s)] * 2
    assert logs[0].stopped is None
    assert LEFT_OUT in said


def test_where_all_ended_early_all_are_fitted_to(deployed: Path, tmp_path: Path) -> None:
    run = shutil.copytree(deployed, tmp_path / "B")
    for name in ("trial_1", "trial_4"):
        shutil.rmtree(run / name)
    folders, (told,) = folders_to_fit(run)
    assert [each.name for each in folders] == ["trial_2", "trial_3"]
    assert told.endswith("as all trials are; fitted to as far as they went")


def test_a_scale_that_nobody_gave_is_told_before_the_fit(
    deployed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = shutil.copytree(deployed, tmp_path / "B")
    rows = (run / "trial_1" / "track.csv").read_text().splitlines()[1:]
    table = "\n".join(",".join(row.split(",")[:3]) for row in rows)
    (run / "trial_1" / "track.csv").write_text(f"t,x,y\n{table}\n")
    trials, said = _calibrate(CalibrationSettings(trials=run), tmp_path, monkeypatch)
    assert len(trials) == 2
    assert "trial_1: its table does not name its units" in said
    assert "--video.units-per-mm 1" in said


def test_a_trial_whose_log_was_cut_off_needs_no_track(deployed: Path, tmp_path: Path) -> None:
    """As one that was stopped; one that walked to the end does."""
    run = shutil.copytree(deployed, tmp_path / "B")
    for name in ("trial_2", "trial_3"):
        (run / name / "track.csv").unlink()
    trials, unseen = read_trials(run)
    assert [each.name for each in trials] == ["trial_1", "trial_4"]
    assert unseen == ["trial_2", "trial_3"]
    (run / "trial_4" / "track.csv").unlink()
    with pytest.raises(FileNotFoundError, match=r"trial_4 holds no track"):
        read_trials(run)
