"""How the runs of a campaign compare, and what its status says of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.study import campaign as campaigns
from pneumorph.study.campaign import Campaign, CampaignRun, CampaignSettings, campaign
from pneumorph.study.finished_run import FinishedRun

RUN = replace(
    example(CampaignRun), goal=FORWARD, best_design="1.0.0.2", best_distance_cm=3.0,
    best_achieved=3.0,
)  # fmt: skip
NONE = replace(RUN, best_design=None, best_distance_cm=None, best_achieved=None)
TURNING = replace(RUN, goal=Goal("turn_left", cm_per_unit=0.1), best_achieved=60.0)


def compared(
    found: dict[str, CampaignRun], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Campaign:
    """The campaign of runs VARIANT-SEED that have ended."""

    def read(path: Path) -> Any:
        return SimpleNamespace(result=lambda _: found[path.name])

    monkeypatch.setattr(campaigns, "_make", lambda *_: {})
    monkeypatch.setattr(FinishedRun, "read", read)
    variants, seeds = zip(*(name.split("-") for name in found), strict=True)
    files = [folder / f"{name}.json" for name in dict.fromkeys(variants) if name != "run"]
    for file in files:
        file.write_text("{}")
    settings = CampaignSettings(tuple(sorted(set(map(int, seeds)))), tuple(files))
    return campaign(settings, RunFolder(folder / "out", "campaign"))


@pytest.mark.parametrize("second", [RUN, NONE])
def test_a_run_without_a_robot_that_survived_has_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, second: CampaignRun
) -> None:
    found = compared({"run-0": RUN, "run-1": second}, tmp_path, monkeypatch)
    failed = second is NONE
    assert found.failures == ({"run-1": "no robot survived"} if failed else {})
    assert found.status == ("some runs failed" if failed else "completed")
    assert (found.best_run, len(found.runs)) == ("run-0", 2)


def test_runs_of_different_goals_have_no_best(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 degrees are not more than 3 cm; each variant has its own."""
    found = compared({"crawl-0": RUN, "turn-0": TURNING}, tmp_path, monkeypatch)
    assert (found.best_run, found.best_design, found.best_distance_cm) == (None, None, None)
    (note,) = found.notes
    assert "distance in crawl-0, turn to the left in turn-0" in note
    assert [each.most_best for each in found.variants.values()] == [3.0, 60.0]
    assert found.status == "completed"
    further = replace(TURNING, best_achieved=61.0)
    turned = compared({"turn-0": TURNING, "turn-1": further}, tmp_path, monkeypatch)
    assert (turned.best_run, turned.notes) == ("turn-1", ())
