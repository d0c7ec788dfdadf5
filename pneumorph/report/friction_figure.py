"""Where gaits live between sticking and slipping: margins over a cycle, distance over friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.gait.friction_margin import LIMIT_SHARE, FrictionMargin
from pneumorph.report.style import (
    INK_COLOUR,
    NEUTRAL_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
    regulator_colour,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLES = ("-", "--", ":", "-.", (0, (6, 2, 2, 2)), (0, (2, 3)))


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
        count = int(margin.time_s[-1] / cycle_s + 1e-6)
        if count < 1:
            raise ValueError(
                f"{label} walks {margin.time_s[-1]:g} s, expected at least a cycle of {cycle_s:g} s"
            )
        begin = (count - 1) * cycle_s
        inside = (margin.time_s >= begin - 1e-6) & (margin.time_s <= begin + cycle_s + 1e-6)
        for leg, (location, regulator) in enumerate(design.legs):
            axes.plot(
                margin.time_s[inside] - begin,
                margin.used_share[inside, leg],
                color=regulator_colour(regulator),
                linestyle=_STYLES[leg % len(_STYLES)],
                linewidth=1.1,
                label=f"leg {location + 1}",
            )
        axes.axhspan(LIMIT_SHARE, 1.0, color=NEUTRAL_COLOUR, alpha=0.25, linewidth=0)
        axes.set(ylim=(0.0, 1.03), xlim=(0.0, cycle_s), ylabel="used")
        axes.set_title(f"{label}: {design}", size=9)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
    panels[-1].set_xlabel("time in the last whole cycle (s)")
    figure.supylabel("share of friction used (shaded: the leg slides)", size=7)
    return figure


@figure_style()
def friction_figure(
    frictions: Sequence[float],
    distances_cm: Mapping[str, Sequence[float]],
    trained_friction: float | None = None,
) -> Figure:
    """Return distances in cm against the friction coefficient, a line a robot.

    Args:
        frictions: Coulomb coefficients.
        distances_cm: Distance at each, by label; NaN where a simulation failed.
        trained_friction: Coefficient the gaits were found with, drawn as a line.
    """
    figure = new_figure()
    axes = figure.add_subplot()
    for (label, distances), colour in zip(
        distances_cm.items(), REGULATOR_COLOURS * len(distances_cm), strict=False
    ):
        axes.plot(frictions, np.asarray(distances), "o-", markersize=3, color=colour, label=label)
    if trained_friction is not None:
        axes.axvline(trained_friction, color=INK_COLOUR, linewidth=0.8, linestyle=":")
    axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
    axes.set(xlabel="friction coefficient", ylabel="distance (cm)")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
