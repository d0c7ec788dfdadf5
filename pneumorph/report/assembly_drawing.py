"""The assembly drawing of a design: views to scale, leg in section, parts list, tube plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.fabrication.fabricated_robot import FabricatedRobot, FabricationSettings
from pneumorph.fabrication.hub import HubSettings
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    new_figure,
    regulator_colour,
    save_figure,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.fabrication.parts_list import Part, TubeRun

A3_INCH = (16.54, 11.69)
SCALE = 2.0
"""Drawn one to two."""
_INCH_MM = 25.4
Point = tuple[float, float]


@figure_style()
def assembly_drawing(
    design: Design,
    parts: Sequence[Part],
    tubes: Sequence[TubeRun],
    leg: PneuNetShape | None = None,
    disk: DiskShape | None = None,
    mounting: RadialMounting | None = None,
    hub: HubSettings | None = None,
) -> Figure:
    """Return an A3 sheet, views at 1:2.

    Args:
        design: The design.
        parts: Its parts list.
        tubes: Its tube plan.
        leg: Sizes of the leg.
        disk: Sizes of the disk.
        mounting: Where legs sit.
        hub: Sizes of the printed hub.
    """
    leg, disk, mounting = leg or PneuNetShape(), disk or DiskShape(), mounting or RadialMounting()
    figure = new_figure(*A3_INCH)
    figure.set_layout_engine("none")  # views keep their places and scale
    well_mm = (hub or HubSettings()).well_radius_mm
    _plan(_view(figure, (20.0, 100.0), (175.0, 190.0)), design, leg, disk, mounting, well_mm)
    _side(_view(figure, (20.0, 15.0), (175.0, 70.0)), design, leg, disk, mounting)
    _section(_view(figure, (205.0, 245.0), (120.0, 40.0)), leg)
    _tables(figure, parts, tubes)
    _title(figure, design)
    return figure


def write_assembly_drawing(
    path: Path, made: FabricatedRobot, settings: FabricationSettings
) -> Path:
    """Draw what was made as PDF, with a PNG beside it, and return the PDF."""
    figure = assembly_drawing(
        Design.parse(made.design),
        made.parts,
        made.tubes,
        settings.leg,
        settings.disk,
        settings.mounting,
        settings.hub,
    )
    return save_figure(figure, path, ("pdf", "png"))[0]


def _place(figure: Figure, corner_mm: Point, size_mm: Point) -> Axes:
    """Axes of a place of the sheet."""
    sheet = np.array(A3_INCH) * _INCH_MM
    return figure.add_axes((*(np.array(corner_mm) / sheet), *(np.array(size_mm) / sheet)))


def _view(figure: Figure, corner_mm: Point, size_mm: Point) -> Axes:
    """Axes of a place of the sheet whose unit is a real millimetre at the drawing's scale."""
    axes = _place(figure, corner_mm, size_mm)
    half = np.array(size_mm) * SCALE / 2.0
    axes.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), aspect="equal")
    axes.axis("off")
    return axes


def _leg_boxes(leg: PneuNetShape, mounting: RadialMounting, location: int) -> list[np.ndarray]:
    """Corners of each of a leg's boxes in the robot's frame, (8, 3)."""
    pose = mounting.pose(location)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    return [pose.apply(np.array(low) + corners * size) for low, size in leg.solid_boxes()]


def _outline(axes: Axes, points: np.ndarray, colour: str, order: float) -> None:
    """Fill the convex outline of projected points."""
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points).vertices]
    axes.fill(*hull.T, facecolor=colour, edgecolor=INK_COLOUR, linewidth=0.5, zorder=order)


def _plan(
    axes: Axes,
    design: Design,
    leg: PneuNetShape,
    disk: DiskShape,
    mounting: RadialMounting,
    well_mm: float,
) -> None:
    from matplotlib.patches import Circle

    for location, regulator in design.legs:
        for corners in _leg_boxes(leg, mounting, location):
            _outline(axes, corners[:, :2], regulator_colour(regulator), 2)
    for radius, fill in ((disk.top_radius_mm, DISK_COLOUR), (well_mm, "white")):
        axes.add_patch(
            Circle((0, 0), radius, facecolor=fill, edgecolor=INK_COLOUR, linewidth=0.7, zorder=3)
        )
    regulators = dict(design.legs)
    for location in range(design.location_count):
        angle = design.angle_rad(location)
        direction = np.array([np.cos(angle), np.sin(angle)])
        regulator = regulators.get(location, 0)
        if regulator:
            x, y = np.outer(direction, [well_mm, disk.top_radius_mm])
            axes.plot(x, y, color=regulator_colour(regulator), linewidth=2.0, zorder=4)
        text = f"{location}: " + (f"regulator {regulator}" if regulator else "free socket")
        side, flip = ("left", 0.0) if direction[0] > 0 else ("right", 180.0)
        x, y = direction * (165.0 if regulator else 70.0)
        axes.text(
            x, y, text, fontsize=7, ha=side, va="center",
            rotation=np.degrees(angle) + flip, rotation_mode="anchor", zorder=5,
        )  # fmt: skip
    axes.annotate(
        "forward", (172, 0), (120, 0), fontsize=8, va="center",
        arrowprops={"arrowstyle": "->", "color": INK_COLOUR}, zorder=6,
    )  # fmt: skip
    _dimension(axes, (-disk.top_radius_mm, -168.0), (disk.top_radius_mm, -168.0),
               f"Ø {2 * disk.top_radius_mm:g}")  # fmt: skip
    axes.text(0, 180, "from above, 1:2", ha="center", fontsize=9)


def _side(
    axes: Axes, design: Design, leg: PneuNetShape, disk: DiskShape, mounting: RadialMounting
) -> None:
    """Seen from the right (-y), forward to the right; nearer legs are drawn later."""
    lift = -15.0
    legs = sorted(design.legs, key=lambda each: -np.sin(design.angle_rad(each[0])))
    for order, (location, regulator) in enumerate(legs):
        for corners in _leg_boxes(leg, mounting, location):
            points = corners[:, [0, 2]] + [0.0, lift]
            _outline(axes, points, regulator_colour(regulator), 2 + 0.1 * order)
    low, high = disk.bottom_mm, disk.bottom_mm + disk.height_mm
    r1, r2 = disk.bottom_radius_mm, disk.top_radius_mm
    hull = np.array([[-r1, low], [r1, low], [r2, high], [-r2, high]])
    hull[:, 1] += lift
    _outline(axes, hull, DISK_COLOUR, 2.5)
    _dimension(axes, (0.0, low + lift), (0.0, high + lift), f"{disk.height_mm:g}")
    axes.text(0, 52, f"from the right, 1:2; legs pitched {mounting.pitch_deg:g}°", ha="center",
              fontsize=9)  # fmt: skip


def _section(axes: Axes, leg: PneuNetShape) -> None:
    """A leg cut along its middle: material shaded, cavity white."""
    from matplotlib.patches import Rectangle

    for boxes, colour in ((leg.solid_boxes(), DISK_COLOUR), (leg.cavity_boxes(), "white")):
        for low, size in boxes:
            axes.add_patch(
                Rectangle((low[0], low[2]), size[0], size[2], facecolor=colour, linewidth=0)
            )
    end = leg.base_plate_mm[0] / 2
    axes.plot([-end, end], [0, 0], color=INK_COLOUR, linewidth=1.6)
    _dimension(axes, (-end, -8.0), (end, -8.0), f"{2 * end:g}")
    _dimension(axes, (end + 10, 0.0), (end + 10, leg.height_mm), f"{leg.height_mm:g}")
    chamber = leg.chamber_mm
    roof = leg.height_mm - leg.base_plate_mm[2] - chamber[2]
    side = (leg.inner_tooth_length_mm - chamber[0]) / 2.0
    axes.text(
        0, 28,
        f"leg, middle section, 1:2: {leg.inner_tooth_count} chambers {chamber[0]:g} x "
        f"{chamber[1]:g} x {chamber[2]:g}, walls {side:g}, roof {roof:g}; paper below (bold)",
        ha="center", fontsize=8,
    )  # fmt: skip


def _dimension(axes: Axes, start: Point, end: Point, text: str) -> None:
    axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "color": INK_COLOUR,
                                              "linewidth": 0.6})  # fmt: skip
    x, y = np.add(start, end) / 2
    if start[0] == end[0]:
        axes.text(x + 2.0, y, text, ha="left", va="center", fontsize=7)
    else:
        axes.text(x, y + 1.5, text, ha="center", va="bottom", fontsize=7)


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
        (205.0, 45.0), (120.0, 70.0), "tubes, one a leg",
        ["location", "direction", "regulator", "cut to"],
        [
            [str(t.location), f"{t.direction_deg:g}°", str(t.regulator), f"{t.length_mm:g} mm"]
            for t in tubes
        ],
        [0.25] * 4,
    )  # fmt: skip


def _title(figure: Figure, design: Design) -> None:
    axes = _place(figure, (205.0, 12.0), (200.0, 22.0))
    axes.set(xticks=[], yticks=[], xlim=(0, 1), ylim=(0, 1))
    axes.spines[:].set_visible(True)
    axes.text(0.02, 0.55, f"crawling robot {design}", fontsize=14, va="center")
    axes.text(
        0.02, 0.18,
        f"{design.leg_count} legs on {len(set(dict(design.legs).values()))} regulators; "
        "millimetres; general tolerance ±0.2; pneumorph",
        fontsize=8, va="center",
    )  # fmt: skip
