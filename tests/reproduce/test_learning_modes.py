"""Learned robots with all modes and with fewer."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.experiment_scripts import script


def test_distances_are_compared_with_those_of_all_modes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One gait, in the nominal world and another."""
    module = script("learning_modes")
    monkeypatch.setattr(module, "GAITS", module.GAITS[:1])
    module.main((8,), 1, tmp_path, tmp_path)
    whole, fewer = json.loads((tmp_path / "distances.json").read_text())["modes"].values()
    assert (whole["mean_change_cm"], whole["deviation_cm"], whole["time_share"]) == (0.0, 0.0, 1.0)
    assert fewer["mean_change_cm"] != 0.0
    assert fewer["time_share"] > 0.0
    (name,) = fewer["medians_cm"]
    kept = json.loads((module.HERE / "distances.json").read_text())
    assert name in kept["modes"]["24"]["medians_cm"]
    # What training relies on.
    trained = kept["modes"]["24"]
    assert trained["correlation"] > 0.9
    assert trained["worst_gait_change_percent"] < 6.0
    assert trained["failed_count"] == 0
