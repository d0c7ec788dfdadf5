"""Reward while training beside the baseline: distance of each round (paper, figure 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.report.plan_view import HALF_WIDTH_MM, draw_plan_view
from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
    white_between,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_PAIRS = 5


@figure_style()
def reward_figure(
    metrics: Sequence[Mapping[str, Any]],
    histogram_edges_cm: Sequence[float],
    baseline_cm: float | None = None,
    learned_cm: float | None = None,
    pairs: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Return distances in cm against timesteps.

    The shades are the histogram of scores weighted by the design distribution; the lines are the
    mean and the best episode of each round and the best so far.

    Args:
        metrics: Rounds, as the training's metrics file holds them.
        histogram_edges_cm: Edges of their `score_histogram`.
        baseline_cm: Distance of the expert's best phase.
        learned_cm: Distance of the best pair, evaluated after the last round.
        pairs: The best pairs as a summary lists them, drawn beside and marked where training saw
            them; at most five.

    Raises:
        ValueError: No rounds.
    """
    if not metrics:
        raise ValueError("the run has no metrics; its training made no round")
    figure = new_figure(6.6 if pairs else 5.2, 3.6 if pairs else 3.2)
    axes = _with_plan_views(figure, pairs[:_MOST_PAIRS]) if pairs else figure.add_subplot()
    timestep = np.array([each["timestep"] for each in metrics], dtype=float)
    shares = np.array([each["score_histogram"] for each in metrics])
    if shares.shape[1] >= len(histogram_edges_cm):
        raise ValueError(
            f"the metrics' score_histogram has {shares.shape[1]} bins, expected fewer than the "
            f"{len(histogram_edges_cm)} edges; the run was made by a newer pneumorph"
        )
    # The square root shows the thin tail of good designs early in training.
    axes.pcolormesh(
        np.concatenate([[0.0], timestep]),
        # Runs of an earlier version end at fewer bins of the same size.
        np.asarray(histogram_edges_cm)[: shares.shape[1] + 1],
        np.sqrt(shares.T),
        cmap="Greys",
        vmax=1.6,
        rasterized=True,
    )
    _line(axes, timestep, metrics, "best_distance_cm", LEARNED_COLOUR, "best so far")
    _line(axes, timestep, metrics, "return_mean_cm", NEUTRAL_COLOUR, "mean of the round")
    if baseline_cm is not None:
        axes.axhline(
            baseline_cm, color=BASELINE_COLOUR, label=f"expert's best phase: {baseline_cm:.1f} cm"
        )
    if learned_cm is not None:
        axes.plot(timestep[-1], learned_cm, "o", color=LEARNED_COLOUR, clip_on=False)
        axes.annotate(
            f"{learned_cm:.1f} cm",
            (timestep[-1], learned_cm),
            xytext=(0, 5),
            textcoords="offset points",
            ha="right",
            va="bottom",
        )
    for rank, pair in enumerate(pairs[:_MOST_PAIRS], start=1):
        seen, distance_cm = pair.get("timestep"), pair["distance_cm"]
        # The first is the end of the blue line.
        if rank > 1 and seen is not None and distance_cm is not None:
            place = (seen, distance_cm)
            axes.plot(*place, "o", color=INK_COLOUR, markersize=3, clip_on=False)
            axes.annotate(
                f"L{rank}",
                place,
                xytext=(4, -8),
                textcoords="offset points",
                size=7,
                path_effects=white_between(),
            )
    axes.axhline(0, color=INK_COLOUR, linewidth=0.6)
    best = max((each["best_distance_cm"] or 0.0) for each in metrics)
    highest = max(best, baseline_cm or 0.0, learned_cm or 0.0)
    axes.set_ylim(min(-3.0, float(histogram_edges_cm[0]) / 2), 1.12 * highest + 0.5)
    axes.set(xlabel="timesteps (actions of all robots)", ylabel="distance in 20 s (cm)")
    axes.legend(loc="upper left")
    return figure


def _with_plan_views(figure: Figure, pairs: Sequence[Mapping[str, Any]]) -> Any:
    """Draw the pairs' designs in a column at the right and return the axes at the left."""
    columns = figure.add_gridspec(1, 2, width_ratios=(5.2, 1.2))
    views = columns[1].subgridspec(_MOST_PAIRS, 1)
    for rank, pair in enumerate(pairs, start=1):
        view = figure.add_subplot(views[rank - 1])
        draw_plan_view(view, Design.parse(pair["design"]).assignment)
        view.set(xlim=(-HALF_WIDTH_MM, HALF_WIDTH_MM), ylim=(-HALF_WIDTH_MM, HALF_WIDTH_MM))
        view.set_aspect("equal")
        view.axis("off")
        far = "failed" if pair["distance_cm"] is None else f"{pair['distance_cm']:.1f} cm"
        view.set_title(f"L{rank}: {far}", size=7, loc="center", pad=2)
    return figure.add_subplot(columns[0])


def _line(
    axes: Any,
    timestep: np.ndarray,
    metrics: Sequence[Mapping[str, Any]],
    name: str,
    colour: str,
    label: str,
) -> None:
    values = np.array([np.nan if each[name] is None else each[name] for each in metrics])
    axes.plot(timestep, values, color=colour, label=label)
