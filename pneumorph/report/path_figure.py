"""The path of robots on the floor, seen from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.plan_view import draw_plan_view
from pneumorph.report.style import BASELINE_COLOUR, LEARNED_COLOUR, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory


@figure_style()
def path_figure(
    trajectories: Mapping[str, Trajectory], assignments: Mapping[str, Sequence[int]]
) -> Figure:
    """Return the paths of the tracked point in cm, with each robot drawn at its end.

    Args:
        trajectories: Trajectories by label.
        assignments: The design of each, by the same label.
    """
    figure = new_figure(5.2, 2.6)
    panels = figure.subplots(1, len(trajectories), squeeze=False, sharey=True)[0]
    colours = (LEARNED_COLOUR, BASELINE_COLOUR, "#009E73", "#CC79A7")
    for axes, (label, trajectory), colour in zip(
        panels, trajectories.items(), colours, strict=False
    ):
        path_cm = trajectory.tracked_point_mm[:, :2] / 10
        start = path_cm[0]
        rotation = trajectory.hub_rotation[-1]
        heading = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
        end_cm = (float(path_cm[-1, 0] - start[0]), float(path_cm[-1, 1] - start[1]))
        draw_plan_view(axes, assignments[label], end_cm, heading, size_mm=0.1)
        axes.plot(*(path_cm - start).T, color=colour, linewidth=2.0, zorder=3)
        axes.plot(0, 0, "o", color=colour, markersize=4, zorder=3)
        axes.set_title(label)
        axes.set(xlabel="forward (cm)", xlim=(-18, 32), ylim=(-18, 18))
        axes.set_aspect("equal")
    panels[0].set_ylabel("sideways (cm)")
    return figure
