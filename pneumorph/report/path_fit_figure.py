"""A measured path beside the simulated one, before and after parameters were fitted to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def path_fit_figure(
    measured_s: np.ndarray,
    measured_mm: np.ndarray,
    simulated_s: np.ndarray,
    start_mm: np.ndarray,
    fitted_mm: np.ndarray,
    r_squared: float,
) -> Figure:
    """Return forward and sideways travel over time.

    Args:
        measured_s: Times of the track [s], (sample,).
        measured_mm: Its positions [mm], (sample, 2).
        simulated_s: Times of the simulations [s], (step,).
        start_mm: Path with the parameters that the fit began with [mm], (step, 2).
        fitted_mm: Path with the fitted ones [mm], (step, 2).
        r_squared: Share of the variance that the fit explains.
    """
    figure = new_figure(5.2, 4.2)
    panels = figure.subplots(2, 1, sharex=True)
    for column, (axes, name) in enumerate(zip(panels, ("forward", "sideways"), strict=True)):
        curves = (
            (measured_s, measured_mm, NEUTRAL_COLOUR, "measured"),
            (simulated_s, start_mm, BASELINE_COLOUR, "simulated before the fit"),
            (simulated_s, fitted_mm, LEARNED_COLOUR, f"fitted, R² {r_squared:.4f}"),
        )
        for time_s, path, colour, label in curves:
            axes.plot(time_s, path[:, column] - path[0, column], color=colour, label=label)
        axes.set(ylabel=f"{name} (mm)")
    panels[0].legend(loc="best")
    panels[1].set(xlabel="time (s)")
    return figure
