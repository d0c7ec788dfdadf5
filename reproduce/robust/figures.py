"""Bands of robots beside each other, and a band before and after tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pneumorph.report.style import BASELINE_COLOUR, LEARNED_COLOUR, new_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LABELS = {
    "learned": "learned together",
    "gaits": "CMA-ES on its designs",
    "genetic": "genetic algorithm",
    "random": "random search",
}


def bands_figure(found: Sequence[Mapping[str, Any]]) -> Figure:
    """A line from the 10th to the 90th percentile and a point at the median, a seed each."""
    figure, axes = new_axes(5.6, 3.0)
    figure.set_layout_engine("constrained")
    seeds = sorted({each["seed"] for each in found})
    for each in found:
        row = list(LABELS).index(each["method"])
        y = row + 0.18 * (seeds.index(each["seed"]) - 0.5 * (len(seeds) - 1))
        band = each["band"]
        colour = LEARNED_COLOUR if each["method"] == "learned" else BASELINE_COLOUR
        axes.plot([band["low_cm"], band["high_cm"]], [y, y], color=colour)
        axes.plot(band["median_cm"], y, "o", color=colour, markersize=4)
    axes.set_yticks(range(len(LABELS)), list(LABELS.values()))
    axes.invert_yaxis()
    axes.set_xlabel("distance in 200 unseen worlds (cm)")
    return figure


def narrowing_figure(bench: Mapping[str, Any]) -> Figure:
    """The band before and after the tests, and how far the hidden robot went."""
    figure, axes = new_axes(5.6, 1.8)
    figure.set_layout_engine("constrained")
    for row, name in enumerate(("before", "after")):
        band = bench[name]
        axes.plot([band["low_cm"], band["high_cm"]], [row, row], color=LEARNED_COLOUR, linewidth=3)
        axes.plot(band["median_cm"], row, "o", color=LEARNED_COLOUR)
    axes.axvline(bench["rig_cm"], color=BASELINE_COLOUR, label="the rig's robot")
    axes.set_yticks([0, 1], ["before", f"after {len(bench['tests'])} tests"])
    axes.set_ylim(1.6, -0.6)
    axes.set_xlabel("distance (cm)")
    axes.legend()
    return figure
