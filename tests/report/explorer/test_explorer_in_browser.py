"""The explorer in headless Chromium: filters count right, names are found, replays move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.report.explorer.page import write_explorer
from pneumorph.report.explorer.scored_designs import ScoredDesigns, unscored
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.style import regulator_colour
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory

OpenPage = Callable[[Path | str], Any]
EXPERT = "1.0.0.2.2.0.0.1"
EXACT = ReplaySettings(tolerance_mm=2e-4)
SPACE = DesignSpace()


@pytest.fixture(scope="module")
def walked() -> Trajectory:
    commands = sample_commands(ExpertGait(phase_deg=60), 0.01, 60)
    robot = paper_robot("published").reduced(EXPERT)
    description = {"design": EXPERT}
    return rollout(robot, np.asarray(commands), record_every=20, description=description)[1]


@pytest.fixture(scope="module")
def scored(walked: Trajectory) -> ScoredDesigns:
    """The paper's 6972 designs, two thirds of them with a score."""
    scores = np.random.default_rng(3).normal(2.0, 3.0, len(SPACE))
    scores[::3] = np.nan
    expert = SPACE.index(Design.parse(EXPERT))
    return ScoredDesigns(
        SPACE,
        scores,
        np.full(len(SPACE), 1.0 / len(SPACE)),
        {expert: ("L1", 4.25)},
        {expert: [("expert", walked)]},
        "Scores of a test.",
    )


@pytest.fixture(scope="module")
def page_file(scored: ScoredDesigns, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("explorer") / "explorer.html"
    return write_explorer(path, scored, "Designs", "pneumorph simulate --design DESIGN", EXACT)


def names(page: Any) -> list[str]:
    return page.evaluate("pneumorphExplorer.names()")


def show(page: Any, **filters: Any) -> list[str]:
    page.evaluate("filters => pneumorphExplorer.set(filters)", filters)
    return names(page)


@pytest.mark.parametrize("of_pairs", ["", "mean over the training's worlds"])
def test_what_a_best_pairs_number_is_stands_beside_it(
    of_pairs: str, scored: ScoredDesigns, tmp_path: Path, open_page: OpenPage
) -> None:
    told = replace(scored, of_pairs=of_pairs)
    page = open_page(write_explorer(tmp_path / "explorer.html", told, "Designs", "", EXACT))
    page.evaluate(f"pneumorphExplorer.select('{EXPERT}')")
    found = page.locator(".details dl dd").last.text_content()
    assert found == "L1, 4.25 cm" + (f", {of_pairs}" if of_pairs else "")


def test_filters_show_as_many_designs_as_there_are(page_file: Path, open_page: OpenPage) -> None:
    page = open_page(page_file)
    assert len(names(page)) == 6972
    assert page.locator(".count").text_content() == "6972 of 6972 designs"
    # Choose three locations; one way for one regulator, three for two, one for three.
    assert len(show(page, legs=[3])) == comb(8, 3) * 5
    # Stirling numbers of the second kind S(legs, 2) = 2^(legs - 1) - 1.
    two = sum(comb(8, legs) * (2 ** (legs - 1) - 1) for legs in range(3, 7))
    assert len(show(page, regulators=[2])) == two
    symmetric = [str(d) for d in SPACE if d.mirror().canonical() == d]
    assert sorted(show(page, symmetric="yes")) == sorted(symmetric)
    assert len(show(page, symmetric="no")) == 6972 - len(symmetric)
    four_of_three = sum(d.leg_count == 4 and max(d.assignment) == 3 for d in SPACE)
    assert len(show(page, legs=[4], regulators=[3])) == four_of_three
    assert len(show(page, **{"with": "score"})) == 6972 - 2324
    assert show(page, **{"with": "replay"}) == [EXPERT]


def test_a_design_is_found_whatever_its_regulators_are_called(
    page_file: Path, open_page: OpenPage
) -> None:
    page = open_page(page_file)
    box = page.locator("input[name=q]")
    box.fill("3.0.0.1.1.0.0.3")
    assert names(page) == [EXPERT]
    box.fill("1.0.0.2.2")
    assert names(page) == [
        str(d) for d in sorted(SPACE, key=_by_score(page)) if "1.0.0.2.2" in str(d)
    ]
    box.fill("no such design")
    assert names(page) == []


def _by_score(page: Any) -> Callable[[Design], tuple[bool, float]]:
    scores = page.evaluate("explorerData.scores")
    return lambda d: (scores[SPACE.index(d)] is None, -(scores[SPACE.index(d)] or 0.0))


def test_columns_sort_and_only_what_is_seen_is_drawn(
    scored: ScoredDesigns, page_file: Path, open_page: OpenPage
) -> None:
    page = open_page(page_file)
    first = names(page)[:5]
    order = np.argsort(-np.nan_to_num(scored.score_cm, nan=-np.inf), kind="stable")
    assert first == [str(SPACE[int(index)]) for index in order[:5]]
    page.locator(".head button", has_text="design").click()
    assert names(page)[:2] == [str(SPACE[0]), str(SPACE[1])]
    page.locator(".head button", has_text="design").click()
    assert names(page)[0] == str(SPACE[len(SPACE) - 1])
    # A list of 6972 rows stays fast because a window of them exists.
    assert 5 < page.locator(".row").count() < 60
    page.evaluate("document.querySelector('.list').scrollTop = 3000 * 32")
    page.wait_for_function(
        "name => [...document.querySelectorAll('.row')].some(r => r.textContent.includes(name))",
        arg=names(page)[3000],
    )


def test_a_row_stays_while_the_list_scrolls_below_it(page_file: Path, open_page: OpenPage) -> None:
    """Else a click that scrolls to its row is lost: it is pressed on one, let go on another."""
    page = open_page(page_file)
    stayed = page.evaluate("""() => {
        const list = document.querySelector(".list"), row = document.querySelectorAll(".row")[5];
        const scroll = (y) => { list.scrollTop = y; list.dispatchEvent(new Event("scroll")); };
        const found = [20, 100, 30000, 100].map((y) => { scroll(y); return row.isConnected; });
        const texts = [...document.querySelectorAll(".row")].map((each) => each.textContent);
        return [found, texts.length, new Set(texts).size];
    }""")
    assert stayed[0] == [True, True, False, False]
    assert stayed[1] == stayed[2] < 60
    drawn = page.locator(".row").all_text_contents()
    assert [text[:15] for text in drawn] == names(page)[: len(drawn)]


def test_a_click_shows_the_replay_or_the_command(
    walked: Trajectory, page_file: Path, open_page: OpenPage
) -> None:
    page = open_page(page_file)
    show(page, q=EXPERT)
    page.locator(".row").click()
    player = "pneumorphExplorer.player()"
    page.evaluate(f"{player}.seek({walked.time_s[2]})")
    point = page.evaluate(f"{player}.trackedPoint()")
    np.testing.assert_allclose(point, walked.tracked_point_mm[2], atol=1e-3)  # single precision
    assert "L1, 4.25 cm" in page.locator(".details").text_content()
    other = show(page, legs=[6])[7]
    page.locator(".row", has_text=other).click()
    assert page.locator(".details pre").text_content() == f"pneumorph simulate --design {other}"
    assert page.locator(".details svg polygon").count() == 7
    # The view is in the address: opened again it is the same.
    again = open_page(page.url)
    assert again.evaluate("pneumorphExplorer.selected()") == other
    assert names(again) == names(page)


def test_a_space_without_scores_needs_no_player(tmp_path: Path, open_page: OpenPage) -> None:
    space = DesignSpace(location_count=4, regulator_count=2, maximum_legs=4)
    path = write_explorer(tmp_path / "e.html", unscored(space), "Small", "walk DESIGN", EXACT)
    assert path.stat().st_size < 50_000
    page = open_page(path)
    assert len(names(page)) == space.size
    page.evaluate("pneumorphExplorer.select('1.2.1.2')")
    assert page.locator(".details pre").text_content() == "walk 1.2.1.2"
    assert "symmetric" in page.locator(".filters").text_content()


def test_a_leg_of_two_regulators_has_a_band_of_each(tmp_path: Path, open_page: OpenPage) -> None:
    """As in plan views of pages; where it is not known where chambers are, away from the hub."""
    space = DesignSpace(
        location_count=4,
        regulator_count=2,
        minimum_legs=1,
        maximum_legs=4,
        options=("0 *+*",) * 4,
    )
    page = open_page(write_explorer(tmp_path / "e.html", unscored(space), "Two", "walk", EXACT))
    page.evaluate("pneumorphExplorer.select('0.0.0.1+2')")
    shown = "[...document.querySelectorAll('.details svg polygon')]"
    fills = page.evaluate(f"{shown}.map((each) => each.getAttribute('fill'))")
    assert fills == [regulator_colour(number) for number in (1, 2, 0)]
    assert page.locator(".details svg text").all_text_contents() == ["1+2"]
    corners = page.evaluate(f"{shown}.map((each) => [...each.points].map((p) => [p.x, p.y]))")
    first, second, _ = (np.array(each) for each in corners)
    assert np.linalg.norm(first.mean(axis=0)) < np.linalg.norm(second.mean(axis=0))


@pytest.mark.parametrize(("symmetries", "canonical"), [(("mirror",), True), (("1 2 3 0",), True),
                                                       ((), False)])  # fmt: skip
def test_mirror_images_are_what_they_are_and_are_found(
    symmetries: tuple[str, ...], canonical: bool, tmp_path: Path, open_page: OpenPage
) -> None:
    """Also where a listed design stands for its image, or for what a turn makes of it."""
    space = DesignSpace(
        location_count=4,
        regulator_count=2,
        maximum_legs=3,
        options=("0 * b*+*",) * 4,
        symmetries=symmetries,
        canonical=canonical,
    )
    page = open_page(write_explorer(tmp_path / "e.html", unscored(space), "Images", "walk", EXACT))
    rng = np.random.default_rng(0)
    apart = replace(space, symmetries=())
    for design in (space[int(index)] for index in rng.integers(len(space), size=25)):
        page.evaluate(f"pneumorphExplorer.select('{design}')")
        image, members = apart.form(design.mirror())[0], set(space.members(design))
        told = "itself" if image == design else str(image)
        if image != design and image in members:
            told += ", which counts as one with it"
        assert page.locator(".details dl dd").nth(2).text_content() == told
        for member in members:
            assert show(page, q=str(member)) == [str(design)]
        assert show(page, q=str(image)) == [str(space.form(image)[0])]
