"""What stands first on each verb's page is what its result has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args, get_type_hints

import pytest
from helpers.result_example import example

from pneumorph.environment.goal import Goal
from pneumorph.report.certificate_sections import _band_table
from pneumorph.report.experiment_sections import analysis_sections
from pneumorph.report.verb_pages import EXPERT, PAGES, HeadlineNumber
from pneumorph.study.analysis import Analysis
from pneumorph.study.baseline import BestPhase
from pneumorph.study.certified_pairs import Certificate

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
