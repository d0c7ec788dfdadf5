"""Entropy of the design distribution beside its target (algorithm 1, line 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pneumorph.report.style import LEARNED_COLOUR, NEUTRAL_COLOUR, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def entropy_figure(metrics: Sequence[Mapping[str, Any]]) -> Figure:
    """Return entropies in nats against timesteps.

    Args:
        metrics: Rounds, as the training's metrics file holds them.

    Raises:
        ValueError: No rounds.
    """
    if not metrics:
        raise ValueError("the run has no metrics; its training made no round")
    figure = new_figure()
    axes = figure.add_subplot()
    timestep = [each["timestep"] for each in metrics]
    target = [each["design_entropy_target"] for each in metrics]
    entropy = [each["design_entropy"] for each in metrics]
    axes.plot(timestep, target, color=NEUTRAL_COLOUR, linewidth=4, alpha=0.5, label="target")
    axes.plot(timestep, entropy, color=LEARNED_COLOUR, label="design distribution")
    axes.set(xlabel="timesteps (actions of all robots)", ylabel="entropy (nats)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right")
    return figure
