"""How good the learned pairs are: learning curves of equal simulated time, gaits of each design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

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

_SECONDS_PER_HOUR = 3600.0


@figure_style()
def learning_curves_figure(
    curves: Mapping[str, tuple[Sequence[float], Sequence[float]]], baseline_cm: float | None = None
) -> Figure:
    """Return the best distance in cm against the simulated time, a line a method.

    Args:
        curves: Simulated time of all robots [s] and best distance until then [cm], by label.
        baseline_cm: Distance of the expert's best phase.

    Raises:
        ValueError: No curve.
    """
    if not curves:
        raise ValueError("curves is empty, expected at least one method's")
    figure = new_figure(5.6, 3.2)
    axes = figure.add_subplot()
    colours = (LEARNED_COLOUR, *REGULATOR_COLOURS[1:4], *REGULATOR_COLOURS[5:])
    for (label, (simulated_s, best_cm)), colour in zip(
        curves.items(), colours * len(curves), strict=False
    ):
        hours = np.asarray(simulated_s, dtype=float) / _SECONDS_PER_HOUR
        axes.plot(hours, np.asarray(best_cm, dtype=float), color=colour, label=label)
    if baseline_cm is not None:
        axes.axhline(
            baseline_cm, color=BASELINE_COLOUR, label=f"expert's best phase: {baseline_cm:.1f} cm"
        )
    axes.axhline(0, color=INK_COLOUR, linewidth=0.6)
    axes.set(xlabel="simulated time of all robots (h)", ylabel="best distance so far (cm)")
    axes.set_xlim(left=0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


@figure_style()
def own_gaits_figure(designs: Sequence[Mapping[str, Any]]) -> Figure:
    """Return each design's distance with its own searched gait over that with the shared policy.

    Args:
        designs: Rows of a search for gaits: ``why``, ``distance_cm``, ``policy_distance_cm``.

    Raises:
        ValueError: No design has both distances.
    """
    both = [
        row
        for row in designs
        if row["distance_cm"] is not None and row["policy_distance_cm"] is not None
    ]
    if not both:
        raise ValueError("no design has a searched and a learned distance, expected one or more")
    figure = new_figure(4.2, 4.0)
    axes = figure.add_subplot()
    groups = {"drawn at random": ("o", BASELINE_COLOUR), "expert's design": ("s", INK_COLOUR)}
    for row in both:
        marker, colour = groups.get(row["why"], ("^", LEARNED_COLOUR))
        place = (row["policy_distance_cm"], row["distance_cm"])
        axes.plot(*place, marker, color=colour, markersize=5)
        if row["why"] != "drawn at random":
            axes.annotate(row["why"], place, xytext=(4, 3), textcoords="offset points", fontsize=7)
    ends = [
        min(row[name] for row in both for name in ("distance_cm", "policy_distance_cm")),
        max(row[name] for row in both for name in ("distance_cm", "policy_distance_cm")),
    ]
    axes.margins(0.08)
    axes.plot(ends, ends, color=INK_COLOUR, linewidth=0.7, linestyle=":")
    axes.set(xlabel="with the shared policy (cm)", ylabel="with its own searched gait (cm)")
    return figure
