"""Of pieces that cover each other in a view the nearer one is drawn later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.patches import Polygon

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.parts_list import LegMaterial, Printed, parts_list
from pneumorph.fabrication.robot_to_make import paper_robot_to_make
from pneumorph.fabrication.tube_plan import tube_plan
from pneumorph.fabrication.workshop_settings import WorkshopSettings
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.report.assembly_drawing import assembly_drawing
from pneumorph.report.drawing_order import farthest_first
from pneumorph.report.style import DISK_COLOUR, regulator_colour

RIGHT = np.array([0.0, 1.0, 0.0])


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T


def test_the_nearer_of_two_boxes_is_last_from_either_side() -> None:
    """The long one has its middle behind that of the one that it hides."""
    long = box((0, 0, 0), (10, 100, 10))
    slab = box((0, 5, 0), (10, 9, 40))
    for pieces in ([long, slab], [slab, long]):
        assert pieces[farthest_first(pieces, RIGHT)[-1]] is long
        assert pieces[farthest_first(pieces, -RIGHT)[-1]] is long
    apart = [box((0, 0, 0), (10, 5, 10)), box((0, 10, 0), (10, 15, 10))]
    assert farthest_first(apart, RIGHT) == [1, 0]
    assert farthest_first(apart, -RIGHT) == [0, 1]
    assert farthest_first([], RIGHT) == []


def test_pieces_in_a_ring_are_all_drawn() -> None:
    """Each is hidden by the next, so that no order is right everywhere."""
    bar = box((-20, 0, -2), (20, 2, 2)) @ rotation_about("z", 20.0).T + [0.0, 0.0, 15.0]
    ring = [bar @ rotation_about("y", 90.0 * turn).T for turn in range(4)]
    assert sorted(farthest_first(ring, RIGHT)) == [0, 1, 2, 3]


def seen(axes: Axes, x: float, y: float) -> str:
    """Colour of what is drawn last at a point of a view."""
    pieces = [each for each in axes.patches if isinstance(each, Polygon)]
    ordered = sorted(pieces, key=lambda each: each.get_zorder())  # stable, as matplotlib draws
    under = [each for each in ordered if each.get_path().contains_point((x, y))]
    return to_hex(under[-1].get_facecolor())


@pytest.mark.parametrize("turned", [False, True])
def test_the_side_view_shows_the_legs_on_the_viewers_side(turned: bool) -> None:
    """Seen from the right the legs of regulator 2 hide the hub, which hides those of regulator 1;
    turned to the other side it is the other way round."""
    design = "0.2.2.0.0.1.1.0" if turned else "0.1.1.0.0.2.2.0"
    asked = paper_robot_to_make(design, FabricationSettings(), paper_robot("measured"))
    asked = replace(asked, seats=tuple(each for each in asked.seats if each.leg is not None))
    workshop = WorkshopSettings()
    tubes = tube_plan(asked.seats, workshop)
    leg = LegMaterial("", 4, 43072.0, 115.0 * 32.0, "115 x 32 mm", "Dragon Skin 30", 1.08)
    parts = parts_list([leg], Printed("PLA", 24.2, 30.0), {}, tubes, workshop)
    view = assembly_drawing(asked, parts, tubes).axes[1]
    (hub,) = [each for each in view.patches if to_hex(each.get_facecolor()) == DISK_COLOUR.lower()]
    low, high = hub.get_path().get_extents().get_points()
    points = [
        (x, y)
        for x in np.linspace(low[0] + 8.0, high[0] - 8.0, 40)  # its sides slant
        for y in np.linspace(low[1] + 1.0, high[1] - 1.0, 20)
    ]
    colours = {seen(view, *point) for point in points}
    near, far = (to_hex(regulator_colour(each)) for each in ((1, 2) if turned else (2, 1)))
    assert near in colours
    assert far not in colours
    assert DISK_COLOUR.lower() in colours  # between the legs


def test_a_leg_upside_down_shows_its_plate_from_above() -> None:
    asked = paper_robot_to_make("1.0.0.0.0.0.0.0", FabricationSettings(), paper_robot("measured"))
    seat = next(each for each in asked.seats if each.leg is not None)
    over = Pose(seat.pose.rotation @ rotation_about("x", 180.0), seat.pose.translation)
    workshop = WorkshopSettings()
    tubes = tube_plan(asked.seats, workshop)
    leg = LegMaterial("", 1, 43072.0, 115.0 * 32.0, "115 x 32 mm", "Dragon Skin 30", 1.08)
    parts = parts_list([leg], Printed("PLA", 24.2, 30.0), {}, tubes, workshop)
    largest = []
    for pose in (seat.pose, over):
        robot = replace(asked, seats=(replace(seat, pose=pose),))
        plan = assembly_drawing(robot, parts, tubes).axes[0]
        legs = [each for each in plan.patches if to_hex(each.get_facecolor())
                == to_hex(regulator_colour(1))]  # fmt: skip
        sizes = [float(np.prod(np.ptp(each.get_xy(), axis=0))) for each in legs]
        largest.append(int(np.argmax(sizes)) == len(sizes) - 1)
    assert largest == [False, True]
