"""A robot seen from above: legs coloured by regulator, forward to the right (paper, figure 3a).

What stands on a leg is its entry in the name of the design: its kind and its regulators. A leg of
several regulators is parted where its chambers are. What the hub carries is a dark ball.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.plan import HALF_WIDTH_MM, Plan
from pneumorph.report.plan_bands import way_out
from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    fill_outline,
    new_axes,
    regulator_colour,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OUTWARDS_MM = 12.0
"""How far beyond a leg's middle its number stands."""
_WIDEST = 2.6
"""Characters of full size that find room on a leg; of more regulators they are smaller."""


def draw_plan_view(
    axes: Axes,
    plan: Plan,
    centre_mm: tuple[float, float] = (0.0, 0.0),
    heading_rad: float = 0.0,
    size_mm: float = 1.0,
    number_size: float = 0.0,
) -> None:
    """Draw a robot into axes whose units are millimetres.

    Args:
        axes: Where to draw.
        plan: The robot from above.
        centre_mm: Where its frame's origin is, (x, y).
        heading_rad: Turn of the robot about the vertical.
        size_mm: Size of a drawn millimetre in the axes' units.
        number_size: Size of what stands on the legs, in points; 0 for none.
    """
    from matplotlib.patheffects import withStroke

    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    turn = np.array([[cosine, -sine], [sine, cosine]])

    def placed(points: np.ndarray) -> np.ndarray:
        return np.asarray(points @ turn.T * size_mm + centre_mm)

    for leg, (outline, entry) in enumerate(zip(plan.legs_mm, plan.entries, strict=True)):
        middle, away = way_out(outline)
        parts = [(band, regulator_colour(each)) for band, each in plan.coloured(leg)]
        for band, colour in parts:
            axes.fill(*placed(band).T, facecolor=colour, edgecolor="white", linewidth=0.6)
        if number_size:
            # The number says what the colour says, for grey print.
            x, y = placed(middle + _OUTWARDS_MM * away)
            size = number_size * min(1.0, _WIDEST / len(entry))
            rim = [withStroke(linewidth=1.6, foreground=parts[-1][1])]  # where a leg is narrow
            axes.text(x, y, entry, color="white", ha="center", va="center", size=size,
                      path_effects=rim)  # fmt: skip
    if len(plan.hub_mm):
        fill_outline(axes, placed(plan.hub_mm), DISK_COLOUR, "white", 0.8)
    x, y = centre_mm
    ahead, aside = 30.0 * size_mm * np.array([cosine, sine])
    arrow = {"arrowstyle": "->", "color": INK_COLOUR, "linewidth": 0.9}
    axes.annotate("", (x + ahead, y + aside), (x - ahead, y - aside), arrowprops=arrow)
    if plan.payload is not None:
        axes.plot(*placed(plan.payload.line_mm).T, color=INK_COLOUR, linewidth=0.9)
        ball = placed(plan.payload.outline_mm)
        axes.fill(*ball.T, facecolor=INK_COLOUR, edgecolor="white", linewidth=0.6, zorder=4)


def framed_plan_view(axes: Axes, plan: Plan, number_size: float = 0.0) -> None:
    """Draw a robot alone into axes, which end where it does; arguments as `draw_plan_view`."""
    draw_plan_view(axes, plan, number_size=number_size)
    half = max(HALF_WIDTH_MM, 1.03 * plan.half_width_mm)
    axes.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    axes.axis("off")


@figure_style()
def plan_view_figure(plan: Plan, title: str = "") -> Figure:
    """Return a small square figure of one robot."""
    figure, axes = new_axes(1.9, 1.9 if not title else 2.1)
    framed_plan_view(axes, plan, number_size=8.0)
    if title:
        axes.set_title(title, size=8, loc="center")
    return figure
