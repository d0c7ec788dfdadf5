"""Bend of a single leg against pressure, reduced beside full: the first test of a reduction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pneumorph.report.style import BASELINE_COLOUR, LEARNED_COLOUR, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def bend_figure(
    pressure_kPa: Sequence[float], full_deg: Sequence[float], reduced_deg: Sequence[float]
) -> Figure:
    """Return bend in degrees against simulated pressure in kPa for both models."""
    figure = new_figure()
    axes = figure.add_subplot()
    axes.plot(pressure_kPa, full_deg, color=BASELINE_COLOUR, linewidth=4, label="full model")
    axes.plot(pressure_kPa, reduced_deg, "o-", color=LEARNED_COLOUR, markersize=3, label="reduced")
    axes.set(xlabel="simulated pressure (kPa)", ylabel="bend (°)")
    axes.legend(loc="upper left")
    return figure
