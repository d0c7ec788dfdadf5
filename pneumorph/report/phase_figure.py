"""Distance of the expert's gait against its phase shift, figure 5d of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def phase_figure(
    phases_deg: Sequence[float], distances_cm: Sequence[float], learned_cm: float | None = None
) -> Figure:
    """Return forward distance in cm against phase in degrees, the best phase marked.

    Args:
        phases_deg: Phase shifts.
        distances_cm: Distance of each; NaN where the simulation failed.
        learned_cm: Distance of the best learned gait, drawn as a line to compare with.

    Raises:
        ValueError: Lists of different lengths, or no finite distance.
    """
    distances = np.asarray(distances_cm, dtype=float)
    if len(phases_deg) != len(distances):
        raise ValueError(f"got {len(phases_deg)} phases and {len(distances)} distances")
    if not np.isfinite(distances).any():
        raise ValueError("no phase has a finite distance; every simulation of the sweep failed")
    figure = new_figure()
    axes = figure.add_subplot()
    axes.plot(
        phases_deg, distances, "o-", color=BASELINE_COLOUR, markersize=4, label="expert's gait"
    )
    best = int(np.nanargmax(distances))
    axes.plot(phases_deg[best], distances[best], "o", color=INK_COLOUR, markersize=6)
    axes.annotate(
        f"{distances[best]:.1f} cm at {phases_deg[best]:g}°",
        (phases_deg[best], distances[best]),
        xytext=(0, 7),
        textcoords="offset points",
        ha="center",
    )
    if learned_cm is not None:
        axes.axhline(learned_cm, color=LEARNED_COLOUR, label=f"learned: {learned_cm:.1f} cm")
    axes.axhline(0, color=INK_COLOUR, linewidth=0.6)
    axes.margins(y=0.15)
    axes.set(xlabel="phase shift between fore and hind legs (°)", ylabel="forward distance (cm)")
    axes.legend(loc="best")
    return figure
