"""An expert that walked in another physics is not compared with robots of this one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.base.result import result_to_dict
from pneumorph.environment.goal import FORWARD
from pneumorph.physics.physics import Physics
from pneumorph.report.expert_words import expert_elsewhere
from pneumorph.report.run_page import _headline
from pneumorph.report.training_sections import evaluation_sections
from pneumorph.report.verb_pages import PAGES
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult

TRAINED_IN = Physics(friction=0.8)
SLIPPERY = replace(TRAINED_IN, friction=0.3)


def evaluated(
    folder: Path, own_task: str | None = None, **changed: Any
) -> tuple[Evaluation, FinishedRun]:
    """An evaluation of a training whose expert went 7.6 cm."""
    trained = replace(
        example(TrainingResult),
        goal=FORWARD,
        own_task=own_task,
        baseline_best_distance_cm=7.6,
        baseline_best_achieved=7.6,
        physics=TRAINED_IN,
        damping="published",
    )
    source = folder / "trained"
    source.mkdir()
    content = {"verb": "coopt", **result_to_dict(trained)}
    (source / "summary.json").write_text(json.dumps(content))
    (source / "settings.json").write_text("{}")
    found = example(Evaluation)
    pair = replace(found.pairs[0], design="1.0.0.2.2.0.0.1", gait="", distance_cm=10.0)
    told = {"physics": TRAINED_IN, "model": "reduced", "damping": "published", **changed}
    found = replace(
        found, run=str(source), goal=FORWARD, robustness=None, pairs=(pair,), **told
    )  # fmt: skip
    return found, FinishedRun(folder, {"verb": "evaluate", **result_to_dict(found)}, {})


def told(found: Evaluation, run: FinishedRun) -> str:
    unused: Any = None
    sections = evaluation_sections(found, run, unused)
    return _headline(found, run, PAGES["evaluate"], FORWARD) + sections[0].body


def test_pairs_that_learned_another_task_are_not_told_over_the_expert(tmp_path: Path) -> None:
    found, run = evaluated(tmp_path, own_task="Diagonal")
    page = told(found, run)
    assert "over the baseline" not in page
    assert "expert" not in page
    assert "distance of the best pair" in page


def test_in_the_same_physics_pairs_are_told_over_the_expert(tmp_path: Path) -> None:
    found, run = evaluated(tmp_path)
    page = told(found, run)
    assert expert_elsewhere(run) == ""
    assert "<b>7.6 cm</b><span>the expert&#x27;s best phase in the world as it stands" in page
    assert "over the baseline" in page
    assert "<td>B</td>" in page
    assert "2.4" in page


@pytest.mark.parametrize(
    ("changed", "where"),
    [
        ({"physics": SLIPPERY}, "in the training's physics"),
        ({"model": "full"}, "in the training's physics, reduced"),
        ({"physics": None, "damping": "measured"}, "in the training's physics"),
    ],
)
def test_in_another_physics_the_expert_is_told_as_of_the_trainings(
    changed: dict[str, Any], where: str, tmp_path: Path
) -> None:
    found, run = evaluated(tmp_path, **changed)
    assert expert_elsewhere(run) == where
    page = told(found, run).replace("&#x27;", "'")
    assert f"<b>7.6 cm</b><span>the expert's best phase {where}</span>" in page
    assert f"<td>B, {where}</td>" in page
    assert "as it stands" not in page
    assert "over the baseline" not in page
    assert "2.4" not in page


def test_an_evaluation_that_knows_its_damping_alone_is_compared_by_it(tmp_path: Path) -> None:
    """Those of earlier versions."""
    _, run = evaluated(tmp_path, physics=None)
    assert expert_elsewhere(run) == ""
