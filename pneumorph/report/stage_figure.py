"""Where the time of a run went, stage by stage."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pneumorph.report.style import LEARNED_COLOUR, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    figure = new_figure(5.2, 0.7 + 0.26 * len(stage_seconds))
    axes = figure.add_subplot()
    names = [name.replace("_", " ") for name in stage_seconds]
    bars = axes.barh(names, list(stage_seconds.values()), color=LEARNED_COLOUR)
    axes.bar_label(bars, fmt="%.3g", padding=3, size=7)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.grid(axis="y", visible=False)
    axes.set(xlabel="time (s)")
    return figure
