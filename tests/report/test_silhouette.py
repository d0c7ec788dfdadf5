"""What a hub covers is drawn as it is, and not as the convex hull of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.parts_list import LegMaterial, Printed, parts_list
from pneumorph.fabrication.robot_to_make import RobotToMake, paper_robot_to_make
from pneumorph.fabrication.tube_plan import tube_plan
from pneumorph.fabrication.workshop_settings import WorkshopSettings
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.report.assembly_drawing import assembly_drawing, outside_the_hub
from pneumorph.report.plan import plan_of_walk
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.scene import paper_shape
from pneumorph.report.silhouette import is_covered, silhouette
from pneumorph.report.style import DISK_COLOUR
from pneumorph.robot.design import Design

SIDE = 120.0
IN_NOTCH, IN_ARM = (20.0, 20.0), (-40.0, 40.0)


def plate(keep, layers: int = 1) -> Mesh:
    """A square of 12 x 12 cells about the origin, of which some are kept."""
    mesh = box_mesh((SIDE, SIDE, 10.0 * layers), (12, 12, layers), keep=keep)
    return replace(mesh, nodes=mesh.nodes - [SIDE / 2.0, SIDE / 2.0, 0.0])


def is_in_ell(cell: np.ndarray) -> bool:
    return bool(cell[0] < 4 or cell[1] < 4)


def area(corners: np.ndarray) -> float:
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def outline(mesh: Mesh, turn: np.ndarray | None = None) -> np.ndarray:
    nodes = mesh.nodes if turn is None else mesh.nodes @ turn.T
    return silhouette(nodes, boundary_triangles(mesh.tetrahedra))


def test_an_ell_has_its_six_corners() -> None:
    corners = outline(plate(is_in_ell))
    assert {tuple(each) for each in np.round(corners).tolist()} == {
        (-60.0, -60.0), (60.0, -60.0), (60.0, -20.0), (-20.0, -20.0), (-20.0, 60.0), (-60.0, 60.0)
    }  # fmt: skip
    assert len(corners) == 6
    assert area(corners) == pytest.approx(SIDE**2 - 80.0**2)


def test_a_hole_stays_open() -> None:
    ring = outline(plate(lambda cell: cell[:2].min() < 3 or cell[:2].max() > 8))
    assert area(ring) == pytest.approx(SIDE**2 - 60.0**2)


def test_pieces_over_each_other_are_seen_as_one() -> None:
    """A slab on a post at its side: the upper cells cover all."""
    mesh = plate(lambda cell: cell[2] == 1 or cell[0] < 2, layers=2)
    assert area(outline(mesh)) == pytest.approx(SIDE**2)
    # From the front, with the view's directions as rows: an upside down L.
    front = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    assert area(outline(mesh, front)) == pytest.approx(SIDE * 10.0 + 20.0 * 10.0)


def test_a_hub_of_unknown_shape_covers_nothing() -> None:
    assert silhouette(np.zeros((0, 3)), np.zeros((0, 3), dtype=int)).shape == (0, 2)


def test_places_are_covered_or_not() -> None:
    mesh = plate(is_in_ell)
    places = np.array([IN_NOTCH, IN_ARM, (59.0, -59.0), (70.0, 0.0)])
    found = is_covered(places, mesh.nodes, boundary_triangles(mesh.tetrahedra))
    assert found.tolist() == [False, True, True, False]


def hub_of(axes: Axes) -> Polygon:
    (hub,) = [
        each
        for each in axes.patches
        if isinstance(each, Polygon) and to_hex(each.get_facecolor()) == DISK_COLOUR.lower()
    ]
    return hub


def test_a_plan_of_a_walk_leaves_the_notch_open(make_trajectory) -> None:
    design = "1.0.0.2.2.0.0.1"
    trajectory, mesh = make_trajectory(design), plate(is_in_ell)
    triangles = boundary_triangles(mesh.tetrahedra)
    shape = paper_shape(Design.parse(design), len(trajectory.skin_triangles))
    shape = replace(shape, hub_nodes_mm=mesh.nodes, hub_triangles=triangles)
    figure = plan_view_figure(plan_of_walk(replace(trajectory, shape=shape)))
    path = hub_of(figure.axes[0]).get_path()
    assert path.contains_point(IN_ARM)
    assert not path.contains_point(IN_NOTCH)


def sheet(asked: RobotToMake) -> Figure:
    tubes = tube_plan(asked.seats, WorkshopSettings())
    leg = LegMaterial("", 4, 43072.0, 115.0 * 32.0, "115 x 32 mm", "Dragon Skin 30", 1.08)
    parts = parts_list([leg], Printed("PLA", 24.2, 30.0), {}, tubes, WorkshopSettings())
    return assembly_drawing(asked, parts, tubes)


def test_a_drawing_has_the_hubs_own_outline_and_says_which_tubes_leave_it() -> None:
    """The middle of its length and width is in the notch, so that all tubes end outside."""
    paper = paper_robot_to_make("1.0.0.2.2.0.0.1", FabricationSettings(), paper_robot("measured"))
    made = {}
    for keep in (is_in_ell, None):
        mesh = plate(keep)
        hub = replace(paper.hub, mesh=mesh, outline_mm=mesh.nodes, well_radius_mm=0.0)
        made[keep] = replace(paper, hub=hub)
    ell, whole = made.values()
    plan = sheet(ell).axes[0]
    path = hub_of(plan).get_path()
    assert path.contains_point(IN_ARM)
    assert not path.contains_point(IN_NOTCH)
    assert outside_the_hub(ell) == ["0", "3", "4", "7"]
    assert outside_the_hub(whole) == outside_the_hub(paper) == []
    told = {
        name: " ".join(text.get_text() for axes in sheet(asked).axes for text in axes.texts)
        for name, asked in (("ell", ell), ("whole", whole))
    }
    assert "These leave the hub on it: 0, 3, 4, 7." in told["ell"]
    assert "leave the hub" not in told["whole"]
