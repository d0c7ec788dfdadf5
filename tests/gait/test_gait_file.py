"""A gait survives its file, and files that are no gait are refused."""

from pathlib import Path

import numpy as np
import pytest

from pneumorph.gait.gait_file import gait_remarks, read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait

HEADER = "time_s,regulator_1_kPa,regulator_2_kPa\n"


def test_round_trip_is_exact(tmp_path: Path) -> None:
    gait = HeldGait.evenly(np.random.default_rng(0).uniform(0, 90, (20, 3)), hold_s=1.0)
    path = write_gait(tmp_path / "gait.csv", gait, {"design": "1.0.0.2.2.0.0.1"})
    read, comments = read_gait(path)
    np.testing.assert_array_equal(read.held_kPa, gait.held_kPa)
    np.testing.assert_array_equal(read.start_s, gait.start_s)
    assert read.duration_s == gait.duration_s
    assert comments == {"design": "1.0.0.2.2.0.0.1"}
    text = path.read_text().splitlines()
    assert text[1] == "time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa"
    assert len(text) == 2 + 21


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "with nothing"),
        ("time,p1\n0,1\n1,1\n", "units are part of it"),
        ("0,1,2\n1,1,2\n", "expected the header"),
        (HEADER + "0,10,20\n", "has 1 rows, expected at least 2"),
        (HEADER + "0,10,20\n1,10\n", "has 2 numbers, expected 3"),
        (HEADER + "0,10,twenty\n1,10,20\n", "row '0,10,twenty'"),
        (HEADER + "0,10,nan\n1,10,nan\n", r"pressure_kPa\[0, 1\] is nan"),
        (HEADER + "0,inf,20\n1,inf,20\n", r"pressure_kPa\[0, 0\] is inf"),
        (HEADER + "0,10,120\n1,10,120\n", r"pressure_kPa\[0, 1\] is 120\.0, .* from 0 to 90"),
        (HEADER + "1,10,20\n0,15,20\n", "rise|increas|later"),
        (HEADER + "0,0.09,0.02\n1,0.09,0.02\n", r"go up to 0\.09 kPa, .* may be in MPa"),
        (
            HEADER + "0,10,20\n0.5,15,20\n",
            "new command at 0.5 s .* append the line 1,15,20 to hold",
        ),
        (
            HEADER + "0,10,20\n2,5,5\n1,5,5\n",
            "row 3: time_s is 1 after 2, expected times that",
        ),
    ],
)
def test_files_that_are_no_gait_are_refused(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(content)
    with pytest.raises(ValueError, match=message):
        read_gait(path)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere\.csv does not exist"):
        read_gait(tmp_path / "nowhere.csv")


@pytest.mark.parametrize(("highest", "named"), [(200.0, True), (60.0, False)])
def test_a_gait_without_a_limit_is_read_back(highest: float, named: bool, tmp_path: Path) -> None:
    """Its file names the highest of its pressures, where that is above the usual limit."""
    held = np.array([[10.0, 0.0], [highest, 5.0]])
    gait = HeldGait(np.array([0.0, 1.0]), held, 2.0, maximum_pressure_kPa=np.inf)
    path = write_gait(tmp_path / "gait.csv", gait)
    read, _ = read_gait(path)
    np.testing.assert_array_equal(read.held_kPa, held)
    assert read.maximum_pressure_kPa == (highest if named else 90.0)
    assert ("maximum" in path.read_text()) is named


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [
        ("design", "1.0.0.2.2.0.0.1", "0.0.1.2.1.0.0.0"),
        ("maximum_pressure_kPa", "120", "100"),
        ("kPa_per_unit", "1.0", "6.894757"),
    ],
)
def test_a_comment_that_is_read_has_one_value(
    name: str, one: str, other: str, tmp_path: Path
) -> None:
    path = tmp_path / "two.csv"
    rows = HEADER + "0,10,20\n1,10,20\n"
    path.write_text(f"# {name}: {one}\n\n# of two files\n#{name}: {other}\n{rows}")
    told = rf"two\.csv: {name} is '{one}' in line 1 and '{other}' in line 4, expected one value"
    for read in (read_gait, gait_remarks):
        with pytest.raises(ValueError, match=told):
            read(path)
    path.write_text(f"# {name}: {one}\n# {name}: {one}\n{rows}")
    assert read_gait(path)[1] == gait_remarks(path) == {name: one}


def test_comments_of_ones_own_may_be_repeated(tmp_path: Path) -> None:
    path = tmp_path / "notes.csv"
    path.write_text(f"# note: first\n# note: second\n{HEADER}0,10,20\n1,10,20\n")
    assert read_gait(path)[1] == {"note": "second"}
