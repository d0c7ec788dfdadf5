"""The figures of a comparison, drawn from its result and what it wrote."""

from __future__ import annotations

import numpy as np

from pneumorph.base.result import load_result
from pneumorph.base.run_folder import RunFolder
from pneumorph.report.reduction_figures import (
    bend_figure,
    node_error_figure,
    tolerance_figure,
)
from pneumorph.report.style import save_figure
from pneumorph.study.comparison import NODE_ERROR_FILE, Comparison, NodeErrors


def draw_comparison(found: Comparison, folder: RunFolder) -> None:
    """Draw the bend, the node errors of each kind of runs, and the grid of tolerances.

    Args:
        found: The comparison.
        folder: Where it was made; receives the figures.
    """
    errors = load_result(NodeErrors, folder / NODE_ERROR_FILE)
    for kind, runs in errors.mean_mm.items():
        if runs:
            curves = {name: np.array(frames) for name, frames in runs.items()}
            figure = node_error_figure(curves, errors.frame_s)
            save_figure(figure, folder / f"{kind}_node_error.png")
    if found.tolerance_grid:
        save_figure(tolerance_figure(found.tolerance_grid), folder / "tolerances.png")
    bend = bend_figure(found.bend_pressures_kPa, found.bend_full_deg, found.bend_reduced_deg)
    save_figure(bend, folder / "bend.png")
