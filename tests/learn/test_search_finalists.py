"""Which gaits of a search in drawn worlds walk once more, and what is said to be gained late."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.toy_coopt import SPACE, TASK, CrawlersInWorlds

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.learn import search_run
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluated_gaits import best_of_each_design
from pneumorph.learn.gait_search import GaitSearch, GaitSearchSettings
from pneumorph.learn.objective import Objective
from pneumorph.learn.search_run import SearchResult, run_search

DESIGNS = (1, 3, 8, 11, 16, 20)
POPULATION = 4
GENERATION = len(DESIGNS) * POPULATION * TASK.action_count
"""Actions of a generation in one world each."""
WORLDS = 4


def search(folder: Path, nominal_until: int, generations: int, **options: Any) -> SearchResult:
    """Of gaits, for as long as so many generations in drawn worlds."""
    designs = [SPACE[place % len(SPACE)] for place in range(16)]
    return run_search(
        GaitSearch(list(DESIGNS), TASK, GaitSearchSettings(population=POPULATION), seed=0),
        CrawlingEnvironment(designs, viscous_crawler_robot, CrawlersInWorlds, TASK),
        SPACE,
        generations * WORLDS * GENERATION,
        folder,
        objective=Objective(
            "mean_minus_deviations",
            worlds_per_design=WORLDS,
            evaluation_worlds=8,
            nominal_until_timestep=nominal_until,
        ),
        **options,
    )


@pytest.fixture
def walked_again(monkeypatch: pytest.MonkeyPatch) -> list[DesignGaitPair]:
    """Receives the pairs that walk once more."""
    seen: list[DesignGaitPair] = []

    def best(pairs: list[DesignGaitPair], *more: Any) -> dict[int, DesignGaitPair]:
        seen.extend(pairs)
        return best_of_each_design(pairs, *more)

    monkeypatch.setattr(search_run, "best_of_each_design", best)
    return seen


@pytest.mark.parametrize(("finalists", "of_nominal"), [(6, 0), (9, 1), (18, 6)])
def test_each_designs_searched_gait_walks_again_before_any_random_one(
    tmp_path: Path, walked_again: list[DesignGaitPair], finalists: int, of_nominal: int
) -> None:
    """Runs have a nominal phase that is over after one generation, drawn at random: all designs
    have a gait from there, but what was searched for is not given up for it."""
    found = search(tmp_path, 1, generations=6, finalist_count=finalists, every_design=True)
    searched = {pair.design for pair in walked_again if pair.timestep > GENERATION}
    assert searched == set(DESIGNS)
    assert set(found.best) == set(DESIGNS)
    assert len(set(map(id, walked_again))) == len(walked_again) == finalists
    # Half of the places that are left.
    assert sum(pair.timestep <= GENERATION for pair in walked_again) == of_nominal
    if finalists == len(DESIGNS):
        assert min(pair.timestep for pair in found.best.values()) > GENERATION


def test_a_design_that_never_walked_in_drawn_worlds_has_its_gait_of_the_nominal_one() -> None:
    def pairs(design: int, *scores_cm: float) -> list[DesignGaitPair]:
        return [DesignGaitPair(design, None, far, far, "search", 0, far) for far in scores_cm]  # type: ignore[arg-type]

    nominal = {3: pairs(3, 9.0, 8.0), 8: pairs(8, 7.0)}
    found = {3: pairs(3, 2.0, 1.0)}
    chosen = search_run._finalists(nominal, found, 2, every_design=True)
    assert sorted((pair.design, pair.score_cm) for pair in chosen) == [(3, 2.0), (8, 7.0)]
    chosen = search_run._finalists(nominal, found, 4, every_design=True)
    assert sorted((pair.design, pair.score_cm) for pair in chosen) == [
        (3, 1.0), (3, 2.0), (3, 9.0), (8, 7.0),
    ]  # fmt: skip
    # Of a search of designs half are from there, whatever designs they are of.
    chosen = search_run._finalists(nominal, found, 4, every_design=False)
    assert [(pair.design, pair.score_cm) for pair in chosen] == [
        (3, 9.0), (8, 7.0), (3, 2.0), (3, 1.0),
    ]  # fmt: skip


def test_what_was_gained_late_is_of_one_measure(tmp_path: Path) -> None:
    """Scores in the nominal world and over drawn ones are not: where drawn worlds begin in the last
    quarter, nothing is known to be gained there; where they begin before, nothing is ever lost."""
    half, end = (share * 8 * WORLDS * GENERATION for share in (0.5, 0.8))
    late = search(tmp_path / "late", int(end), generations=8)
    assert late.late_gain_cm == {}
    early = search(tmp_path / "early", int(half), generations=8)
    assert set(early.late_gain_cm) == set(DESIGNS)
    assert min(early.late_gain_cm.values()) >= 0.0
