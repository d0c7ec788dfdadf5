"""A design seen from above: legs coloured by regulator, forward to the right (paper, figure 3a)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    new_figure,
    regulator_colour,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DISK_RADIUS_MM = 54.5
LEG_LENGTH_MM = 115.0 * np.cos(np.radians(15.0))
LEG_CENTRE_MM = 52.0 * np.cos(np.radians(15.0)) + 50.0
LEG_WIDTH_MM = 32.0
HALF_WIDTH_MM = 172.0


def draw_plan_view(
    axes: Axes,
    assignment: Sequence[int],
    centre_mm: tuple[float, float] = (0.0, 0.0),
    heading_rad: float = 0.0,
    size_mm: float = 1.0,
    number_size: float = 0.0,
) -> None:
    """Draw a design into axes whose units are millimetres.

    Args:
        axes: Where to draw.
        assignment: For each location, counted counter-clockwise from the forward direction, 0 for
            no leg or the number of its regulator.
        centre_mm: Where the disk's centre is, (x, y).
        heading_rad: Turn of the robot about the vertical.
        size_mm: Size of a drawn millimetre in the axes' units.
        number_size: Size of the regulators' numbers on the legs, in points; 0 for none.
    """
    from matplotlib.patches import Circle, Polygon

    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    rectangle = corners * [LEG_LENGTH_MM, LEG_WIDTH_MM] + [LEG_CENTRE_MM, 0.0]
    for location, regulator in enumerate(assignment):
        if regulator == 0:
            continue
        angle = 2 * np.pi * (location + 0.5) / len(assignment) + heading_rad
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        outline = rectangle @ turn.T * size_mm + centre_mm
        axes.add_patch(
            Polygon(
                outline, facecolor=regulator_colour(regulator), edgecolor="white", linewidth=0.6
            )
        )
        if number_size:
            # The number says what the colour says, for grey print.
            x, y = np.array([LEG_CENTRE_MM + 12, 0.0]) @ turn.T * size_mm + centre_mm
            axes.text(
                x, y, str(regulator), color="white", ha="center", va="center", size=number_size
            )
    axes.add_patch(
        Circle(
            centre_mm,
            DISK_RADIUS_MM * size_mm,
            facecolor=DISK_COLOUR,
            edgecolor="white",
            linewidth=0.8,
        )
    )
    ahead = np.array([np.cos(heading_rad), np.sin(heading_rad)]) * 30.0 * size_mm
    axes.annotate(
        "",
        xy=(centre_mm[0] + ahead[0], centre_mm[1] + ahead[1]),
        xytext=(centre_mm[0] - ahead[0], centre_mm[1] - ahead[1]),
        arrowprops={"arrowstyle": "->", "color": INK_COLOUR, "linewidth": 0.9},
    )


@figure_style()
def plan_view_figure(assignment: Sequence[int], title: str = "") -> Figure:
    """Return a small square figure of one design."""
    figure = new_figure(1.9, 1.9 if not title else 2.1)
    axes = figure.add_subplot()
    draw_plan_view(axes, assignment, number_size=8.0)
    axes.set(xlim=(-HALF_WIDTH_MM, HALF_WIDTH_MM), ylim=(-HALF_WIDTH_MM, HALF_WIDTH_MM))
    axes.set_aspect("equal")
    axes.axis("off")
    if title:
        axes.set_title(title, size=8, loc="center")
    return figure
