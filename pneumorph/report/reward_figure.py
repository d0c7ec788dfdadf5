"""Reward while training beside the baseline: distance of each round (paper, figure 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def reward_figure(
    metrics: Sequence[Mapping[str, Any]],
    histogram_edges_cm: Sequence[float],
    baseline_cm: float | None = None,
    learned_cm: float | None = None,
) -> Figure:
    """Return distances in cm against timesteps.

    The shades are the histogram of scores weighted by the design distribution; the lines are the
    mean and the best episode of each round and the best so far.

    Args:
        metrics: Rounds, as the training's metrics file holds them.
        histogram_edges_cm: Edges of their `score_histogram`.
        baseline_cm: Distance of the expert's best phase.
        learned_cm: Distance of the best pair, evaluated after the last round.

    Raises:
        ValueError: No rounds.
    """
    if not metrics:
        raise ValueError("the run has no metrics; its training made no round")
    figure = new_figure(5.2, 3.2)
    axes = figure.add_subplot()
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
    axes.axhline(0, color=INK_COLOUR, linewidth=0.6)
    best = max((each["best_distance_cm"] or 0.0) for each in metrics)
    highest = max(best, baseline_cm or 0.0, learned_cm or 0.0)
    axes.set_ylim(min(-3.0, float(histogram_edges_cm[0]) / 2), 1.12 * highest + 0.5)
    axes.set(xlabel="timesteps (actions of all robots)", ylabel="distance in 20 s (cm)")
    axes.legend(loc="upper left")
    return figure


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
