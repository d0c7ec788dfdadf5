"""A design seen from above: legs coloured by regulator, forward to the right (paper, figure 3a)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    new_axes,
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
    from matplotlib.patches import Circle

    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    rectangle = corners * [LEG_LENGTH_MM, LEG_WIDTH_MM] + [LEG_CENTRE_MM, 0.0]
    for location, regulator in enumerate(assignment):
        if regulator == 0:
            continue
        angle = 2 * np.pi * (location + 0.5) / len(assignment) + heading_rad
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        outline = rectangle @ turn.T * size_mm + centre_mm
        colour = regulator_colour(regulator)
        axes.fill(*outline.T, facecolor=colour, edgecolor="white", linewidth=0.6)
        if number_size:
            # The number says what the colour says, for grey print.
            x, y = np.array([LEG_CENTRE_MM + 12, 0.0]) @ turn.T * size_mm + centre_mm
            axes.text(
                x, y, str(regulator), color="white", ha="center", va="center", size=number_size
            )
    disk = Circle(centre_mm, DISK_RADIUS_MM * size_mm, linewidth=0.8)
    axes.add_patch(disk).set(facecolor=DISK_COLOUR, edgecolor="white")
    x, y = centre_mm
    ahead, aside = 30.0 * size_mm * np.array([np.cos(heading_rad), np.sin(heading_rad)])
    arrow = {"arrowstyle": "->", "color": INK_COLOUR, "linewidth": 0.9}
    axes.annotate("", (x + ahead, y + aside), (x - ahead, y - aside), arrowprops=arrow)


def framed_plan_view(axes: Axes, assignment: Sequence[int], number_size: float = 0.0) -> None:
    """Draw a design alone into axes, which end where it does; arguments as `draw_plan_view`."""
    draw_plan_view(axes, assignment, number_size=number_size)
    ends = (-HALF_WIDTH_MM, HALF_WIDTH_MM)
    axes.set(xlim=ends, ylim=ends, aspect="equal")
    axes.axis("off")


@figure_style()
def plan_view_figure(assignment: Sequence[int], title: str = "") -> Figure:
    """Return a small square figure of one design."""
    figure, axes = new_axes(1.9, 1.9 if not title else 2.1)
    framed_plan_view(axes, assignment, number_size=8.0)
    if title:
        axes.set_title(title, size=8, loc="center")
    return figure
