"""Some hundred calls with values that nobody should ask for: each ends with a message.

`python -m helpers.command_line_fuzz` makes them all.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.command_line_fuzz import all_calls, draw, ground, make_call

from pneumorph.cli import VERBS


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ground(tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("verb", VERBS)
def test_calls_without_sense_end_with_a_message(verb: str, folder: Path) -> None:
    calls = [each for each in all_calls(folder) if each[0][0] == verb]
    made = [make_call(*each, folder) for each in draw(calls, 8, seed=2)]
    assert [call for call in made if call.failed] == []
    assert any(call.ended != 0 for call in made)
    assert not any("Traceback" in call.said for call in made)


def test_a_traceback_is_seen(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pneumorph.exchange.conversion.read_gait", lambda *_: 1 / {}["nothing"])
    gait = folder / "run" / "training" / "gaits" / "L1.csv"
    call = make_call(("exchange", str(gait)), True, folder)
    assert call.failed
    assert "KeyError" in str(call.ended)
