"""The page of a robot with several kinds of modules shows the bend of each."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest
from helpers.result_example import example

from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.report.reduction_sections import leg_sections
from pneumorph.study.baseline import Baseline

BEND = {"pressure_kPa": [0.0, 45.0, 90.0], "full_deg": [0.0, 9.0, 20.0]}


class Sheet:
    """Notes what is drawn."""

    def __init__(self) -> None:
        self.figures: list[tuple[str, Any, str]] = []

    def drawn(self, *figure: Any) -> str:
        self.figures.append(figure)
        return figure[2]


@pytest.mark.parametrize("count", [1, 3])
def test_each_module_has_its_bend(count: int) -> None:
    first = example(PartsSummary)
    parts = [
        replace(first, part=f"leg {n}", bend={**BEND, "reduced_deg": [0.0, 9.0, 19.0 - n]})
        for n in range(count)
    ]
    leg = replace(parts[0], others={each.part: each for each in parts[1:]})
    sheet: Any = Sheet()
    unused: Any = None
    (section,) = leg_sections(replace(example(Baseline), leg=leg), unused, sheet)
    assert len({name for name, *_ in sheet.figures}) == count
    for number, (_, figure, caption) in enumerate(sheet.figures):
        reduced = figure.axes[0].lines[1]
        assert reduced.get_ydata()[-1] == 19.0 - number
        assert (f"leg {number}" if count > 1 else "the leg") in caption
        assert caption in section.body


def test_a_table_of_several_legs_has_no_whole_digest() -> None:
    """It would be as wide as the page, and leave no room for the second leg's numbers."""
    first = replace(
        example(PartsSummary), bend=None, silicone="rubber", mesh_digest="ab" * 32, digest="12" * 32
    )
    second = replace(first, part="twin", mesh_digest="cd" * 32, digest="34" * 32)
    older = replace(first, part="old", digest=None)
    leg = replace(first, others={"twin": second, "old": older})
    unused: Any = None
    (section,) = leg_sections(replace(example(Baseline), leg=leg), unused, unused)
    for digits in ("ab" * 6, "12" * 6, "cd" * 6, "34" * 6):
        assert f"<td>{digits}</td>" in section.body
    cells = re.findall("<td[^>]*>([^<]*)</td>", section.body)
    assert max(map(len, cells)) < 40
