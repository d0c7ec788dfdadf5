"""Error against time of a step over the two tolerances of the reduction: figure 12 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pneumorph.report.style import (
    INK_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
    white_between,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = ("o", "s", "^", "D", "v", "P")


@figure_style()
def tolerance_figure(
    grid: Sequence[Mapping[str, Any]], chosen: tuple[float, float] | None = None
) -> Figure:
    """Return mean node error in mm against time of a step in ms, both logarithmic.

    A colour is a mode tolerance, a marker a hyperreduction tolerance; each point says how many
    elements it has, the legend how many modes.

    Args:
        grid: Reductions, as `pneumorph compare` saves them under `tolerance_grid`; those without
            an error (their robots diverged) are left out.
        chosen: Mode and hyperreduction tolerance of the reduction in use, ringed.

    Raises:
        ValueError: No reduction with an error, or more tolerances than can be told apart.
    """
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    drawn = [each for each in grid if each.get("mean_node_error_mm") is not None]
    if not drawn:
        raise ValueError(
            f"none of the {len(grid)} reductions of the grid has a mean_node_error_mm, expected "
            "at least one; their robots diverged or were not compared"
        )
    modes = sorted({each["mode_tolerance"] for each in drawn}, reverse=True)
    elements = sorted({each["hyperreduction_tolerance"] for each in drawn}, reverse=True)
    if len(modes) > len(REGULATOR_COLOURS) or len(elements) > len(_MARKERS):
        raise ValueError(
            f"the grid has {len(modes)} mode and {len(elements)} hyperreduction tolerances, "
            f"expected at most {len(REGULATOR_COLOURS)} and {len(_MARKERS)}"
        )
    figure = new_figure(5.2, 3.6)
    axes = figure.add_subplot()
    for tolerance, colour in zip(modes, REGULATOR_COLOURS, strict=False):
        row = [each for each in drawn if each["mode_tolerance"] == tolerance]
        row.sort(key=lambda each: -float(each["hyperreduction_tolerance"]))
        times = [1e3 * each["s_per_step"] for each in row]
        errors = [each["mean_node_error_mm"] for each in row]
        axes.plot(times, errors, color=colour, linewidth=1.0)
        count = row[0]["mode_count"]
        axes.plot([], [], color=colour, linewidth=4, label=f"modes {tolerance:g} ({count})")
        for x, y, each in zip(times, errors, row, strict=True):
            marker = _MARKERS[elements.index(each["hyperreduction_tolerance"])]
            axes.plot(x, y, marker, color=colour, markersize=6)
            axes.annotate(
                f"{each['element_count']}",
                (x, y),
                xytext=(6, 4),
                textcoords="offset points",
                size=7,
                color=INK_COLOUR,
                path_effects=white_between(),
            )
            if chosen == (each["mode_tolerance"], each["hyperreduction_tolerance"]):
                axes.plot(x, y, "o", fillstyle="none", color=INK_COLOUR, markersize=13)
    for tolerance, marker in zip(elements, _MARKERS, strict=False):
        axes.plot([], [], marker, color=INK_COLOUR, label=f"elements {tolerance:g}")
    axes.set(xscale="log", yscale="log", xlabel="time of a step (ms)", ylabel="node error (mm)")
    axes.margins(0.12)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_title("at each point: its elements", size=8)
    figure.legend(loc="outside right upper", fontsize=8)
    return figure
