"""A pytest plugin: which lines of the package each test runs, and for how long.

What a file's fixtures run counts for each of its tests. `mutation_run.py` loads it.
"""

from __future__ import annotations

import json
import os
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

OUT = "MUTATION_MAP"

_watch = coverage.Coverage(data_file=None, source=["pneumorph"], messages=False)
_watch.start()
_seconds: dict[str, float] = defaultdict(float)
_failed: set[str] = set()


def _phase(item: pytest.Item, own: bool) -> Iterator[None]:
    _watch.switch_context(item.nodeid if own else item.nodeid.split("::")[0])
    began = time.process_time()
    yield
    _seconds[item.nodeid] += time.process_time() - began


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Count for the file."""
    yield from _phase(item, own=False)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Count for the test."""
    yield from _phase(item, own=True)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Remember what fails without any mistake in it."""
    if not report.passed:
        _failed.add(report.nodeid)


def pytest_sessionfinish() -> None:
    """Write {test file: {test: {"s": seconds, "lines": {file: [line]}}}}."""
    _watch.stop()
    data = _watch.get_data()
    run: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for path in data.measured_files():
        relative = os.path.relpath(path)
        for line, contexts in data.contexts_by_lineno(path).items():
            for context in contexts:
                run[context][relative].append(line)
    found: dict[str, dict[str, object]] = defaultdict(dict)
    for test in sorted(set(_seconds) - _failed):
        lines = {path: set(numbers) for path, numbers in run[test].items()}
        for path, numbers in run[test.split("::")[0]].items():
            lines.setdefault(path, set()).update(numbers)
        found[test.split("::")[0]][test] = {
            "s": round(_seconds[test], 3),
            "lines": {path: sorted(numbers) for path, numbers in lines.items()},
        }
    Path(os.environ[OUT]).write_text(json.dumps(found))
