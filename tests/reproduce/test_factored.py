"""Trainings that score designs either way, of a dozen actions each."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import pytest
from helpers.experiment_scripts import FEW_ACTIONS, call, script

from pneumorph.base.artefact import write_json


@pytest.mark.parametrize("preset", ["quick", "fast"])
def test_the_two_differ_in_how_designs_are_scored_alone(preset: str) -> None:
    one, other = (
        script("factored").options_of(preset, name, 3) for name in ("enumerated", "factored")
    )
    assert [f.name for f in fields(one) if getattr(one, f.name) != getattr(other, f.name)] == [
        "coopt"
    ]
    differ = [
        f.name
        for f in fields(one.coopt)
        if getattr(one.coopt, f.name) != getattr(other.coopt, f.name)
    ]
    assert differ == ["distribution"]
    assert not one.randomize
    assert one.coopt.objective.worlds_per_design == 1


def test_what_is_known_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = write_json(tmp_path / "short.json", FEW_ACTIONS)
    asked = ("--preset", "quick", "--work", tmp_path / "runs", "--out", tmp_path, "--threads", 1)
    for seed in (3, 4):
        call("factored", monkeypatch, *asked, "--seeds", seed, "--settings", settings)
    found = json.loads((tmp_path / "factored.json").read_text())["quick"]
    assert {name: list(rows) for name, rows in found.items()} == {
        "enumerated": ["3", "4"], "factored": ["3", "4"],
    }  # fmt: skip
    assert all(row["design"] for rows in found.values() for row in rows.values())
