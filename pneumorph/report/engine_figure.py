"""Time of the stepper's stages, and its speed beside the machine's matrix product."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.report.style import (
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LABELS = {
    "robots": "robots in the batch, all threads",
    "legs": "legs of a robot, one thread",
    "modes": "modes of a leg, one thread",
    "threads": "threads",
}


@figure_style()
def engine_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Return stages by legs and by modes, and speed by batch and by threads.

    Args:
        rows: What `profile_engine` returns.

    Raises:
        ValueError: No rows.
    """
    if not rows:
        raise ValueError("rows is empty, expected the measurements of a profile")
    figure = new_figure(7.2, 5.2)
    axes = figure.subplots(2, 2)
    for place, axis in zip(axes.flat, ("legs", "modes", "robots", "threads"), strict=True):
        own = [row for row in rows if row["axis"] == axis]
        place.set_xlabel(_LABELS[axis])
        if axis in ("legs", "modes"):
            _stages(place, own)
        else:
            _speed(place, own)
    if axes[0, 0].patches:
        axes[0, 0].legend(fontsize=7, ncols=2)
    return figure


def _stages(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    places = np.arange(len(rows))
    bottom = np.zeros(len(rows))
    for number, stage in enumerate(rows[0]["stage_us"] if rows else ()):
        height = np.array([row["stage_us"][stage] for row in rows])
        colour = REGULATOR_COLOURS[number % len(REGULATOR_COLOURS)]
        axes.bar(places, height, 0.7, bottom, color=colour, label=stage.replace("_", " "))
        bottom += height
    axes.set_xticks(places, [str(row["value"]) for row in rows])
    axes.set_ylabel("us of a thread, leg and step")


def _speed(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    value = [row["value"] for row in rows]
    axes.plot(value, [row["steps_per_gflop"] for row in rows], "o-", color=LEARNED_COLOUR)
    axes.axhline(80.0, color=NEUTRAL_COLOUR, linewidth=1.0)
    axes.set_xticks(value)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("steps/s for each GFLOP/s of sgemm")
