"""The assembly drawing of a design: views to scale, legs in section, parts list, tube plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.fabrication.fabricated_robot import FabricatedRobot
from pneumorph.fabrication.robot_to_make import HubToMake, LegToMake, RobotToMake, Seat
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.report.drawing_order import farthest_first
from pneumorph.report.silhouette import is_covered, silhouette
from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    fill_outline,
    new_figure,
    regulator_colour,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.fabrication.parts_list import Part
    from pneumorph.fabrication.tube_plan import TubeRun

A3_INCH = (16.54, 11.69)
_SCALES = (1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 50.0)
"""A drawing is one to so much: the least by which the plan fits."""
_INCH_MM = 25.4
_PLAN_MM = (175.0, 190.0)
_MARGIN_MM = 18.0
"""Left around the plan for numbers and dimensions, on paper [mm]."""
_FROM_ABOVE = np.eye(3)
_FROM_THE_RIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_ROOT_MM = 10.0
"""A leg's face may be so far from the hub's own without a tube that is said to leave it."""
Point = tuple[float, float]


@figure_style()
def assembly_drawing(robot: RobotToMake, parts: Sequence[Part], tubes: Sequence[TubeRun]) -> Figure:
    """Return an A3 sheet.

    Args:
        robot: The design with its legs and hub.
        parts: Its parts list.
        tubes: Its tube plan.
    """
    figure = new_figure(*A3_INCH)
    figure.set_layout_engine("none")  # views keep their places and scale
    scale = drawing_scale(robot)
    _plan(_view(figure, (20.0, 100.0), _PLAN_MM, scale), robot, scale)
    _side(_view(figure, (20.0, 15.0), (175.0, 70.0), scale), robot, scale)
    shapes = [leg for leg in robot.legs if leg.shape is not None]
    # Two beside each other, or as many as there are below each other at a smaller scale.
    for number, leg in enumerate(shapes[:4]):
        place = (205.0 + 100.0 * (number % 2), 245.0 - 20.0 * (number // 2))
        if len(shapes) == 1:
            _section(_view(figure, (205.0, 245.0), (120.0, 40.0), 2.0), leg, 2.0)
        else:
            _section(_view(figure, place, (95.0, 20.0), 4.0), leg, 4.0)
    _tables(figure, parts, tubes)
    _tube_note(figure, robot)
    _title(figure, robot)
    return figure


def write_assembly_drawing(path: Path, robot: RobotToMake, made: FabricatedRobot) -> Path:
    """Draw what was made as PDF, with a PNG beside it, and return the PDF."""
    figure = assembly_drawing(robot, made.parts, made.tubes)
    return save_figure(figure, path, ("pdf", "png"))[0]


def drawing_scale(robot: RobotToMake) -> float:
    """A millimetre on paper is so many of the robot: 2 for the paper's robot."""
    points = [robot.hub.outline_mm, *(corners for seat in robot.seats for corners in _boxes(seat))]
    reach = np.abs(np.concatenate(points)[:, :2]).max(axis=0)
    for scale in _SCALES[1:-1]:
        if np.all(reach / scale <= np.array(_PLAN_MM) / 2.0 - _MARGIN_MM * 0.5):
            return scale
    return _SCALES[-1]


def _place(figure: Figure, corner_mm: Point, size_mm: Point) -> Axes:
    """Axes of a place of the sheet."""
    sheet = np.array(A3_INCH) * _INCH_MM
    return figure.add_axes((*(np.array(corner_mm) / sheet), *(np.array(size_mm) / sheet)))


def _view(figure: Figure, corner_mm: Point, size_mm: Point, scale: float) -> Axes:
    """Axes of a place of the sheet whose unit is a real millimetre at a scale."""
    axes = _place(figure, corner_mm, size_mm)
    half = np.array(size_mm) * scale / 2.0
    axes.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), aspect="equal")
    axes.axis("off")
    return axes


def _boxes(seat: Seat) -> list[np.ndarray]:
    """Corners of each of a leg's boxes, or the leg's nodes, in the robot's frame, (point, 3)."""
    if seat.leg is None:
        return []
    if seat.leg.shape is None:
        return [seat.pose.apply(seat.leg.mesh.nodes)]
    return [_corners(seat, low, size) for low, size in seat.leg.shape.solid_boxes()]


def _corners(seat: Seat, low: Sequence[float], size: Sequence[float]) -> np.ndarray:
    """Of a box of a leg in the robot's frame, (corner, 3)."""
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    return seat.pose.apply(np.array(low) + corners * size)


def _coloured_boxes(seat: Seat) -> list[tuple[np.ndarray, str]]:
    """The same with their colours: a leg whose left and right chamber have regulators of their own
    is parted where its chambers are, along its middle plane."""
    colours = [regulator_colour(each) for each in seat.regulators]
    shape = None if seat.leg is None else seat.leg.shape
    if shape is None or shape.middle_wall_mm == 0.0 or len(set(colours)) < 2:
        return [(corners, colours[0]) for corners in _boxes(seat)]
    parted = []
    for low, size in shape.solid_boxes():
        for (begin, end), colour in zip(((0.0, np.inf), (-np.inf, 0.0)), colours, strict=True):
            start, stop = max(low[1], begin), min(low[1] + size[1], end)
            if stop > start:
                half = _corners(seat, (low[0], start, low[2]), (size[0], stop - start, size[2]))
                parted.append((half, colour))
    return parted


def _outline(axes: Axes, points: np.ndarray, colour: str, order: float) -> None:
    """Fill the convex outline of projected points."""
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points).vertices]
    axes.fill(*hull.T, facecolor=colour, edgecolor=INK_COLOUR, linewidth=0.5, zorder=order)


def _hub_outline(
    axes: Axes, hub: HubToMake, view: np.ndarray, order: float, lift: float = 0.0
) -> None:
    """Fill what a hub covers: of one that is a mesh that need not be convex.

    Args:
        axes: Where to draw.
        hub: The hub.
        view: Directions to the right, up and towards the viewer, (3, 3), a row each.
        order: When it is drawn.
        lift: How much higher.
    """
    up = np.array([0.0, lift])
    if hub.mesh is None:
        _outline(axes, hub.outline_mm @ view[:2].T + up, DISK_COLOUR, order)
        return
    corners = silhouette(hub.mesh.nodes @ view.T, boundary_triangles(hub.mesh.tetrahedra))
    fill_outline(axes, corners + up, DISK_COLOUR, INK_COLOUR, 1.0, order)


def _plan(axes: Axes, robot: RobotToMake, scale: float) -> None:
    from matplotlib.patches import Circle

    unit = scale / 2.0
    pieces = [piece for seat in robot.seats for piece in _coloured_boxes(seat)]
    order = farthest_first([corners for corners, _ in pieces], np.array([0.0, 0.0, -1.0]))
    for corners, colour in (pieces[number] for number in order):
        _outline(axes, corners[:, :2], colour, 2)
    hub = robot.hub
    _hub_outline(axes, hub, _FROM_ABOVE, 3)
    if hub.well_radius_mm > 0.0:
        axes.add_patch(
            Circle((0, 0), hub.well_radius_mm, facecolor="white", edgecolor=INK_COLOUR,
                   linewidth=0.7, zorder=3)
        )  # fmt: skip
    if hub.payload is not None:
        x, y, _ = hub.payload.place_mm
        axes.plot(x, y, marker="x", color=INK_COLOUR, zorder=6)
        axes.text(
            x, y - 6.0 * unit, f"payload, {hub.payload.told}", fontsize=6, ha="center", va="top",
            zorder=6, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        )  # fmt: skip
    taken = [seat.face_mm for seat in robot.seats if seat.leg is not None]
    for seat in robot.seats:
        # Of sites in one place, of which one may carry a leg, the others are not free.
        if seat.leg is not None or all(np.abs(seat.face_mm - each).max() > 1.0 for each in taken):
            _label(axes, seat, hub, unit)
    axes.annotate(
        "forward", (172 * unit, 172 * unit), (120 * unit, 172 * unit), fontsize=8, va="center",
        arrowprops={"arrowstyle": "->", "color": INK_COLOUR}, zorder=6,
    )  # fmt: skip
    wide, middle = hub.width_mm, float(hub.outline_mm[:, 0].max() + hub.outline_mm[:, 0].min()) / 2
    _dimension(
        axes,
        (middle - wide / 2, -168.0 * unit),
        (middle + wide / 2, -168.0 * unit),
        f"{'Ø ' if hub.round else ''}{round(wide, 1):g}",
        unit,
    )
    axes.text(0, 180 * unit, f"from above, 1:{scale:g}", ha="center", fontsize=9)


def _label(axes: Axes, seat: Seat, hub: HubToMake, unit: float) -> None:
    """The number of a place and its regulators, beside its leg or where one would be, and the tubes
    of a leg from the well."""
    angle = np.radians(seat.direction_deg)
    direction = np.array([np.cos(angle), np.sin(angle)])
    boxes = _boxes(seat)
    if boxes:
        inner = float(np.min(np.concatenate(boxes)[:, :2] @ direction))
        outer = float(np.max(np.concatenate(boxes)[:, :2] @ direction))
        across = seat.face_mm[:2] - (seat.face_mm[:2] @ direction) * direction
        left = np.array([-direction[1], direction[0]])
        ways = np.zeros(1) if seat.leg is None else seat.leg.chambers_leftwards_mm
        places = np.argsort(np.argsort(-ways, kind="stable"), kind="stable")
        for place, regulator in zip(places, seat.regulators, strict=True):
            # Tubes of several chambers beside each other, as the chambers are.
            beside = 2.0 * unit * (len(seat.regulators) - 1 - 2 * place) * left
            near = _middle(hub) + hub.well_radius_mm * direction + beside
            x, y = np.column_stack([near, across + (inner + 4.0) * direction + beside])
            axes.plot(x, y, color=regulator_colour(regulator), linewidth=2.0, zorder=4)
        told = "regulator" if len(seat.regulators) == 1 else "regulators"
        # One below the other: what stands beside a leg must not reach the tables.
        kind = "" if seat.leg is None or not seat.leg.name else f"{seat.leg.name}\n"
        rolled = f"\nrolled {seat.roll_deg:+.3g}°" if abs(seat.roll_deg) > 0.05 else ""
        text = f"{seat.location}: {kind}{told} {'+'.join(map(str, seat.regulators))}{rolled}"
        at = across + (outer + 3.0 * unit) * direction
    else:
        text = f"{seat.location}: free"
        at = seat.face_mm[:2] + 16.0 * unit * direction
    side, flip = ("left", 0.0) if direction[0] > -1e-9 else ("right", 180.0)
    axes.text(
        float(at[0]), float(at[1]), text, fontsize=7, ha=side, va="center",
        rotation=np.degrees(angle) + flip, rotation_mode="anchor", zorder=5,
    )  # fmt: skip


def _side(axes: Axes, robot: RobotToMake, scale: float) -> None:
    """Seen from the right (-y), forward to the right; what is nearer is drawn later."""
    unit = scale / 2.0
    lift = -15.0 * unit
    hub = robot.hub.outline_mm
    pieces = [(hub, DISK_COLOUR)]  # the hub's is drawn by itself
    pieces += [piece for seat in robot.seats for piece in _coloured_boxes(seat)]
    order = farthest_first([corners for corners, _ in pieces], np.array([0.0, 1.0, 0.0]))
    for place, number in enumerate(order):
        corners, colour = pieces[number]
        later = 2.0 + place / len(order)
        if number == 0:
            _hub_outline(axes, robot.hub, _FROM_THE_RIGHT, later, lift)
        else:
            _outline(axes, corners[:, [0, 2]] + [0.0, lift], colour, later)
    low, high = hub[:, 2].min(), hub[:, 2].max()
    _dimension(axes, (0.0, low + lift), (0.0, high + lift), f"{high - low:g}", unit)
    axes.text(0, 52 * unit, f"from the right, 1:{scale:g}", ha="center", fontsize=9)


def _section(axes: Axes, leg: LegToMake, scale: float) -> None:
    """A leg cut along its middle, or along a chamber: material shaded, cavity white."""
    from matplotlib.patches import Rectangle

    assert leg.shape is not None
    shape, unit = leg.shape, scale / 2.0
    for boxes, colour in ((shape.solid_boxes(), DISK_COLOUR), (shape.cavity_boxes(), "white")):
        for low, size in boxes:
            axes.add_patch(
                Rectangle((low[0], low[2]), size[0], size[2], facecolor=colour, linewidth=0)
            )
    end = shape.base_plate_mm[0] / 2
    axes.plot([-end, end], [0, 0], color=INK_COLOUR, linewidth=1.6)
    _dimension(axes, (-end, -8.0 * unit), (end, -8.0 * unit), f"{2 * end:g}", unit)
    high = shape.height_mm
    _dimension(axes, (end + 10 * unit, 0.0), (end + 10 * unit, high), f"{high:g}", unit)
    axes.text(0, high + 8.0 * unit, _told_section(leg.name, shape, scale), ha="center",
              fontsize=8 if scale == 2.0 else 6)  # fmt: skip


def _told_section(name: str, shape: PneuNetShape, scale: float) -> str:
    chamber, count = shape.chamber_mm, shape.inner_tooth_count
    roof = shape.height_mm - shape.base_plate_mm[2] - chamber[2]
    side = (shape.inner_tooth_length_mm - chamber[0]) / 2.0
    parted = shape.middle_wall_mm > 0.0
    wide = 0.5 * (chamber[1] - shape.middle_wall_mm) if parted else chamber[1]
    each = " on each side" if parted else ""
    rows = (
        f"{name or 'leg'}, {'section of a chamber' if parted else 'middle section'}, 1:{scale:g}: "
        f"{count} chambers {chamber[0]:g} x {wide:g} x {chamber[2]:g}{each},",
        f"walls {side:g}, {f'between the sides {shape.middle_wall_mm:g}, ' if parted else ''}"
        f"roof {roof:g}; paper below (bold)",
    )
    return "\n".join(rows)


def _dimension(axes: Axes, start: Point, end: Point, text: str, unit: float) -> None:
    # Not shrunk: the arrow's ends are those of what it measures.
    axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "color": INK_COLOUR,
                                              "linewidth": 0.6, "shrinkA": 0.0,
                                              "shrinkB": 0.0})  # fmt: skip
    x, y = np.add(start, end) / 2
    if start[0] == end[0]:
        axes.text(x + 2.0 * unit, y, text, ha="left", va="center", fontsize=7)
    else:
        axes.text(x, y + 1.5 * unit, text, ha="center", va="bottom", fontsize=7)


def _tables(figure: Figure, parts: Sequence[Part], tubes: Sequence[TubeRun]) -> None:
    def table(corner: Point, size: Point, title: str, head: list[str], rows: list[list[str]],
              widths: list[float]) -> None:  # fmt: skip
        axes = _place(figure, corner, size)
        axes.axis("off")
        axes.set_title(title, fontsize=9)
        made = axes.table(rows, colLabels=head, colWidths=widths, cellLoc="left", loc="upper left")
        made.auto_set_font_size(False)
        made.set_fontsize(7)

    def shown(value: float | None) -> str:
        return "" if value is None else f"{value:.1f}"

    table(
        (205.0, 130.0), (200.0, 95.0), "parts", ["", "part", "count", "", "ml", "g"],
        [
            [str(p.number), p.name, str(p.count), p.detail, shown(p.volume_ml), shown(p.mass_g)]
            for p in parts
        ],
        [0.04, 0.22, 0.08, 0.46, 0.1, 0.1],
    )  # fmt: skip
    table(
        (205.0, 45.0), (120.0, 70.0), "tubes, one a chamber",
        ["location", "direction", "regulator", "cut to"],
        [
            [
                f"{t.location}, {t.side}" if t.side else f"{t.location}",
                f"{t.direction_deg:g}°", str(t.regulator), f"{t.length_mm:g} mm",
            ]
            for t in tubes
        ],
        [0.25] * 4,
    )  # fmt: skip


def _middle(hub: HubToMake) -> np.ndarray:
    """Where tubes are led to, from above, (2,) [mm]."""
    low, high = hub.outline_mm.min(axis=0), hub.outline_mm.max(axis=0)
    return np.asarray(0.5 * (low + high)[:2])


def outside_the_hub(robot: RobotToMake) -> list[str]:
    """Places whose tubes leave the hub on their straight way to its middle, by number."""
    if robot.hub.mesh is None:
        return []
    nodes, skin = robot.hub.mesh.nodes, boundary_triangles(robot.hub.mesh.tetrahedra)
    found = []
    for seat in robot.seats:
        way = _middle(robot.hub) - seat.face_mm[:2]
        long = float(np.linalg.norm(way))
        if seat.leg is not None and long > _ROOT_MM:
            along = np.arange(_ROOT_MM, long, 1.0)[:, None] / long
            if not is_covered(seat.face_mm[:2] + along * way, nodes, skin).all():
                found.append(f"{seat.location}")
    return found


def _tube_note(figure: Figure, robot: RobotToMake) -> None:
    """Say which tubes cannot be led as they are drawn and cut."""
    outside = outside_the_hub(robot)
    if not outside:
        return
    axes = _place(figure, (330.0, 45.0), (80.0, 70.0))
    axes.axis("off")
    axes.text(
        0.0, 1.0,
        "Tubes are drawn and cut for the straight way to\nthe middle of the hub's length and width."
        f"\nThese leave the hub on it: {', '.join(outside)}.\n"
        "Lead them over the hub, and cut them longer.",
        fontsize=7, va="top",
    )  # fmt: skip


def _title(figure: Figure, robot: RobotToMake) -> None:
    axes = _place(figure, (205.0, 12.0), (200.0, 22.0))
    axes.set(xticks=[], yticks=[], xlim=(0, 1), ylim=(0, 1))
    axes.spines[:].set_visible(True)
    design = robot.design
    axes.text(0.02, 0.55, f"{robot.name} {design}", fontsize=14, va="center")
    count = len({regulator for seat in robot.seats for regulator in seat.regulators})
    axes.text(
        0.02, 0.18,
        f"{design.leg_count} legs on {count} regulators; "
        "millimetres; general tolerance ±0.2; pneumorph",
        fontsize=8, va="center",
    )  # fmt: skip
