"""Commanded and regulated pressures of a gait, as in the upper panels of figure 8 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pneumorph.report.style import figure_style, new_figure, regulator_colour

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory


@figure_style()
def pressure_figure(trajectory: Trajectory, regulator_count: int | None = None) -> Figure:
    """Return pressures in kPa against time in s, one panel a regulator.

    Args:
        trajectory: Whose gait.
        regulator_count: How many regulators the design uses; None for all recorded.
    """
    count = regulator_count or trajectory.commanded_kPa.shape[1]
    figure = new_figure(5.2, 0.7 + 0.85 * count)
    panels = figure.subplots(count, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for index, axes in enumerate(panels):
        colour = regulator_colour(index + 1)
        axes.step(
            trajectory.time_s,
            trajectory.commanded_kPa[:, index],
            color=colour,
            linewidth=0.9,
            linestyle=(0, (3, 2)),
            label="commanded",
        )
        axes.plot(
            trajectory.time_s, trajectory.regulated_kPa[:, index], color=colour, label="regulated"
        )
        axes.set_ylabel(f"regulator {index + 1}", color=colour)
        axes.set_yticks([0, 45, 90])
    panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
    panels[0].set_title("pressure (kPa)")
    panels[-1].set_xlabel("time (s)")
    return figure
