"""What a notebook shows of walks, robots and meshes, in a browser without a network."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

import pneumorph
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.reduction.part_summary import PartsSummary, PartSummary
from pneumorph.report.reduction_sections import leg_sections
from pneumorph.report.sheet import Sheet
from pneumorph.robot.robot import Robot
from pneumorph.trajectory import Trajectory

DESIGN = "1.0.0.2.2.0.0.1"
ROUNDING_MM = 1e-4
"""Single precision of positions within a robot's reach of 200 mm: 2e-5 mm, added up."""


@pytest.fixture(scope="module")
def robot() -> Robot:
    return paper_robot("published").assembly(DESIGN)


def test_a_notebook_may_show_walks_and_robots_side_by_side(
    robot: Robot,
    make_trajectory: Callable[..., Trajectory],
    tmp_path: Path,
    open_page: Callable[[Path], Any],
) -> None:
    """Cells share one page: an error of a script there fails the fixture that opens it. Each player
    is alone in its frame, and the robot at rest is where its mounts have it."""
    walk = make_trajectory()
    shown = [walk._repr_html_(), robot._repr_html_(), walk._repr_html_()]
    assert None not in shown
    path = tmp_path / "notebook.html"
    path.write_text("<meta charset='utf-8'>" + "".join(map(str, shown)))
    page = open_page(path)
    page.wait_for_load_state("networkidle")
    frames = page.frames[1:]
    assert len(frames) == 3
    for frame in frames:
        frame.wait_for_function("pneumorphReplay.players.length === 1")
    durations = [frame.evaluate("pneumorphReplay.players[0].duration") for frame in frames]
    assert durations == [walk.time_s[-1], 0.0, walk.time_s[-1]]
    flat = frames[1].evaluate("Array.from(pneumorphReplay.players[0].nodePositions(0))")
    used = np.unique(robot.mounts[0].part.skin)
    legs = [mount.pose.apply(mount.part.rest_nodes)[used] for mount in robot.mounts]
    assert np.abs(np.array(flat).reshape(-1, 3) - np.concatenate(legs)).max() < ROUNDING_MM
    assert not frames[1].is_visible(".pr-time")  # nothing moves
    assert frames[0].is_visible(".pr-time")


def test_a_mesh_is_a_picture_of_its_regions() -> None:
    mesh = box_mesh((40.0, 12.0, 9.0), (2, 1, 1), hollow=False)
    shown = mesh._repr_html_()
    assert shown is not None
    assert shown.startswith("<figure><img")
    assert repr(mesh) in shown


def test_a_robots_file_is_its_usual_design_from_above() -> None:
    """In a line, and as a picture; of its specification, which has no design, a leg everywhere."""
    plate = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
    described = pneumorph.RobotDescription.read(plate)
    assert repr(described) == (
        "RobotDescription(plate: 6 sites, 4 regulators, modules long, short)"
    )
    for value, said in ((described, "b1.0.2.2.0.b1"), (described.spec(), "RobotSpec(plate")):
        shown = value._repr_html_()
        assert shown is not None
        assert shown.startswith("<figure><img")
        assert said in shown


def test_every_module_of_a_robot_is_in_the_table_of_its_page(tmp_path: Path) -> None:
    legs = [
        PartSummary(
            name,
            modes,
            9,
            0,
            64 * name[0],
            {"bend_error_percent": error},
            {key: [0.0, 40.0 * modes] for key in ("pressure_kPa", "full_deg", "reduced_deg")},
            silicone="Ecoflex 00-50",
        )
        for name, modes, error in (("long", 4, 1.25), ("short", 5, 2.5))
    ]
    found = SimpleNamespace(leg=PartsSummary(**vars(legs[0]), others={"short": legs[1]}))
    run: Any = None
    (section,) = leg_sections(found, run, Sheet(tmp_path))
    # Whole digests leave no room for the numbers.
    for row in (
        "long</td><td>short",
        "<td>1.25</td>",
        "2.5",
        "<td>llllllllllll</td><td>ssssssssssss<",
        "<td>silicone</td><td>Ecoflex 00-50</td><td>Ecoflex 00-50<",
        "at a pressure of (kPa)</td><td>160</td><td>200<",
    ):
        assert re.sub(" class=[^>]*", "", row) in re.sub(" class=[^>]*", "", section.body)


def test_what_cannot_be_drawn_is_text(
    robot: Robot, make_trajectory: Callable[..., Trajectory]
) -> None:
    walk = make_trajectory()
    assert replace(walk, node_positions_mm=None)._repr_html_() is None
    assert replace(walk, metadata={})._repr_html_() is None  # of nobody knows what
    assert Robot(robot.hub, ())._repr_html_() is None


def test_values_that_hold_arrays_are_told_in_a_line(
    robot: Robot, make_trajectory: Callable[..., Trajectory]
) -> None:
    spec, part = paper_robot("published"), robot.mounts[0].part
    values = [make_trajectory(), robot, robot.hub, part, spec, spec.hub, spec.module, spec.sites[0]]
    for value in [*values, spec.hub.mesh]:
        assert len(repr(value)) < 150, type(value)
    assert repr(values[0]) == f"Trajectory({DESIGN}: completed, 2 s in 21 frames, 1.00 cm forward)"
    far = replace(make_trajectory(), metadata={"range_ratio": 2.51})
    assert repr(far).endswith("1.00 cm forward, 2.5 times as far as its legs' snapshots)")
    assert repr(robot) == f"Robot({DESIGN}: 4 parts on a hub, 495 g)"
    assert repr(part).startswith(f"ReducedPart(2548 nodes, {part.mode_count} modes, ")
