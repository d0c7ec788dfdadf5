"""Real against simulated pressure of equal bend, with the fitted line: figure 11 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.pressure import PressureMap
from pneumorph.report.style import LEARNED_COLOUR, NEUTRAL_COLOUR, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def calibration_figure(
    real_kPa: np.ndarray, simulated_kPa: np.ndarray, fitted: PressureMap, r_squared: float
) -> Figure:
    """Return the pairs and their line.

    Args:
        real_kPa: Real pressures [kPa], (pair,).
        simulated_kPa: Simulated pressures of equal bend [kPa], (pair,).
        fitted: The line.
        r_squared: Share of the variance that it explains.
    """
    figure = new_figure(4.2, 3.2)
    axes = figure.add_subplot()
    reach = np.linspace(0.0, 1.05 * float(real_kPa.max()), 100)
    axes.plot(reach, PressureMap().simulated(reach), color=NEUTRAL_COLOUR, label="published line")
    sign = "+" if fitted.intercept_kPa >= 0.0 else "-"
    label = f"{fitted.slope:.3f} p {sign} {abs(fitted.intercept_kPa):.2f} kPa, R² {r_squared:.4f}"
    axes.plot(reach, fitted.simulated(reach), color=LEARNED_COLOUR, label=label)
    axes.plot(real_kPa, simulated_kPa, "o", color=LEARNED_COLOUR, markersize=4)
    axes.set(xlabel="real pressure p (kPa)", ylabel="simulated pressure of equal bend (kPa)")
    axes.legend(loc="upper left")
    return figure
