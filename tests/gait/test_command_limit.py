"""One limit of what may be commanded, wherever commands come from and wherever they go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.faulty_rig import push

from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait
from pneumorph.gait.walk import walk
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.schedule import plan_schedule
from pneumorph.physics.commands import check_commands
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.simulation.rollout import rollout
from pneumorph.study.gait_source import recalibrated
from pneumorph.trajectory import Trajectory

STRONG = ExpertGait(amplitude_kPa=60.0, duration_s=4.0)
REFUSED = r"is 1[12]\d\.\d.*, expected a finite number from 0 to 90"


@dataclass(frozen=True)
class _Careless:
    """A gait of one's own that looks at nothing."""

    pressure: float
    regulator_count: int = 3
    duration_s: float = 1.0
    maximum_pressure_kPa: float = 90.0

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        return np.array([0.0, self.pressure if time_s > 0.5 else 0.0, 0.0])


class _Model:
    physics = Physics()

    def initial_state(self) -> None:
        """It remembers nothing."""

    def rollout(
        self, state: None, commands_kPa: np.ndarray, *_: Any, **__: Any
    ) -> tuple[None, Trajectory]:
        return state, push(commands_kPa)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -0.5, 90.5])
def test_the_check_itself(value: float) -> None:
    commands = np.full((4, 3), 45.0)
    commands[2, 1] = value
    with pytest.raises(ValueError, match=r"commands_kPa\[2, 1\] is .*from 0 to 90 \(1 of 12 are"):
        check_commands(commands)


def test_the_worst_is_named_and_the_limit_itself_is_allowed() -> None:
    with pytest.raises(ValueError, match=r"commands_kPa\[1\] is 120\.0, .* \(2 of 3 are outside"):
        check_commands(np.array([95.0, 120.0, 90.0]))
    check_commands(np.array([0.0, 90.0]))
    check_commands(np.array([120.0]), highest_kPa=120.0)


@pytest.mark.parametrize("gait", [STRONG, _Careless(110.0)])
def test_a_gait_above_the_limit_is_refused_on_every_way(gait: Any) -> None:
    untouched = SimpleNamespace(reset=None, advance=None)
    with pytest.raises(ValueError, match=REFUSED):
        sample_commands(gait, 0.01, 300)
    with pytest.raises(ValueError, match=REFUSED):
        walk(untouched, [gait], duration_s=3.0, time_step_s=0.01)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=REFUSED):
        rollout(_Model(), gait)
    with pytest.raises(ValueError, match=REFUSED):
        plan_schedule(gait, RigSettings())


@pytest.mark.parametrize("value", [np.nan, -3.0])
def test_a_careless_gait_never_reaches_a_rig(value: float) -> None:
    gait = _Careless(value)
    with pytest.raises(ValueError, match="expected a finite number"):
        plan_schedule(gait, RigSettings())
    calibrated = recalibrated(gait, PressureMap(), PressureMap(3.0, -10.0), 95.0)
    with pytest.raises(ValueError, match="expected a finite number"):
        plan_schedule(calibrated, RigSettings())


def test_a_calibration_hides_no_gait_above_the_limit() -> None:
    """Its pressures are cut off at the rig's limit, but only those of a gait that may be."""
    calibrated = recalibrated(STRONG, PressureMap(), PressureMap(3.0, -10.0), 95.0)
    with pytest.raises(ValueError, match=REFUSED):
        plan_schedule(calibrated, RigSettings())


def test_commands_given_as_numbers_are_checked_too(tmp_path: Path) -> None:
    commands = np.full((3, 3), 120.0)
    with pytest.raises(ValueError, match=r"commands_kPa\[0, 0\] is 120\.0"):
        rollout(_Model(), commands)
    with pytest.raises(ValueError, match=r"commands_kPa\[0, 0\] is 120\.0"):
        resumable_rollout(None, commands, tmp_path / "checkpoint.npz")  # type: ignore[arg-type]
    _, trajectory = rollout(_Model(), commands, highest_kPa=120.0)
    assert trajectory.tracked_point_mm[-1, 0] == 3 * 120.0


def test_a_limit_raised_by_name_holds_for_simulation_and_not_for_the_rig() -> None:
    raised = ExpertGait(amplitude_kPa=60.0, duration_s=4.0, maximum_pressure_kPa=120.0)
    # Commands are renewed every 0.33 s: the one nearest to the crest lies at 1.98 s.
    crest = 60.0 * (1.0 - np.cos(0.5 * np.pi * 1.98))
    assert sample_commands(raised, 0.01, 400).max() == pytest.approx(crest)
    _, trajectory = rollout(_Model(), raised, record_every=1)
    assert trajectory.tracked_point_mm[-1, 0] > 0.0
    with pytest.raises(
        ValueError, match=r"channel 1: pressure .* beyond the channel's hard limits"
    ):
        plan_schedule(raised, RigSettings())


def test_a_file_names_its_own_limit(tmp_path: Path) -> None:
    high = HeldGait(np.zeros(1), np.array([[110.0, 0.0]]), 1.0, maximum_pressure_kPa=120.0)
    path = write_gait(tmp_path / "high.csv", high, {"design": "1.0.0.2.2.0.0.1"})
    read, comments = read_gait(path)
    assert read.held_kPa.tolist() == [[110.0, 0.0]]
    assert read.maximum_pressure_kPa == 120.0
    assert comments["design"] == "1.0.0.2.2.0.0.1"
    with pytest.raises(ValueError, match=r"pressure_kPa\[0, 0\] is 110\.0, .* from 0 to 90"):
        read_gait(path, maximum_pressure_kPa=90.0)  # who reads it has the last word
    text = path.read_text()
    for wrong in ("high", "nan", "inf", "-5"):
        path.write_text(text.replace("120.0", wrong))
        with pytest.raises(
            ValueError, match=f"maximum_pressure_kPa is '{wrong}', expected a posit"
        ):
            read_gait(path)
    usual = write_gait(tmp_path / "usual.csv", HeldGait.evenly(np.full((2, 2), 90.0)))
    assert "maximum" not in usual.read_text()


def test_straight_lines_between_allowed_pressures_are_allowed() -> None:
    time_s = np.array([0.0, 0.1, 0.7, 1.0])
    waypoints = np.array([[90.0], [89.3], [90.0], [90.0]])
    sample_commands(InterpolatedGait(time_s, waypoints), 0.001, 1000)
    with pytest.raises(ValueError, match=r"pressure_kPa\[3, 0\] is 91\.0"):
        InterpolatedGait(time_s, np.array([[90.0], [90.0], [90.0], [91.0]]))
