"""No test begins once the time for tests is over, and where it may end long ones come last."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

LONG = "base/test_executor.py::test_impossible_settings_are_refused"
SHORT = "robot/test_design_space.py::test_impossible_spaces_are_refused"


@pytest.mark.parametrize(
    ("left_s", "ended"),
    [
        (float("inf"), ["long PASSED", "short PASSED"]),
        (-1.0, ["short SKIPPED", "long SKIPPED"]),
        (3600.0, ["short PASSED", "long PASSED"]),
    ],
)
def test_tests_begin_while_there_is_time(left_s: float, ended: list[str]) -> None:
    until_s = str(time.time() + left_s)
    environment = {**os.environ, "PNEUMORPH_TESTS_UNTIL_S": until_s}
    program = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", SHORT, LONG]
    done = subprocess.run(
        program, env=environment, cwd=Path(__file__).parent, capture_output=True, text=True
    )
    told = re.findall(r"(\S+) (PASSED|SKIPPED|FAILED)", done.stdout)
    names = {SHORT: "short", LONG: "long"}
    assert [f"{names[test.removeprefix('tests/')]} {how}" for test, how in told] == ended
