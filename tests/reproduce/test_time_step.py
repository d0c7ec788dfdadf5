"""Learned robots with steps of two lengths."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.experiment_scripts import script


def test_distances_are_compared_with_the_first_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One gait, in the nominal world and another, where rounding moves it by a hair (0.01 cm)."""
    module = script("time_step")
    monkeypatch.setattr(module, "GAITS", module.GAITS[:1])
    module.main((0.01, 0.02), 1, tmp_path, tmp_path)
    usual, longer = json.loads((tmp_path / "distances.json").read_text())["steps"].values()
    kept = json.loads((module.HERE / "distances.json").read_text())["steps"]["0.01"]
    ((name, own),) = usual.items()
    assert own["nominal_cm"] == pytest.approx(kept[name]["nominal_cm"], abs=2.0)
    assert own["median_change_cm"] == 0.0
    changed = longer[name]
    assert changed["median_change_cm"] == pytest.approx(changed["median_cm"] - own["median_cm"])
    assert 0.0 < changed["median_absolute_change_cm"] < 20.0
