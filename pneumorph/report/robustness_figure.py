"""Distances of pairs in worlds drawn at random: domain randomisation, the paper's future work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.report.style import (
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def robustness_figure(found: Mapping[str, Any]) -> Figure:
    """Return the distance in cm of each pair in every world.

    Args:
        found: What `pneumorph evaluate --randomize` saves as robustness.json.

    Raises:
        ValueError: No pairs.
    """
    pairs = found["pairs"]
    if not pairs:
        raise ValueError("robustness.json has no pairs, expected at least one")
    figure = new_figure(max(4.2, 1.0 + 0.75 * len(pairs)), 3.2)
    axes = figure.add_subplot()
    worlds = [[np.nan if d is None else d for d in w["distances_cm"]] for w in found["worlds"]]
    distances = np.array(worlds, dtype=float)
    for place, pair in enumerate(pairs):
        # A fixed spread across, in the worlds' order: the same picture each time.
        across = place + 0.25 * np.linspace(-1.0, 1.0, len(distances))
        axes.plot(across, distances[:, place], ".", color=NEUTRAL_COLOUR, markersize=4, zorder=1)
        for name, width, label in (
            ("mean_distance_cm", 0.3, "mean"),
            ("tenth_percentile_cm", 0.18, "10th percentile"),
        ):
            axes.plot(
                [place - width, place + width],
                [pair[name]] * 2,
                color=LEARNED_COLOUR,
                linewidth=2.2 if name.startswith("mean") else 1.2,
                label=label if place == 0 else None,
            )
        nominal = pair["nominal_distance_cm"]
        axes.plot(
            place, np.nan if nominal is None else nominal, "D", color=INK_COLOUR, markersize=5,
            label="the world as it stands" if place == 0 else None,
        )  # fmt: skip
    axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
    axes.set_xticks(range(len(pairs)), [pair["label"] for pair in pairs])
    axes.set(ylabel="forward distance (cm)")
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return figure
