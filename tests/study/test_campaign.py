"""How the runs of a campaign compare, and what its status says of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.physics.physics import Physics
from pneumorph.study import campaign as campaigns
from pneumorph.study.campaign import Campaign, CampaignSettings, campaign
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult

RUN = replace(
    example(TrainingResult), goal=FORWARD, best_design="1.0.0.2", best_distance_cm=3.0,
    best_achieved=3.0,
)  # fmt: skip
NONE = replace(RUN, best_design=None, best_distance_cm=None, best_achieved=None)
TURNING = replace(RUN, goal=Goal("turn_left", cm_per_unit=0.1), best_achieved=60.0)


def compared(
    found: dict[str, TrainingResult],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    asked: Mapping[str, str] | None = None,
) -> Campaign:
    """The campaign of runs VARIANT-SEED that have ended, whose variants say what is asked."""

    def read(path: Path) -> Any:
        return SimpleNamespace(result=lambda _: found[path.name])

    monkeypatch.setattr(campaigns, "_make", lambda *_: {})
    monkeypatch.setattr(FinishedRun, "read", read)
    variants, seeds = zip(*(name.split("-") for name in found), strict=True)
    files = [folder / f"{name}.json" for name in dict.fromkeys(variants) if name != "run"]
    for file in files:
        file.write_text((asked or {}).get(file.stem, "{}"))
    settings = CampaignSettings(tuple(sorted(set(map(int, seeds)))), tuple(files))
    return campaign(settings, RunFolder(folder / "out", "campaign"))


@pytest.mark.parametrize("second", [RUN, NONE])
def test_a_run_without_a_robot_that_survived_has_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, second: TrainingResult
) -> None:
    found = compared({"run-0": RUN, "run-1": second}, tmp_path, monkeypatch)
    failed = second is NONE
    assert found.failures == ({"run-1": "no robot survived"} if failed else {})
    assert found.status == ("some runs failed" if failed else "completed")
    assert (found.best_run, len(found.runs)) == ("run-0", 2)


def test_the_best_run_is_that_of_the_highest_score(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where pairs are ranked by a mean less a deviation, a longer mean may be the lesser robot."""
    (pair,) = RUN.pairs
    sure = replace(RUN, pairs=(replace(pair, score_cm=2.0),))
    far = replace(RUN, best_achieved=5.0, pairs=(replace(pair, score_cm=1.0),))
    assert compared({"run-0": sure, "run-1": far}, tmp_path, monkeypatch).best_run == "run-0"
    plain = [replace(run, ranked_by=None) for run in (sure, far)]
    by_distance = compared({"run-0": plain[0], "run-1": plain[1]}, tmp_path, monkeypatch)
    assert by_distance.best_run == "run-1"


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


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"physics": Physics(friction=0.3)}, "their physics differ (first-0, second-0)"),
        ({"ranked_by": None}, "ranked by differ (text in first-0, distance in one world in seco"),
        ({"randomisation": None}, "their distributions of worlds differ (first-0, second-0)"),
        ({"randomisation": {"friction": "0.3"}}, "their distributions of worlds differ"),
    ],
)
def test_runs_in_other_worlds_have_no_best(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: dict[str, Any], said: str
) -> None:
    """A robot on ice or in the nominal world is no better for the distance it comes there."""
    further = replace(RUN, best_distance_cm=5.0, best_achieved=5.0)
    runs = {"first-0": RUN, "second-0": replace(further, **other)}
    found = compared(runs, tmp_path, monkeypatch)
    assert (found.best_run, found.best_design, found.best_distance_cm) == (None, None, None)
    assert said in found.notes[0]
    assert [each.most_best for each in found.variants.values()] == [3.0, 5.0]


@pytest.mark.parametrize(
    "asked",
    [
        '{"coopt": {"task": {"action_count": 40}}}',
        '{"coopt": {"task": {"action_step_count": 200}}}',
        '{"robot": {"physics": {"time_step_s": 0.02}}}',
    ],
)
def test_runs_that_walk_for_longer_have_no_best(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: str
) -> None:
    further = replace(RUN, best_distance_cm=5.0, best_achieved=5.0)
    runs = {"short-0": RUN, "long-0": further}
    found = compared(runs, tmp_path, monkeypatch, {"long": asked})
    assert (found.best_run, found.best_design, found.best_distance_cm) == (None, None, None)
    assert "durations of walks differ (20 s in short-0, 40 s in long-0)" in found.notes[0]


def test_actions_of_another_length_in_the_same_time_compare(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    further = replace(RUN, best_distance_cm=5.0, best_achieved=5.0)
    asked = '{"coopt": {"task": {"action_count": 40, "action_step_count": 50}}}'
    runs = {"usual-0": RUN, "other-0": further}
    found = compared(runs, tmp_path, monkeypatch, {"other": asked})
    assert (found.best_run, found.notes) == ("other-0", ())


def test_how_many_worlds_were_learned_in_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = {"friction": "U(0.5, 1)", "world_count": 4}
    few = replace(RUN, randomisation=drawn)
    many = replace(RUN, best_achieved=5.0, randomisation={**drawn, "world_count": 8})
    found = compared({"few-0": few, "many-0": many}, tmp_path, monkeypatch)
    assert (found.best_run, found.notes) == ("many-0", ())
