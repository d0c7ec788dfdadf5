"""Counts, masses and tubes of a design."""

from __future__ import annotations

import pytest

from pneumorph.fabrication.hub import HubSettings
from pneumorph.fabrication.parts_list import (
    Printed,
    WorkshopSettings,
    parts_csv,
    parts_list,
    tube_plan,
    tubes_csv,
)
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.report.assembly_drawing import SCALE, assembly_drawing
from pneumorph.robot.design import Design

HUB = Printed("PLA", 24.2, 30.0)


def test_parts_of_the_experts_robot() -> None:
    design, workshop = Design.parse("1.0.0.2.2.0.0.1"), WorkshopSettings()
    tubes = tube_plan(design, RadialMounting(), 52.0, workshop)
    assert [(run.location, run.regulator) for run in tubes] == [(0, 1), (3, 2), (4, 2), (7, 1)]
    parts = {
        part.name: part
        for part in parts_list(
            design, PneuNetShape(), 43072.0, HUB, {"core": 38e3}, tubes, workshop
        )
    }
    assert parts["PneuNet leg, cast"].count == 4
    assert parts["PneuNet leg, cast"].mass_g == pytest.approx(43.072 * 1.08)
    # 115 x 32 mm of 80 g/m^2.
    assert parts["paper layer"].mass_g == pytest.approx(0.2944)
    assert parts["hub, printed"].mass_g == 30.0
    assert parts["silicone to mix"].volume_ml == pytest.approx(4 * 43.072 * 1.2)
    # Two legs a regulator: one T each.
    assert parts["T piece"].count == 2
    assert parts["tube to a regulator"].count == 2
    # 4 x 92 mm and 2 x 800 mm, rounded up to a centimetre.
    assert "1.97 m" in parts["tube"].detail
    lines = parts_csv(list(parts.values())).splitlines()
    assert lines[0] == "number,name,count,detail,volume_ml,mass_g"
    assert len(lines) == 1 + len(parts)
    assert tubes_csv(tubes).splitlines()[2] == "3,157.5,2,92.0"


def test_the_drawing_is_to_scale() -> None:
    """The disk of 109 mm is drawn 54.5 mm wide on the A3 sheet."""
    design = Design.parse("1.2.3.0.0.0.0.1")
    tubes = tube_plan(design, RadialMounting(), 52.0, WorkshopSettings())
    parts = parts_list(design, PneuNetShape(), 43072.0, HUB, {}, tubes, WorkshopSettings())
    figure = assembly_drawing(design, parts, tubes)
    figure.canvas.draw()
    plan = figure.axes[0]
    left, right = plan.transData.transform([(-54.5, 0.0), (54.5, 0.0)])[:, 0]
    assert (right - left) / figure.dpi * 25.4 == pytest.approx(109.0 / SCALE, rel=1e-6)
    wells = [
        assembly_drawing(design, parts, tubes, hub=HubSettings(well_radius_mm=radius))
        .axes[0]
        .patches[-1]
        .get_radius()
        for radius in (20.0, 24.0)
    ]
    assert wells == [20.0, 24.0]
    shown = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    assert "crawling robot 1.2.3.0.0.0.0.1" in shown
    assert "1: regulator 2" in shown
    assert "4: free socket" in shown
