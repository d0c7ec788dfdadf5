"""Tests on a bench of numbers that change nothing of the robot are not said to be agreed with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.idle_numbers import idle_notes, idle_numbers
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.study.bench_readings import write_bench_readings
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.certificate_notes import measured_notes
from pneumorph.study.fitted_calibration import calibrate

ROBOT = paper_robot()
TESTED = ("friction", 0.6, 0.02), ("friction sheet", 0.6, 0.02)


def test_a_test_that_changes_nothing_is_told_and_not_agreed_with() -> None:
    both = replace(measured_worlds(), measured=TESTED)
    (told,) = idle_notes(ROBOT, both)
    assert told == (
        "the test of friction changes nothing: every surface (hub, sheet, skin) has a coefficient "
        "of its own"
    )
    (agreed,) = measured_notes(both, idle_numbers(ROBOT, both))
    assert agreed.startswith("bands agree with the tests of friction sheet;")
    idle = replace(measured_worlds(), measured=TESTED[:1])
    assert measured_notes(idle, idle_numbers(ROBOT, idle)) == []
    # Where a surface has none of its own, it counts.
    counting = replace(both, friction_by_surface=(("sheet", "U(0.4, 0.8)"),))
    assert idle_notes(ROBOT, counting) == ()
    (agreed,) = measured_notes(counting, idle_numbers(ROBOT, counting))
    assert agreed.startswith("bands agree with the tests of friction, friction sheet;")


def test_a_calibration_says_which_tests_change_nothing(tmp_path: Path) -> None:
    readings = {"tilt of a robot": [31.0, 30.0], "tilt of a leg": [31.0, 30.0]}
    bench, said = write_bench_readings(tmp_path / "bench.csv", readings), list[str]()
    folder = RunFolder(tmp_path / "calibrate", "calibrate")
    folder.progress.say = said.append  # type: ignore[method-assign]
    found = calibrate(CalibrationSettings(bench=bench), RobotOptions(), folder).found
    assert set(found.measured) == {"friction", "friction sheet"}
    (told,) = [note for note in said if "changes nothing" in note]
    assert told.startswith("the test of friction changes nothing of this robot in worlds")
    assert "every surface (hub, sheet, skin) has a coefficient of its own" in told
