"""What stands first on each verb's page is what its result has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args, get_type_hints

import pytest
from helpers.result_example import example

from pneumorph.environment.goal import Goal
from pneumorph.report.certificate_sections import _band_table
from pneumorph.report.experiment_sections import analysis_sections, campaign_sections
from pneumorph.report.verb_pages import EXPERT, PAGES, HeadlineNumber
from pneumorph.study.analysis import Analysis
from pneumorph.study.baseline import BestPhase
from pneumorph.study.campaign import Campaign, CampaignRun
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.simulated_walk import SimulatedWalk

SHOWN = [
    *((page.result, number) for page in PAGES.values() for number in page.headline),
    *((BestPhase, number) for number in EXPERT),
]


def type_of(kind: Any, attribute: str) -> set[Any]:
    """The types of an attribute of a dataclass, fields and properties of its parts followed."""
    name, _, rest = attribute.partition(".")
    member = getattr(kind, name, None)
    of = get_type_hints(member.fget)["return"] if isinstance(member, property) else None
    types = {of or get_type_hints(kind)[name]}
    types = {each for kind in types for each in get_args(kind) or (kind,)} - {type(None)}
    if not rest:
        return types
    (part,) = types
    return type_of(part, rest)


@pytest.mark.parametrize(
    ("result", "number"),
    SHOWN,
    ids=lambda each: each.attribute if isinstance(each, HeadlineNumber) else each.__name__,
)
def test_a_headline_number_is_a_value_of_the_result(result: Any, number: HeadlineNumber) -> None:
    (kind,) = type_of(result, number.attribute)
    assert kind in (str, int, float)
    assert number.pattern.format(kind(1))
    if number.achieved:
        assert type_of(result, number.achieved) == {float}


def test_a_value_that_is_not_known_is_not_shown() -> None:
    sweep = example(BestPhase)
    distance = EXPERT[0]
    assert distance.said(sweep) == (
        "the expert's best phase in the world as it stands",
        f"{sweep.baseline_best_distance_cm:.1f} cm",
    )
    turn = Goal("turn_left", cm_per_unit=0.1)
    assert distance.said(sweep, turn) == (
        "turn to the left of the expert's best phase in the world as it stands",
        f"{sweep.best_achieved_by_expert:.0f}°",
    )
    object.__setattr__(sweep, "baseline_best_distance_cm", float("nan"))
    assert distance.said(sweep) is None


def test_the_first_number_of_a_turning_robot_is_its_turn() -> None:
    turn = Goal("turn_left", cm_per_unit=0.1)
    walk = replace(example(SimulatedWalk), distance_cm=1.25, achieved=47.9, goal=turn)
    first = PAGES["simulate"].headline[0]
    assert first.said(walk, turn) == ("turn to the left of the robot", "48°")
    assert first.said(walk) == ("distance", "1.2 cm")
    assert first.said(replace(walk, achieved=None), turn) is None


def test_the_first_number_of_a_campaign_is_of_its_best_runs_goal() -> None:
    turn = Goal("turn_left", cm_per_unit=0.1)
    run = replace(
        example(CampaignRun), name="run-0", goal=turn, best_achieved=47.9, in_drawn_worlds=False
    )
    found = replace(
        example(Campaign),
        best_run="run-1",
        best_distance_cm=1.25,
        runs=(run, replace(run, name="run-1", best_achieved=61.2)),
    )
    first = PAGES["campaign"].headline[0]
    assert first.said(found) == ("turn to the left of the best pair", "61°")
    crawled = replace(found, runs=(replace(run, name="run-1", goal=Goal()),))
    assert first.said(crawled) == ("distance of the best pair", "1.2 cm")
    none = replace(found, best_run=None, best_distance_cm=None)
    assert first.said(none) is None
    drawn = replace(found, runs=tuple(replace(each, in_drawn_worlds=True) for each in found.runs))
    over = "of the best pair, mean over the training's worlds"
    assert first.said(drawn) == (f"turn to the left {over}", "61°")


def test_what_runs_of_different_goals_achieved_has_its_unit_beside_it() -> None:
    """And no column says that degrees are centimetres."""
    crawl = replace(
        example(CampaignRun), goal=Goal(), best_achieved=3.0, baseline_best_distance_cm=1.0,
        ranked_by=None, in_drawn_worlds=False,
    )  # fmt: skip
    turn = replace(crawl, goal=Goal("turn_left", cm_per_unit=0.1), best_achieved=61.0)
    found = replace(example(Campaign), runs=(crawl, turn))
    unused: Any = None
    runs, *_ = campaign_sections(found, unused, unused)
    assert ">3.0 cm<" in runs.body
    assert ">61°<" in runs.body
    assert "(cm)" not in runs.body
    alike, *_ = campaign_sections(replace(found, runs=(crawl, crawl)), unused, unused)
    assert alike.title == "Runs"
    assert ">best (cm)<" in alike.body
    assert "score" not in alike.body


def test_a_campaign_says_what_ranks_its_runs_and_in_which_worlds() -> None:
    """A mean over drawn worlds does not stand beside the expert's walk in one without a word."""
    run = replace(
        example(CampaignRun), goal=Goal(), ranked_by="mean less 1 deviation", score_cm=2.5,
        in_drawn_worlds=True,
    )  # fmt: skip
    unused: Any = None
    runs, *_ = campaign_sections(replace(example(Campaign), runs=(run, run)), unused, unused)
    assert runs.title == "Runs, by mean less 1 deviation"
    for head in (
        "score (cm)",
        "best, mean over the training&#x27;s worlds (cm)",
        "expert&#x27;s best phase, world as it stands (cm)",
    ):
        assert f">{head}<" in runs.body


def test_runs_in_one_world_and_in_drawn_ones_each_say_which() -> None:
    run = replace(
        example(CampaignRun), goal=Goal(), name="one-0", in_drawn_worlds=False, ranked_by=None
    )
    drawn = replace(run, name="worlds-0", in_drawn_worlds=True)
    unused: Any = None
    runs, *_ = campaign_sections(replace(example(Campaign), runs=(run, drawn)), unused, unused)
    assert ">best (cm)<" in runs.body
    assert ">one-0<" in runs.body
    assert ">worlds-0, mean over the training&#x27;s worlds<" in runs.body


@pytest.mark.parametrize("verb", PAGES)
def test_every_page_has_a_headline(verb: str) -> None:
    page = PAGES[verb]
    found = example(page.result)
    assert any(number.said(found) for number in page.headline)


def test_a_hub_that_never_touches_bears_0_percent() -> None:
    """What the legs bear is a mean over frames: it may be a few thousandths above the weight."""
    certificate, analysis = example(Certificate), example(Analysis)
    pairs = (replace(certificate.pairs[0], hub_load_share=-0.0043),)
    robots = (replace(analysis.robots[0], hub_load_share=-0.0043),)
    unused: Any = None
    (section,) = analysis_sections(replace(analysis, robots=robots), unused, unused)
    for text in (_band_table(replace(certificate, pairs=pairs)), section.body):
        assert ">0 %<" in text
