"""Figures of reductions: a leg's bend, errors over time and over tolerances, time of stages."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    PATH_COLOURS,
    REGULATOR_COLOURS,
    figure_style,
    new_axes,
    white_between,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.study.reduction_grid import GridPoint

_MARKERS = ("o", "s", "^", "D", "v", "P")


@figure_style()
def bend_figure(
    pressure_kPa: Sequence[float], full_deg: Sequence[float], reduced_deg: Sequence[float]
) -> Figure:
    """Return bend of a leg in degrees against simulated pressure in kPa for both models."""
    figure, axes = new_axes()
    axes.plot(pressure_kPa, full_deg, color=BASELINE_COLOUR, linewidth=4, label="full model")
    axes.plot(pressure_kPa, reduced_deg, "o-", color=LEARNED_COLOUR, markersize=3, label="reduced")
    axes.set(xlabel="simulated pressure (kPa)", ylabel="bend (°)")
    axes.legend(loc="upper left")
    return figure


@figure_style()
def node_error_figure(error_mm: Mapping[str, np.ndarray], frame_s: float) -> Figure:
    """Return the error of each run against time: where reduced robots part from the full ones.

    Args:
        error_mm: Mean node error of each frame [mm], by the run's name.
        frame_s: Time from frame to frame [s].
    """
    figure, axes = new_axes()
    count = len(PATH_COLOURS)
    for number, (name, error) in enumerate(error_mm.items()):
        axes.plot(frame_s * np.arange(len(error)), error, linewidth=1.0, label=name,
                  color=PATH_COLOURS[number % count], linestyle="-" if number < count else "--",
        )  # fmt: skip
    axes.set(xlabel="time (s)", ylabel="mean node error (mm)", ylim=(0.0, None))
    axes.legend(loc="upper left", fontsize="x-small", ncols=2 if len(error_mm) > 6 else 1)
    return figure


@figure_style()
def stage_figure(stage_seconds: Mapping[str, float]) -> Figure:
    """Return the wall time of each stage in s as bars, in their order.

    Args:
        stage_seconds: Seconds by the stage's name.

    Raises:
        ValueError: No stages.
    """
    if not stage_seconds:
        raise ValueError("stage_seconds is empty, expected at least one stage")
    figure, axes = new_axes(5.2, 0.7 + 0.26 * len(stage_seconds))
    names = [name.replace("_", " ") for name in stage_seconds]
    bars = axes.barh(names, list(stage_seconds.values()), color=LEARNED_COLOUR)
    axes.bar_label(bars, fmt="%.3g", padding=3, size=7)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.grid(axis="y", visible=False)
    axes.set(xlabel="time (s)")
    return figure


@figure_style()
def tolerance_figure(
    grid: Sequence[GridPoint], chosen: tuple[float, float] | None = None
) -> Figure:
    """Return mean node error in mm against time of a step in ms, both logarithmic (figure 12).

    A colour is a mode tolerance, a marker a hyperreduction tolerance; each point says how many
    elements it has, the legend how many modes.

    Args:
        grid: Reductions; those without an error (their robots diverged) are left out.
        chosen: Mode and hyperreduction tolerance of the reduction in use, ringed.

    Raises:
        ValueError: No reduction with an error, or more tolerances than can be told apart.
    """
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    drawn = [each for each in grid if math.isfinite(each.mean_node_error_mm)]
    if not drawn:
        raise ValueError(
            f"none of the {len(grid)} reductions of the grid has a mean_node_error_mm, expected "
            "at least one; their robots diverged or were not compared"
        )
    modes = sorted({each.mode_tolerance for each in drawn}, reverse=True)
    elements = sorted({each.hyperreduction_tolerance for each in drawn}, reverse=True)
    if len(modes) > len(REGULATOR_COLOURS) or len(elements) > len(_MARKERS):
        raise ValueError(
            f"the grid has {len(modes)} mode and {len(elements)} hyperreduction tolerances, "
            f"expected at most {len(REGULATOR_COLOURS)} and {len(_MARKERS)}"
        )
    figure, axes = new_axes(5.2, 3.6)
    for tolerance, colour in zip(modes, REGULATOR_COLOURS, strict=False):
        row = [each for each in drawn if each.mode_tolerance == tolerance]
        row.sort(key=lambda each: -each.hyperreduction_tolerance)
        places = [(1e3 * each.s_per_step, each.mean_node_error_mm) for each in row]
        axes.plot(*zip(*places, strict=True), color=colour, linewidth=1.0)
        count = row[0].mode_count
        axes.plot([], [], color=colour, linewidth=4, label=f"modes {tolerance:g} ({count})")
        for place, each in zip(places, row, strict=True):
            marker = _MARKERS[elements.index(each.hyperreduction_tolerance)]
            axes.plot(*place, marker, color=colour, markersize=6)
            axes.annotate(f"{each.element_count}", place, xytext=(6, 4), size=7,
                          textcoords="offset points", path_effects=white_between(),
                          color=INK_COLOUR)  # fmt: skip
            if chosen == (each.mode_tolerance, each.hyperreduction_tolerance):
                axes.plot(*place, "o", fillstyle="none", color=INK_COLOUR, markersize=13)
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
