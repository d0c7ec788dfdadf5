"""Figures of how far gaits bear another world: margins to slipping, other floors, random worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.friction_margin import LIMIT_SHARE, FrictionMargin
from pneumorph.gait.walk import last_cycle
from pneumorph.report.style import (
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    legend_beside,
    new_axes,
    new_figure,
    zero_line,
)
from pneumorph.report.walk_figures import draw_legs
from pneumorph.robot.design import Design
from pneumorph.study.robustness import Robustness

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def margin_figure(
    margins: Mapping[str, tuple[Design, FrictionMargin]], cycle_s: float = 4.0
) -> Figure:
    """Return the share of friction that each leg uses in the last whole cycle, a panel a robot.

    Args:
        margins: Design and margins by label.
        cycle_s: Length of a cycle [s].

    Raises:
        ValueError: No robot, or a walk shorter than a cycle.
    """
    if not margins:
        raise ValueError("margins is empty, expected at least one robot's")
    figure = new_figure(5.6, 0.6 + 1.5 * len(margins))
    panels = figure.subplots(len(margins), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (label, (design, margin)) in zip(panels, margins.items(), strict=True):
        begin_s, inside = last_cycle(margin.time_s, cycle_s)
        draw_legs(axes, margin.time_s[inside] - begin_s, margin.used_share[inside], design.legs)
        axes.axhspan(LIMIT_SHARE, 1.0, color=NEUTRAL_COLOUR, alpha=0.25, linewidth=0)
        axes.set(ylim=(0.0, 1.03), xlim=(0.0, cycle_s), ylabel="used")
        axes.set_title(f"{label}: {design}", size=9)
        legend_beside(axes)
    panels[-1].set_xlabel("time in the last whole cycle (s)")
    figure.supylabel("share of friction used (shaded: the leg slides)", size=7)
    return figure


@figure_style()
def friction_figure(
    frictions: Sequence[float],
    achieved: Mapping[str, Sequence[float]],
    trained_friction: float | None = None,
    goal: Goal = FORWARD,
) -> Figure:
    """Return what of a goal is achieved against the friction coefficient, a line a robot.

    Args:
        frictions: Coulomb coefficients, of every surface alike.
        achieved: At each [the goal's unit], by label; NaN where a simulation failed.
        trained_friction: Coefficient of every surface that the recorded walks were made with, drawn
            as a line; None where they differ.
        goal: What is achieved.
    """
    figure, axes = new_axes()
    for number, (label, distances) in enumerate(achieved.items()):
        colour = REGULATOR_COLOURS[number % len(REGULATOR_COLOURS)]
        axes.plot(frictions, distances, "o-", markersize=3, color=colour, label=label)
    if trained_friction is not None:
        axes.axvline(trained_friction, color=INK_COLOUR, linewidth=0.8, linestyle=":")
    zero_line(axes)
    axes.set(xlabel="friction coefficient", ylabel=goal.in_unit(goal.label))
    legend_beside(axes)
    return figure


@figure_style()
def robustness_figure(found: Robustness) -> Figure:
    """Return what each pair achieves in every world drawn at random.

    Args:
        found: Pairs in worlds drawn at random.

    Raises:
        ValueError: No pairs.
    """
    pairs, distances = found.pairs, found.achieved
    if not pairs:
        raise ValueError("no pairs to draw, expected at least one")
    figure, axes = new_axes(max(4.2, 1.0 + 0.75 * len(pairs)), 3.2)
    places = np.arange(len(pairs))
    # A fixed spread across, in the worlds' order: the same picture each time.
    across = places + 0.25 * np.linspace(-1.0, 1.0, len(distances))[:, None]
    axes.plot(across, distances, ".", color=NEUTRAL_COLOUR, markersize=4, zorder=1)
    for values, half, width, label in (
        ([pair.mean for pair in pairs], 0.3, 2.2, "mean"),
        ([pair.tenth_percentile for pair in pairs], 0.18, 1.2, "10th percentile"),
    ):
        axes.hlines(values, places - half, places + half, LEARNED_COLOUR, lw=width, label=label)
    nominal = [pair.nominal for pair in pairs]
    axes.plot(places, nominal, "D", color=INK_COLOUR, markersize=5, label="the world as it stands")
    zero_line(axes)
    axes.set_xticks(places, [pair.label for pair in pairs])
    axes.set(ylabel=found.goal.axis)
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return figure
