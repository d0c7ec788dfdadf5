"""Simulation beside measured trials: the paper's comparisons of rewards and of single robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.plan_view import HALF_WIDTH_MM, draw_plan_view
from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    regulator_colour,
)
from pneumorph.report.trials_figure import draw_channel
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.hardware.trial import Trial
    from pneumorph.hardware.trial_comparison import Comparison

SIMULATED_COLOUR = LEARNED_COLOUR
MEASURED_COLOUR = BASELINE_COLOUR


@figure_style()
def transfer_rewards_figure(comparisons: Sequence[Comparison]) -> Figure:
    """Return the distance of every robot, simulated and measured with its spread (paper, fig. 6).

    Args:
        comparisons: The robots, in the order to draw.
    """
    count = len(comparisons)
    figure = new_figure(max(3.6, 0.8 + 1.0 * count), 3.6)
    above, axes = figure.subplots(2, 1, height_ratios=(1, 2.6), sharex=True)
    place = np.arange(count)
    axes.bar(
        place - 0.2,
        [each.simulated_distance_cm for each in comparisons],
        0.36,
        color=SIMULATED_COLOUR,
        label="simulation",
    )
    axes.bar(
        place + 0.2,
        [each.mean_distance_cm for each in comparisons],
        0.36,
        yerr=[each.spread_cm or 0.0 for each in comparisons],
        color=MEASURED_COLOUR,
        ecolor=INK_COLOUR,
        capsize=3,
        label="measured",
    )
    for number, each in enumerate(comparisons):
        dots = np.full(len(each.distances_cm), number + 0.2)
        axes.plot(dots, each.distances_cm, ".", color=INK_COLOUR, markersize=3)
        size = 0.9 / (2.0 * HALF_WIDTH_MM)
        draw_plan_view(above, Design.parse(each.design).assignment, (number, 0.0), size_mm=size)
    above.set(ylim=(-0.5, 0.5), aspect="equal")
    above.axis("off")
    axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
    axes.set_xticks(place, [each.label for each in comparisons])
    axes.set(xlim=(-0.6, count - 0.4), ylabel="forward distance (cm)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@figure_style()
def transfer_gaits_figure(
    comparisons: Sequence[Comparison], trials: Sequence[Sequence[Trial]]
) -> Figure:
    """Return pressures and travel over time, one column a robot (paper, figs. 8 to 10).

    Args:
        comparisons: The robots.
        trials: Trials of each.
    """
    regulators = max(max(Design.parse(each.design).assignment) for each in comparisons)
    columns = len(comparisons)
    figure = new_figure(max(4.2, 2.9 * columns), 1.0 + 0.8 * regulators + 2.0)
    panels = figure.subplots(
        regulators + 1,
        columns,
        sharex=True,
        sharey="row",
        squeeze=False,
        height_ratios=[1.0] * regulators + [2.4],
    )
    for column, (comparison, own) in enumerate(zip(comparisons, trials, strict=True)):
        _draw_pressures(panels[:regulators, column], own)
        axes = panels[-1, column]
        axes.plot(
            comparison.time_s, comparison.simulated_cm, color=SIMULATED_COLOUR, label="simulation"
        )
        mean = comparison.measured_cm.mean(axis=0)
        if len(comparison.measured_cm) > 1:
            spread = comparison.measured_cm.std(axis=0, ddof=1)
            axes.fill_between(
                comparison.time_s,
                mean - spread,
                mean + spread,
                color=MEASURED_COLOUR,
                alpha=0.3,
                linewidth=0,
            )
        label = f"measured, {len(own)} trial{'s' if len(own) > 1 else ''}"
        axes.plot(comparison.time_s, mean, color=MEASURED_COLOUR, label=label)
        axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
        axes.set_xlabel("time (s)")
        panels[0, column].set_title(f"{comparison.label}: {comparison.design}", pad=16)
    panels[-1, 0].set_ylabel("forward distance (cm)")
    panels[-1, 0].legend(
        loc="lower left", bbox_to_anchor=(0.0, 0.98), ncols=2, fontsize=7, borderaxespad=0.1
    )
    return figure


def _draw_pressures(panels: np.ndarray, trials: Sequence[Trial]) -> None:
    for index, axes in enumerate(panels):
        draw_channel(axes, [trial.pressures for trial in trials], index)
        if axes.get_subplotspec().is_first_col():
            axes.set_ylabel(f"p{index + 1} (kPa)", color=regulator_colour(index + 1))
            if index == 0:
                axes.legend(
                    loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, fontsize=7,
                    borderaxespad=0.1,
                )  # fmt: skip
