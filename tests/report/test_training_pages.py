"""A mean over drawn worlds never stands beside the expert's walk in one as if they were alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import FORWARD
from pneumorph.environment.reward import RewardWeights
from pneumorph.report import training_sections as told
from pneumorph.report.certificate_sections import _band_table
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
        own_task=None,
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


def learned_in_sweeps(
    monkeypatch: pytest.MonkeyPatch, *trainings: TrainingResult
) -> list[float | None]:
    """How far the learned pair goes in the figure of each training's sweep; None without its
    line."""
    drawn: list[Any] = []
    monkeypatch.setattr(told, "phase_figure", lambda *args: drawn.append(args))

    class Sheet:
        def drawn(self, *args: Any) -> str:
            return ""

    sheet: Any = Sheet()
    run: Any = Run()
    for each in trainings:
        told.sweep_sections(each, run, sheet)
    return [learned for _, _, learned, _ in drawn]


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


def test_pairs_of_a_task_of_ones_own_are_not_beside_the_expert(
    found: TrainingResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = replace(found, own_task="Diagonal", randomisation=None)
    page = table(own)
    assert "over the baseline" not in page
    assert "score (cm)" in page
    certificate = own.certificate
    assert certificate is not None
    assert "beyond the expert" not in _band_table(certificate, is_compared=False)
    assert "beyond the expert" in _band_table(certificate)
    assert learned_in_sweeps(monkeypatch, own) == [None]


@pytest.mark.parametrize(
    ("own_task", "tilt", "axis", "told_of_it"),
    [
        ("Diagonal", 0.0, "reward of Diagonal (cm)", "Reward of Diagonal of each round"),
        (None, 0.05, "reward and distance (cm)", "What is grey is rewards"),
        (None, 0.0, "forward distance (cm)", "Distance of each round"),
    ],
)
def test_the_figure_of_a_training_says_what_its_rewards_are(
    own_task: str | None,
    tilt: float,
    axis: str,
    told_of_it: str,
    found: TrainingResult,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    round_of = {"timestep": 100, "best_distance_cm": 12.0, "return_mean_cm": 0.5,
                "return_maximum_cm": 2.0, "design_entropy": 9.0, "design_entropy_target": 8.5,
                "score_histogram": [0.25, 0.75]}  # fmt: skip
    monkeypatch.setattr(told, "read_metrics", lambda *_: [round_of])
    monkeypatch.setattr(told, "plans_of", lambda _: paper_plan)
    monkeypatch.setattr(told, "durations_apart", lambda _: None)

    class Sheet:
        def drawn(self, name: str, figure: Any, caption: str) -> str:
            labels = [axes.get_ylabel() for axes in figure.axes]
            legends = [text.get_text() for each in figure.legends for text in each.get_texts()]
            return " | ".join([*labels, *legends, caption])

    class TrainedRun(Run):
        folder, robot = Path(), None
        settings = MappingProxyType({"coopt": {}})
        task = CrawlingTask(reward=RewardWeights(tilt=tilt))

    run: Any = TrainedRun()
    sheet: Any = Sheet()
    (section,) = told.training_sections(
        replace(found, own_task=own_task, seen_pairs=()), run, sheet
    )
    assert axis in section.body
    assert told_of_it in section.body
    assert ("expert's best phase" in section.body) is (own_task is None)


def test_the_sweep_shows_the_learned_pair_in_the_same_world(
    found: TrainingResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    without = replace(found, replayed_distance_cm=None)
    assert learned_in_sweeps(monkeypatch, found, without) == [17.75, 12.25]


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
