"""The mistakes of the mutation run are where they should be, one at a time."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCE = '''"""A 1 + 1 in a docstring."""
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    import os
LIMIT: "int | None" = 7

def far(x, y=2.5):
    """Far."""
    if len(x) < 3:
        raise ValueError(f"{len(x) + 1} of 3")
    note(x)
    total = x[0].T - y
    return total if total <= y else max(x)
'''


@pytest.fixture
def mutants(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import mutants

    yield mutants
    sys.modules.pop("mutants")


def test_each_mutant_changes_one_thing_that_runs(mutants) -> None:
    found = mutants.mutants_of("far.py", SOURCE.encode())
    assert [(each.line, each.was, each.becomes) for each in found] == [
        (3, "TYPE_CHECKING", "(not TYPE_CHECKING)"),  # what is below it is left alone
        (5, "7", "8"),
        (7, "2.5", "3.5"),
        (9, "len(x) < 3", "(len(x) <= 3)"),  # a count: its limit
        (9, "3", "4"),
        (10, 'raise ValueError(f"{len(x) + 1} of 3")', "pass"),
        (11, "note(x)", "pass"),
        (12, "x[0].T - y", "(x[0].T + y)"),
        (12, "x[0].T", "(x[0])"),
        (12, "0", "1"),
        (13, "total if total <= y else max(x)", "(total if not total <= y else max(x))"),
        (13, "total <= y", "(total > y)"),  # two floating-point numbers: the other way round
        (13, "max(x)", "(min(x))"),
    ]
    for each in found:
        changed = each.applied(SOURCE.encode()).decode()
        compile(changed, "far.py", "exec")
        assert changed.replace(each.becomes, "", 1) != SOURCE
        assert len(changed) - len(each.becomes) == len(SOURCE) - len(each.was)


def test_a_mutant_knows_the_lines_that_must_run_for_it(mutants) -> None:
    """Of a condition those before its body, of a statement all of its lines."""
    text = ["def far(x):", "    if (", "        x > 1", "    ):", "        return [", "2", "]"]
    source = "\n".join(text).encode()
    lines = {each.was: set(each.lines) for each in mutants.mutants_of("far.py", source)}
    assert lines == {"x > 1": {2, 3, 4}, "1": {2, 3, 4}, "2": {5, 6, 7}}


def test_each_equivalent_mutant_is_one_of_today(mutants) -> None:
    listed = json.loads((ROOT / "benchmarks" / "equivalent_mutants.json").read_text())
    for each in listed:
        source = (ROOT / each["path"]).read_bytes()
        found = mutants.mutants_of(each["path"], source)
        assert any(mutant.is_one_of([each], source) for mutant in found), each["statement"]
        assert each["why"]


def test_each_mistake_in_the_engine_has_one_place() -> None:
    """What is compiled with the mistakes is the engine of today."""
    mistakes = json.loads((ROOT / "benchmarks" / "engine_mutants.json").read_text())
    assert len({each["name"] for each in mistakes}) == len(mistakes)
    for each in mistakes:
        within = each.get("within", each["was"])
        assert (ROOT / each["file"]).read_text().count(within) == 1, each["name"]
        assert within.count(each["was"]) == 1, each["name"]
        assert all((ROOT / test).exists() for test in each["tests"]), each["name"]
