"""Distance over time of several robots, as in the lower panels of figure 8 of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory


@figure_style()
def distance_figure(trajectories: Mapping[str, Trajectory]) -> Figure:
    """Return forward distance in cm against time in s, one line a robot.

    Args:
        trajectories: Trajectories by label, the most important first.
    """
    figure = new_figure()
    axes = figure.add_subplot()
    colours = (LEARNED_COLOUR, BASELINE_COLOUR, *REGULATOR_COLOURS[1:4])
    for (label, trajectory), colour in zip(trajectories.items(), colours, strict=False):
        x = trajectory.tracked_point_mm[:, 0]
        distance_cm = (x - x[0]) / 10
        axes.plot(trajectory.time_s, distance_cm, color=colour, label=label)
        axes.annotate(
            f"{distance_cm[-1]:.1f}",
            (trajectory.time_s[-1], distance_cm[-1]),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            color=colour,
        )
    axes.axhline(0, color=INK_COLOUR, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="forward distance (cm)")
    axes.legend(loc="upper left")
    return figure
