"""Progress says how long is left, and stays out of a log's way."""

from __future__ import annotations

import io

import pytest

from pneumorph.base import progress
from pneumorph.base.progress import Progress, clock


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Seconds of a clock that a test sets."""
    seconds = [1000.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: seconds[0])
    return seconds


def test_time_left_is_in_proportion(now: list[float]) -> None:
    terminal = Terminal()
    shown = Progress(terminal)
    shown.stage("training")
    shown(0, 100)
    now[0] += 30.0
    shown(25, 100, "best 3.2 cm")
    assert terminal.getvalue().endswith("best 3.2 cm:  25 %, 0:30 spent, 1:30 left")


def test_a_resumed_run_counts_from_where_it_began(now: list[float]) -> None:
    terminal = Terminal()
    shown = Progress(terminal)
    shown.stage("training")
    shown(60, 100)
    now[0] += 20.0
    shown(80, 100)
    assert terminal.getvalue().endswith("80 %, 0:20 spent, 0:20 left")


def test_other_work_of_a_stage_takes_its_own_time(now: list[float]) -> None:
    terminal = Terminal()
    shown = Progress(terminal)
    shown.stage("learning")
    shown(0, 100, "training")
    now[0] += 900.0
    shown(100, 100, "training")
    shown(0, 50, "fine-tuning")
    now[0] += 10.0
    shown(10, 50, "fine-tuning")
    assert terminal.getvalue().endswith("fine-tuning:  20 %, 0:10 spent, 0:40 left")


def test_as_much_work_again_is_other_work(now: list[float]) -> None:
    """Two loops of as many worlds, the first of which is told after its first share."""
    terminal = Terminal()
    shown = Progress(terminal)
    shown.stage("walking")
    for _ in range(2):
        for done in (40, 80, 120, 160, 200):
            now[0] += 10.0
            shown(done, 200)
            if done == 120:
                assert terminal.getvalue().rsplit("spent, ", 1)[1] == "0:20 left"


def test_a_log_gets_a_line_now_and_then(now: list[float]) -> None:
    log = io.StringIO()
    shown = Progress(log)
    shown.stage("filming")
    for done in range(101):
        shown(done, 100)
        now[0] += 0.5
    lines = log.getvalue().splitlines()
    assert lines[0] == "filming ..."
    assert 4 <= len(lines) <= 7  # 50 s at a line every 10 s
    assert "\r" not in log.getvalue()


def test_quiet_prints_nothing() -> None:
    log = io.StringIO()
    shown = Progress(log, quiet=True)
    shown.stage("a")
    shown(1, 1)
    assert log.getvalue() == ""


def test_clock() -> None:
    assert [clock(s) for s in (0.2, 61, 3725)] == ["0:00", "1:01", "1:02:05"]


def test_a_closed_standard_error_gets_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And what was meant for it does not go to the output."""
    monkeypatch.setattr("sys.stderr", None)
    shown = Progress()
    shown.stage("a")
    shown(1, 1)
    assert capsys.readouterr().out == ""
