"""A robot seen from above: legs coloured by regulator, forward to the right (paper, figure 3a).

What stands on a leg is its entry in the name of the design: its kind and its regulators. A leg of
several regulators has a band for each, the first nearest to the hub.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.plan import HALF_WIDTH_MM, Plan
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

    legs = zip(plan.legs_mm, plan.regulators, plan.entries, strict=True)
    for outline, regulators, entry in legs:
        colours = [regulator_colour(each) for each in regulators]
        middle, away = _way_out(outline)
        for band, colour in zip(_bands(outline, away, len(colours)), colours, strict=True):
            axes.fill(*placed(band).T, facecolor=colour, edgecolor="white", linewidth=0.6)
        if number_size:
            # The number says what the colour says, for grey print.
            x, y = placed(middle + _OUTWARDS_MM * away)
            size = number_size * min(1.0, _WIDEST / len(entry))
            rim = [withStroke(linewidth=1.6, foreground=colours[-1])]  # where a leg is narrow
            axes.text(x, y, entry, color="white", ha="center", va="center", size=size,
                      path_effects=rim)  # fmt: skip
    if len(plan.hub_mm):
        axes.fill(*placed(plan.hub_mm).T, facecolor=DISK_COLOUR, edgecolor="white", linewidth=0.8)
    x, y = centre_mm
    ahead, aside = 30.0 * size_mm * np.array([cosine, sine])
    arrow = {"arrowstyle": "->", "color": INK_COLOUR, "linewidth": 0.9}
    axes.annotate("", (x + ahead, y + aside), (x - ahead, y - aside), arrowprops=arrow)


def _way_out(outline: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle of an outline (corner, 2), and the direction to it from the origin."""
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    return middle, middle / max(float(np.linalg.norm(middle)), 1.0)


def _bands(outline: np.ndarray, away: np.ndarray, count: int) -> list[np.ndarray]:
    """Parts of a convex outline (corner, 2), one after another in a direction and as long as each
    other."""
    along = outline @ away
    cuts = np.linspace(along.min(), along.max(), count + 1)[1:-1]
    parts = []
    for cut in cuts:
        parts.append(_beyond(outline, -away, -cut))
        outline = _beyond(outline, away, cut)
    return [*parts, outline]


def _beyond(outline: np.ndarray, direction: np.ndarray, least: float) -> np.ndarray:
    """What of a convex outline is at least so far in a direction (Sutherland and Hodgman 1974)."""
    kept = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        before, after = start @ direction - least, end @ direction - least
        if before >= 0.0:
            kept.append(start)
        if before * after < 0.0:
            kept.append(start + before / (before - after) * (end - start))
    return np.array(kept).reshape(-1, 2)


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
