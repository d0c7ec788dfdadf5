"""Every study's result is saved and read back equal; damage is refused by file and field."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any, get_args

import pytest
from helpers.result_example import example

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.result import load_result, result_from_dict, result_to_dict, save_result
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.settings import CooptSettings
from pneumorph.report.verb_pages import PAGES
from pneumorph.study.baseline import BestPhase
from pneumorph.study.comparison import Comparison, Kind, NodeErrors
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.search_findings import SearchCurve, SearchFindings
from pneumorph.study.survived import NONE_SURVIVED
from pneumorph.study.training_options import PRESETS
from pneumorph.study.training_result import TrainingResult, fields_of_learned
from pneumorph.study.training_run import _too_short, _untaught

RESULTS = sorted(
    {page.result for page in PAGES.values() if dataclasses.is_dataclass(page.result)}
    | {NodeErrors, SearchCurve},
    key=lambda kind: kind.__name__,
)


@pytest.mark.parametrize("kind", RESULTS)
def test_a_result_is_read_back_as_it_was(kind: type[Any], tmp_path: Path) -> None:
    result = example(kind)
    path = save_result(tmp_path / "result.json", result)
    again = load_result(kind, path)
    # Arrays have no one truth of being equal: their values as JSON do.
    assert result_to_dict(again) == result_to_dict(result)
    assert type(again) is kind
    if kind.__name__ != "Evaluation":  # it has an array
        assert again == result


def test_a_number_that_is_not_finite_is_read_as_nan(tmp_path: Path) -> None:
    curve = SearchCurve((10, 20), (1.0, 2.0), (float("nan"), 3.0))
    again = load_result(SearchCurve, save_result(tmp_path / "curve.json", curve))
    assert math.isnan(again.best_achieved[0])
    assert again.best_achieved[1] == 3.0


def test_means_are_written_beside_the_errors_they_follow_from() -> None:
    content = result_to_dict(example(Comparison))
    for kind in get_args(Kind):
        error = content[kind]["name"]
        assert content[f"{kind}_mean_node_error_mm"] == error["mean_node_error_mm"]
        assert content[f"{kind}_worst_distance_error_cm"] == 0.0


@pytest.mark.parametrize("verb", [v for v, page in PAGES.items() if page.result in RESULTS])
def test_a_damaged_summary_is_refused_by_file_and_field(verb: str, tmp_path: Path) -> None:
    kind = PAGES[verb].result
    (tmp_path / "settings.json").write_text("{}")
    content = {"verb": verb.split()[0], **result_to_dict(example(kind))}
    needed = [
        field.name
        for field in dataclasses.fields(kind)
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    ]
    for name in needed:
        left = {key: value for key, value in content.items() if key != name}
        (tmp_path / "summary.json").write_text(json.dumps(left))
        with pytest.raises(
            ArtefactError, match=rf"summary\.json: it is no {kind.__name__}.*{name}"
        ):
            FinishedRun.read(tmp_path).result(kind)
    number = next(name for name in needed if isinstance(content[name], float))
    (tmp_path / "summary.json").write_text(json.dumps({**content, number: "far"}))
    with pytest.raises(ArtefactError, match=number):
        FinishedRun.read(tmp_path).result(kind)


def test_a_training_that_ended_before_it_learned_says_so() -> None:
    found, settings = example(CooptResult), CooptSettings()
    assert _untaught(found, settings) == []
    (note,) = _untaught(dataclasses.replace(found, update_count=0, timesteps=96), settings)
    assert note.startswith("nothing was learned: 96 timesteps are not more than learning_start")


def test_what_a_training_is_too_short_for_is_told_before_it_begins() -> None:
    quick = PRESETS["quick"]().coopt
    assert _too_short(quick) == []
    told = _too_short(dataclasses.replace(quick, total_timesteps=500))
    assert [note.split(":")[0] for note in told] == [
        "nothing will be learned",
        "designs will not be narrowed to the end",
        "robots will learn in the nominal world alone",
    ]
    assert "there are 960 timesteps" in told[0]  # whole rounds


def test_a_training_without_a_best_pair_is_none_that_was_completed() -> None:
    learned = example(CooptResult)
    assert fields_of_learned(dataclasses.replace(learned, pairs=()))["status"] == NONE_SURVIVED
    best = learned.pairs[0]
    assert best is not None
    assert fields_of_learned(learned)["status"] == "completed"


@pytest.mark.parametrize("kind", [Evaluation, SearchFindings, TrainingResult])
def test_results_of_before_there_was_a_status_were_completed(kind: type[Any]) -> None:
    content = result_to_dict(dataclasses.replace(example(kind), status=NONE_SURVIVED))
    assert result_from_dict(kind, content).status == NONE_SURVIVED
    del content["status"]
    assert result_from_dict(kind, content).status == "completed"


@pytest.mark.parametrize(
    ("phases", "best", "told"),
    [
        ((0.0, 90.0, 180.0), 180.0, True),
        ((0.0, 90.0, 180.0), 90.0, False),
        ((0.0, 90.0, 180.0, 270.0), 270.0, False),  # the whole circle has no end
        ((60.0,), 60.0, False),  # nobody asked for a range
    ],
)
def test_a_best_phase_at_an_end_of_those_that_were_tried_is_told(
    phases: tuple[float, ...], best: float, told: bool
) -> None:
    found = BestPhase(
        baseline_best_distance_cm=1.0,
        baseline_best_phase_deg=best,
        phases_deg=phases,
        distances_cm=(1.0,) * len(phases),
    )
    assert bool(found.expert_notes) == told
