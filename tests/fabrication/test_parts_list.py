"""Counts, masses and tubes of a design."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from matplotlib.colors import to_hex
from matplotlib.patches import Polygon

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.parts_list import LegMaterial, Printed, parts_csv, parts_list
from pneumorph.fabrication.robot_to_make import (
    RobotToMake,
    described_robot_to_make,
    paper_robot_to_make,
)
from pneumorph.fabrication.tube_plan import TubeRun, tube_plan, tubes_csv
from pneumorph.fabrication.workshop_settings import WorkshopSettings
from pneumorph.report.assembly_drawing import assembly_drawing, drawing_scale
from pneumorph.report.style import regulator_colour

HUB = Printed("PLA", 24.2, 30.0)
RUBBER = ("Dragon Skin 30", 1.08)
LEG = LegMaterial("", 4, 43072.0, 115.0 * 32.0, "115 x 32 mm", *RUBBER)


def to_make(design: str, **changes: object) -> RobotToMake:
    settings = replace(FabricationSettings(), **changes)  # type: ignore[arg-type]
    return paper_robot_to_make(design, settings, paper_robot("measured"))


def test_parts_of_the_experts_robot() -> None:
    workshop = WorkshopSettings()
    tubes = tube_plan(to_make("1.0.0.2.2.0.0.1").seats, workshop)
    assert [(run.location, run.regulator) for run in tubes] == [(0, 1), (3, 2), (4, 2), (7, 1)]
    parts = {part.name: part for part in parts_list([LEG], HUB, {"core": 38e3}, tubes, workshop)}
    assert parts["PneuNet leg, cast"].count == 4
    assert parts["PneuNet leg, cast"].mass_g == pytest.approx(43.072 * 1.08)
    # 115 x 32 mm of 80 g/m^2.
    assert parts["paper layer"].mass_g == pytest.approx(0.2944)
    assert LEG.mass_g(workshop) == pytest.approx(43.072 * 1.08 + 0.2944)
    assert parts["hub, printed"].mass_g == 30.0
    assert parts["silicone to mix"].volume_ml == pytest.approx(4 * 43.072 * 1.2)
    # Two legs a regulator: one T each.
    assert parts["T piece"].count == 2
    assert parts["tube to a regulator"].count == 2
    # 4 x 92 mm (50 / cos 15 and 40 of slack) and 2 x 800 mm, rounded up to a centimetre.
    assert "1.97 m" in parts["tube"].detail
    lines = parts_csv(list(parts.values())).splitlines()
    assert lines[0] == "number,name,count,detail,volume_ml,mass_g"
    assert len(lines) == 1 + len(parts)
    assert tubes_csv(tubes).splitlines()[2] == "3,157.5,2,91.8"


def test_a_tube_for_each_chamber() -> None:
    runs = [
        TubeRun(0, 45.0, k, 90.0, k, 2, "twin", "front", side)
        for k, side in ((1, "left"), (2, "right"))
    ]
    runs.append(TubeRun(1, 90.0, 2, 80.0, leg="short"))
    assert tubes_csv(runs).splitlines() == [
        "location,direction_deg,regulator,length_mm,chamber,side,leg,site",
        "0,45,1,90.0,1,left,twin,front",
        "0,45,2,90.0,2,right,twin,front",
        "1,90,2,80.0,1,,short,",
    ]


def test_kinds_of_legs_have_lines_of_their_own() -> None:
    short = LegMaterial("short", 2, 18e3, 2000.0, "86 x 24 mm", *RUBBER)
    own = LegMaterial("own", 1, 30e3, 0.0, "", *RUBBER)
    parts = {part.name: part for part in parts_list([short, own], HUB, {}, [], WorkshopSettings())}
    assert parts["PneuNet leg short, cast"].count == 2
    assert parts["silicone to mix"].volume_ml == pytest.approx((2 * 18 + 30) * 1.2)
    assert "paper layer short" in parts
    assert "paper layer own" not in parts  # it has no sheet


def test_the_drawing_is_to_scale() -> None:
    """The disk of 109 mm is drawn 54.5 mm wide on the A3 sheet."""
    asked = to_make("1.2.3.0.0.0.0.1")
    tubes = tube_plan(asked.seats, WorkshopSettings())
    parts = parts_list([LEG], HUB, {}, tubes, WorkshopSettings())
    figure = assembly_drawing(asked, parts, tubes)
    figure.canvas.draw()
    plan = figure.axes[0]
    left, right = plan.transData.transform([(-54.5, 0.0), (54.5, 0.0)])[:, 0]
    assert drawing_scale(asked) == 2.0
    assert (right - left) / figure.dpi * 25.4 == pytest.approx(109.0 / 2.0, rel=1e-6)
    wells = [
        assembly_drawing(
            to_make("1.2.3.0.0.0.0.1", hub=HubSettings(well_radius_mm=radius)), parts, tubes
        )
        .axes[0]
        .patches[-1]
        .get_radius()
        for radius in (20.0, 24.0)
    ]
    assert wells == [20.0, 24.0]
    shown = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    assert "crawling robot 1.2.3.0.0.0.0.1" in shown
    assert "1: regulator 2" in shown
    assert "4: free" in shown
    twice = replace(asked, seats=(*asked.seats, replace(asked.seats[1], location=8, leg=None)))
    labels = [text.get_text() for text in assembly_drawing(twice, parts, tubes).axes[0].texts]
    assert "4: free" in labels
    assert "8: free" not in labels, "there is a leg"


def test_a_drawing_tells_how_legs_are_rolled_and_what_the_hub_carries() -> None:
    example = Path(__file__).parents[2] / "examples" / "two_chambers.toml"
    text = example.read_text().replace(
        "wall_mm = 0.9", "payload_g = 25\npayload_mm = [10, 0, 45]\nwall_mm = 0.9"
    )
    text = text.replace('same = ["90"]', "same = []")  # turned, it would be carried elsewhere
    description = RobotDescription.of_text(text, example)
    asked = described_robot_to_make(
        "1+2.0.0.3+4.1+2.0.3+4.0", description, description.spec(), FabricationSettings()
    )
    tubes = tube_plan(asked.seats, WorkshopSettings())
    payload = asked.hub.payload
    assert payload is not None
    parts = parts_list([LEG], HUB, {}, tubes, WorkshopSettings(), payload)
    (carried,) = [part for part in parts if part.name == "payload"]
    assert carried.mass_g == 25.0
    assert asked.hub.simulated_mass_g == pytest.approx(30.0858)  # without it
    plan = assembly_drawing(asked, parts, tubes).axes[0]
    plan.figure.canvas.draw()
    sheet = plan.get_window_extent()
    for text in plan.texts:
        corners = text.get_window_extent().corners()
        assert sheet.count_contains(corners) == 4, f"{text.get_text()!r} leaves the plan"
    labels = [text.get_text() for text in plan.texts]
    assert "payload, 25 g at 10, 0, 45 mm" in labels
    rolls = [label.splitlines()[-1] for label in labels if "rolled" in label]
    # The sites' own roll angles; legs point outward and down by 15 degrees.
    assert rolls == ["rolled +45°", "rolled -45°", "rolled +45°", "rolled +45°"]


def test_chambers_beside_each_other_are_drawn_where_they_are() -> None:
    """Of the leg that points 45 degrees to the left of forward, the left chamber lies further left
    and is drawn on that side; one regulator for both is one colour."""
    example = Path(__file__).parents[2] / "examples" / "two_chambers.toml"
    robot = RobotDescription.read(example)
    asked = described_robot_to_make(
        "1+2.0.0.3+4.1+1.0.3+4.0", robot, robot.spec(), FabricationSettings()
    )
    parts = parts_list([LEG], HUB, {}, [], WorkshopSettings())
    plan = assembly_drawing(asked, parts, tube_plan(asked.seats, WorkshopSettings())).axes[0]
    colours: dict[str, list[np.ndarray]] = {}
    for patch in plan.patches:
        if isinstance(patch, Polygon):
            middle = patch.get_xy().mean(axis=0)
            if middle.min() > 0.0:  # of the leg that points to the upper right
                colours.setdefault(to_hex(patch.get_facecolor()), []).append(middle)
    first, second = (to_hex(regulator_colour(each)) for each in (1, 2))
    left, right = (np.mean(colours[each], axis=0) for each in (first, second))
    assert (left - right) @ [-1.0, 1.0] > 10.0


def test_a_hub_that_is_a_mesh_weighs_what_its_walls_do(tmp_path: Path) -> None:
    """The slicer makes the walls, so the file is of the outside; they lie inside it, as in the
    simulation."""
    example = Path(__file__).parents[2] / "examples" / "plate.toml"
    box = box_mesh((150.0, 90.0, 10.0), (6, 4, 2))
    replace(box, nodes=box.nodes + np.array([-75.0, -45.0, 31.0])).save(tmp_path / "hub.npz")
    sizes = "length_mm = 150\nwidth_mm = 90\nheight_mm = 10\nbottom_mm = 31\n"
    said = 'mesh = "hub.npz"\ncontact = "spread"\nwall_mm = 1.5\n'
    text = example.read_text().replace('shape = "box"', 'shape = "mesh"').replace(sizes, said)
    description = RobotDescription.of_text(text, tmp_path / "robot.toml")
    hub = described_robot_to_make(
        description.usual_design, description, description.spec(), FabricationSettings()
    ).hub
    walls_mm3 = 150.0 * 90.0 * 10.0 - 147.0 * 87.0 * 7.0
    assert hub.walls_ml == pytest.approx(1e-3 * walls_mm3, rel=1e-9)
    assert hub.density_g_per_ml * hub.walls_ml == pytest.approx(hub.simulated_mass_g, rel=1e-9)
    assert "printed hollow, walls of 1.5 mm without filling" in hub.detail
    thick = RobotDescription.of_text(text.replace("1.5", "5"), tmp_path / "robot.toml")
    with pytest.raises(ValueError, match=r"\[hub\]: wall_mm is 5, expected less than 5:"):
        _ = thick.spec()


def test_each_leg_is_of_its_own_silicone() -> None:
    """As it was simulated; what a workshop has goes before."""
    workshop = WorkshopSettings()
    assert workshop.silicone_for(None) == workshop.silicone_for("Dragon Skin 30") == RUBBER
    assert workshop.silicone_for("Ecoflex 00-50") == ("Ecoflex 00-50", 1.07)
    other = WorkshopSettings(silicone="Mold Star 16 Fast")
    assert other.silicone_for("Ecoflex 00-50") == ("Mold Star 16 Fast", 1.18)
    assert WorkshopSettings(silicone="own", silicone_density_g_per_ml=1.2).silicone_for(None) == (
        "own", 1.2
    )  # fmt: skip
    soft = LegMaterial("soft", 1, 30e3, 0.0, "", "Ecoflex 00-50", 1.07)
    parts = parts_list([LEG, soft], HUB, {}, [], workshop)
    mixed = {part.detail.partition(",")[0]: part for part in parts if "to mix" in part.name}
    assert mixed["Ecoflex 00-50"].mass_g == pytest.approx(30.0 * 1.2 * 1.07)
    assert mixed["Dragon Skin 30"].volume_ml == pytest.approx(4 * 43.072 * 1.2)
    assert [part.detail for part in parts if part.name.endswith("cast")] == [
        "Dragon Skin 30, each", "Ecoflex 00-50, each"
    ]  # fmt: skip
