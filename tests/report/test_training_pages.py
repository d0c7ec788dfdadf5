"""A mean over drawn worlds never stands beside the expert's walk in one as if they were alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.environment.goal import FORWARD
from pneumorph.report import training_sections as told
from pneumorph.report.plan import paper_plan
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.training_result import TrainingResult


@pytest.fixture
def found() -> TrainingResult:
    """A training of two pairs whose certificate knows one of them."""
    found = example(TrainingResult)
    first, second = (
        replace(found.pairs[0], design=design, distance_cm=far, score_cm=far - 1.0, gait=None)
        for design, far in (("1.0.2.0.0.1", 12.25), ("1.2.0.0.2.1", 10.5))
    )
    certificate = example(Certificate)
    pair = replace(certificate.pairs[0], design=first.design, nominal=17.75)
    return replace(
        found,
        goal=FORWARD,
        pairs=(first, second),
        ranked_by="mean less 1 standard deviations of 4 worlds",
        randomisation={"friction": "U(0.25, 1.2)"},
        replayed_distance_cm=17.75,
        best_distance_cm=12.25,
        baseline_best_distance_cm=7.5,
        baseline_best_achieved=7.5,
        certificate=replace(certificate, pairs=(pair,)),
    )


class Run:
    """What sections ask of a run whose gaits are not there, and that does not tell how long walks
    are."""

    settings: Mapping[str, Any] = MappingProxyType({})
    source = None

    def design(self, place: str, regulator_count: int | None = None) -> None: ...


def table(found: TrainingResult) -> str:
    run: Any = Run()
    unused: Any = None
    (section,) = told.learned_pair_sections(found, run, unused)
    return section.body


def test_pairs_of_drawn_worlds_are_beside_what_they_do_in_the_experts(
    found: TrainingResult,
) -> None:
    page = table(found)
    assert "over the baseline" not in page
    assert "mean distance, worlds of the training" in page
    assert "world as it stands" in page
    for number in ("12.2", "17.8", "11.2"):
        assert number in page
    one = table(replace(found, randomisation=None, ranked_by=None))
    assert "over the baseline" in one
    assert "world as it stands" not in one


def test_the_sweep_shows_the_learned_pair_in_the_same_world(
    found: TrainingResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(told, "phase_figure", lambda *args: drawn.append(args))

    class Sheet:
        def drawn(self, *args: Any) -> str:
            return ""

    sheet: Any = Sheet()
    run: Any = Run()
    told.sweep_sections(found, run, sheet)
    told.sweep_sections(replace(found, replayed_distance_cm=None), run, sheet)
    assert [learned for _, _, learned, _ in drawn] == [17.75, 12.25]


def test_a_design_is_called_the_same_wherever_it_is_on_a_page(
    found: TrainingResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fine-tuning reorders what training saw; what it left behind has no name of another robot."""
    first, second = found.pairs
    left = replace(second, design="1.2.0.1.0.0", distance_cm=11.0)
    fine_tuned = replace(found, own_task=None, seen_pairs=(second, left, first))
    rounds = [
        {
            "timestep": 100,
            "best_distance_cm": 12.0,
            "return_mean_cm": 0.5,
            "design_entropy": 9.0,
            "design_entropy_target": 8.5,
            "score_histogram": [0.25, 0.75],
        }
    ]
    monkeypatch.setattr(told, "read_metrics", lambda *_: rounds)
    monkeypatch.setattr(told, "plans_of", lambda _: paper_plan)

    class Sheet:
        def drawn(self, name: str, figure: Any, caption: str) -> str:
            texts = [text.get_text() for axes in figure.axes for text in axes.texts]
            titles = [axes.get_title(loc="center") for axes in figure.axes]
            return " | ".join([*titles, *texts, caption])

    class TrainedRun(Run):
        folder, robot = Path(), None

    run: Any = TrainedRun()
    sheet: Any = Sheet()
    (section,) = told.training_sections(fine_tuned, run, sheet)
    drawn = section.body
    assert "L2: 10.5 cm | 11.0 cm | L1: 12.2 cm" in drawn
    assert "before fine-tuning. Those without a name are none of the best pairs." in drawn
    untuned = replace(fine_tuned, finetuning_timesteps=0)
    (section,) = told.training_sections(untuned, run, sheet)
    assert "Those without a name" in section.body
    assert "fine-tuning" not in section.body
    (section,) = told.training_sections(replace(fine_tuned, seen_pairs=()), run, sheet)
    assert "L1: 12.2 cm | L2: 10.5 cm" in section.body
    assert "fine-tuning" not in section.body
