"""Commands of a schedule that a slow rig was never sent, as deployment and comparison tell them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.deployment import DeploymentReport
from pneumorph.hardware.deployment_log import COMMAND, STOPPED, DeploymentLog, LoggedPressures
from pneumorph.hardware.driver import ForeignDeviceError
from pneumorph.hardware.marker_track import MarkerTrack, VideoSettings
from pneumorph.hardware.schedule import skipped_note
from pneumorph.hardware.trial import Trial
from pneumorph.study import deployed_gait
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployed_robot import DeployedRobot, skipped_notes
from pneumorph.study.deployment_settings import DeploymentSettings

GAIT = HeldGait(0.5 * np.arange(6.0), np.zeros((6, 1)), 3.0)


def _trial(name: str, sent_s: list[float], stopped_s: float | None = None) -> Trial:
    events = [(time_s, COMMAND) for time_s in sent_s]
    if stopped_s is not None:
        events += [(stopped_s, COMMAND), (stopped_s, f"{STOPPED}the hose came off")]
    zeros = np.zeros((2, 1))
    log = LoggedPressures(np.array([0.0, 3.0]), zeros, zeros, tuple(events))
    return Trial(name, log, MarkerTrack(np.array([0.0, 3.0]), np.zeros((2, 2))))


def test_what_a_log_lacks_of_its_schedule_is_told() -> None:
    """Late commands are none that were not sent, nor are those after a stop."""
    late = [0.0, 0.6, 1.0, 1.9, 2.2, 2.5, 3.1]
    whole, slow = _trial("whole", late), _trial("slow", [0.0, 0.7, 1.6, 2.1, 3.1])
    stopped = _trial("stopped", [0.0, 0.5], stopped_s=2.7)
    assert skipped_notes("L", [whole, stopped, _trial("no events", [])], GAIT) == []
    (told,) = skipped_notes("L", [whole, slow, stopped], GAIT)
    assert told == f"L: {skipped_note({'slow': 2}, 6)}"
    assert told.startswith("L: commands of schedule.csv were never sent (2 in slow of 6)")
    assert "another gait than schedule.csv, by which it is simulated" in told


def test_a_comparison_tells_of_skipped_commands_and_unknown_scales(tmp_path: Path) -> None:
    """Of a table of pixels, beside a log that lacks a command."""
    write_gait(tmp_path / "schedule.csv", GAIT, {"design": "1.0.0.2.2.0.0.1"})
    with DeploymentLog(tmp_path / "trial_1" / "log.csv", 1) as log:
        for time_s in (0.0, 0.5, 1.5, 2.0, 2.5, 3.0):
            log.command(time_s, np.zeros(1))
            log.row(time_s + 0.1, np.zeros(1), np.zeros(1))
    rows = "".join(f"{frame},{frame},0,1\n" for frame in range(100))
    head = "scorer,n,n,n\nbodyparts,hub,hub,hub\ncoords,x,y,likelihood\n"
    (tmp_path / "trial_1" / "track.csv").write_text(head + rows)
    notes: list[str] = []
    DeployedRobot.read("L", tmp_path, VideoSettings(), 1.0, notes)
    skipped, unscaled = notes
    assert "(1 in trial_1 of 6)" in skipped
    assert unscaled.startswith("L: trial_1: its table does not name its units")
    scaled: list[str] = []
    DeployedRobot.read(
        "L", tmp_path, VideoSettings(units_per_mm=2.0, frames_per_second=30.0), 1.0, scaled
    )
    assert scaled == [skipped]


class _Guardian:
    """Notes how it was dismissed."""

    dismissed: list[bool]

    def __init__(self, *_: object) -> None: ...

    def dismiss(self, vented: bool) -> None:
        self.dismissed.append(vented)


@pytest.fixture
def real_rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DeploymentSettings:
    """A rig of which nothing is connected."""
    _Guardian.dismissed = []
    monkeypatch.setattr(deployed_gait, "Guardian", _Guardian)
    monkeypatch.setattr(deployed_gait, "open_driver", lambda _: None)
    (tmp_path / "rig.toml").write_text('driver = "serial"\nresource = "/dev/none"\n')
    gait = ExpertGait(period_s=1.0, duration_s=1.0)
    return DeploymentSettings(expert=gait, trials=2, rig=tmp_path / "rig.toml")


def test_a_deployment_tells_which_trials_lack_commands(
    real_rig: DeploymentSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    skipped = iter([0, 3])

    def driven(*_: Any) -> DeploymentReport:
        return DeploymentReport(
            True, "completed", 1.0, True, 0.0, 0.4, 9, skipped_count=next(skipped)
        )

    monkeypatch.setattr(deployed_gait, "deploy", driven)
    folder = RunFolder(tmp_path / "B", "deploy", Progress(io.StringIO()))
    found = deploy_gait(None, real_rig, RobotOptions.of("published"), folder)
    (told,) = found.notes
    planned = found.command_count - 1  # without the last one, which vents
    assert told == skipped_note({"trial_1": 0, "trial_2": 3}, planned)
    assert f"commands of schedule.csv were never sent (3 in trial_2 of {planned}): " in told
    assert "update_interval_s" in told
    assert [each.skipped_count for each in found.trials] == [0, 3]


@pytest.mark.parametrize(("error", "vented"), [(ForeignDeviceError, True), (OSError, False)])
def test_the_guardian_sends_another_device_nothing(
    error: type[Exception],
    vented: bool,
    real_rig: DeploymentSettings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """After any other error it tries to vent."""

    def refused(*_: Any) -> DeploymentReport:
        raise error("it is a Keithley")

    monkeypatch.setattr(deployed_gait, "deploy", refused)
    folder = RunFolder(tmp_path / "B", "deploy", Progress(io.StringIO()))
    with pytest.raises(error, match="it is a Keithley"):
        deploy_gait(None, real_rig, RobotOptions.of("published"), folder)
    assert _Guardian.dismissed == [vented]
