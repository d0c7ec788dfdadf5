"""What stays of a deployment that is stopped between its trials, and what it never writes over."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faulty_rig import push

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.bend_staircase import BendTestSettings
from pneumorph.hardware.deployment import deploy
from pneumorph.hardware.driver import DriverError
from pneumorph.study import deployed_gait, virtual_reality
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_result import DeployedGait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.trajectory import Trajectory

GAIT = ExpertGait(period_s=1.0, duration_s=1.0)
SETTINGS = DeploymentSettings(expert=GAIT, trials=2, model="reduced")


@pytest.fixture
def second_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C before the second trial begins."""
    begun: list[int] = []

    def stopped(*arguments: Any) -> Any:
        begun.append(1)
        if len(begun) == 2:
            raise KeyboardInterrupt
        return deploy(*arguments)

    monkeypatch.setattr(deployed_gait, "deploy", stopped)


def _deploy(folder: Path) -> None:
    deploy_gait(None, SETTINGS, RobotOptions.of("published"), RunFolder(folder, "deploy"))


@pytest.mark.usefixtures("second_is_stopped")
def test_the_summary_tells_of_the_trials_before_an_interrupt(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        _deploy(tmp_path)
    found = json.loads((tmp_path / "summary.json").read_text())
    (trial,) = found["trials"]
    assert trial["completed"]
    assert found["design"] == "1.0.0.2.2.0.0.1"


@pytest.mark.usefixtures("second_is_stopped")
def test_a_summary_that_cannot_be_written_hides_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(RunFolder, "save_summary", full)
    with pytest.raises(KeyboardInterrupt, match="the summary cannot be written: no space left"):
        _deploy(tmp_path)


def test_measured_trials_are_not_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "trial_2" / "log.csv"
    log.parent.mkdir()
    log.write_text("measured")
    asked = f"deploy --expert.duration-s 1 --expert.period-s 1 --dry-run --out {tmp_path}"
    assert run(asked.split()) == 1
    assert "holds the trials of an earlier deployment" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["trial_2"]


def test_finite_elements_that_were_stopped_go_on_in_their_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every trial is driven again, which is quick, and its robot walks on from its checkpoint; of a
    finished deployment and for another one nothing goes on."""
    settings, walked = replace(SETTINGS, model="full"), []

    def walk(robot: Any, pressure_kPa: np.ndarray, checkpoint: Path, **_: Any) -> Trajectory:
        walked.append((checkpoint.parent.name, checkpoint.exists(), pressure_kPa.tobytes()))
        checkpoint.write_bytes(b"so far")
        if len(walked) == 2:
            raise KeyboardInterrupt
        return push(pressure_kPa)

    def deployed(folder: Path, **changed: Any) -> DeployedGait:
        asked, robot = replace(settings, **changed), RobotOptions.of("published")
        return deploy_gait(None, asked, robot, RunFolder(folder, "deploy"))

    monkeypatch.setattr(virtual_reality, "resumable_rollout", walk)
    with pytest.raises(KeyboardInterrupt):
        deployed(tmp_path)
    for other in ({"trials": 1}, {"model": "reduced"}):
        with pytest.raises(ValueError, match="holds the trials of an earlier deployment"):
            deployed(tmp_path, **other)
    found = deployed(tmp_path)
    names, there, pressures = zip(*walked, strict=True)
    assert names == ("trial_1", "trial_2") * 2
    assert there == (False, False, True, True)
    assert pressures[:2] == pressures[2:]
    assert len(found.trials) == 2
    assert not list(tmp_path.rglob("checkpoint.npz"))
    with pytest.raises(ValueError, match="holds the trials of an earlier deployment"):
        deployed(tmp_path)
    walked.clear()
    undisturbed = deployed(tmp_path / "other", trials=1)
    assert undisturbed.trials[0].distance_cm == found.trials[0].distance_cm


def test_a_simulation_that_diverges_ends_the_deployment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    walked = []

    def walk(_: Any, pressure_kPa: np.ndarray, **__: Any) -> tuple[None, Trajectory]:
        walked.append(1)
        status = "completed" if len(walked) == 1 else "diverged"
        return None, replace(push(pressure_kPa), status=status)

    monkeypatch.setattr(virtual_reality, "rollout", walk)
    with pytest.raises(DriverError, match="trial_2: the virtual robot's simulation diverged"):
        _deploy(tmp_path)
    assert len(json.loads((tmp_path / "summary.json").read_text())["trials"]) == 1


@pytest.mark.parametrize("physics", ["published", "measured"])
def test_a_rig_of_another_number_of_channels_is_told_before_anything_is_written(
    physics: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A 9129B has three outputs, the robot of the measured physics three regulators."""
    rig, gait = tmp_path / "rig.toml", tmp_path / "gait.csv"
    rig.write_text('driver = "9129b"\nresource = "ASRL1::INSTR"\n[[channels]]\n[[channels]]\n')
    gait.write_text(
        "# design: 1.0.0.2.2.0.0.1\ntime_s,regulator_1_kPa,regulator_2_kPa\n"
        "0,40,0\n1,0,40\n2,0,40\n"
    )
    asked = f"deploy {gait} --physics {physics} --rig {rig} --out {tmp_path / 'd'}"
    assert run(asked.split()) == 1
    said = capsys.readouterr().err
    assert "2 channels, expected 3: a 9129B has that many outputs" in said
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize(
    ("driver", "ignored", "used"),
    [
        ("serial", {"bends": BendTestSettings(repeats=5)}, {"trials": 2}),
        ("virtual", {"trials": 2}, {"bends": BendTestSettings(repeats=5)}),
    ],
)
def test_what_a_bend_test_would_ignore_is_refused(
    driver: str, ignored: dict[str, Any], used: dict[str, Any]
) -> None:
    """On a real rig a person reads each bend, a virtual one is bent once."""
    rig = Path("rig.toml")
    DeploymentSettings(bend_test=True, rig=rig, **used).refuse_unused(driver)
    with pytest.raises(ValueError, match=r"is given, expected it .* it would be ignored"):
        DeploymentSettings(bend_test=True, rig=rig, **ignored).refuse_unused(driver)
