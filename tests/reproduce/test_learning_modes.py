"""Learned robots with all modes and with fewer."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.experiment_scripts import script

from pneumorph.study.training_options import PRESETS


def test_distances_are_compared_with_those_of_all_modes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One gait, in the nominal world and another."""
    module = script("learning_modes")
    crawling = module.KEPT["crawling"]
    one = replace(crawling, paths=crawling.paths[:1])
    monkeypatch.setitem(module.KEPT, "crawling", one)
    module.main("crawling", (8,), (0.0, 0.02), 1, tmp_path, tmp_path)
    content = json.loads((tmp_path / "crawling.json").read_text())["modes"]
    assert list(content) == ["40", "8", "8, 0.02"]
    whole, fewer, few_points = content.values()
    assert (whole["mean_change"], whole["deviation"], whole["time_share"]) == (0.0, 0.0, 1.0)
    assert few_points["points"] < fewer["points"] == whole["points"]
    assert few_points["mean_change"] not in (0.0, fewer["mean_change"])
    assert fewer["mean_change"] != 0.0
    assert fewer["time_share"] > 0.0
    (name,) = fewer["medians"]
    kept = json.loads((module.HERE / "crawling.json").read_text())
    assert name in kept["modes"]["24"]["medians"]


@pytest.mark.parametrize(("kept", "cavities"), [("crawling", 1), ("turning", 2), ("heading", 2)])
def test_what_trainings_rely_on_was_measured(kept: str, cavities: int) -> None:
    """With the modes and points that legs of so many chambers have while robots learn."""
    module, settings = script("learning_modes"), PRESETS["quick"]().coopt
    count = settings.learning_modes * cavities
    content = json.loads((module.HERE / f"{kept}.json").read_text())
    every = content["modes"][str(count)]
    assert every["worst_gait_change_percent"] < 6.0
    trained = content["modes"][f"{count}, {settings.learning_tolerance:g}"]
    assert trained["points"] < 0.75 * every["points"]
    assert trained["worst_gait_change_percent"] < 9.0
    for each in (every, trained):
        assert each["correlation"] > 0.9
        assert each["failed_count"] == 0
