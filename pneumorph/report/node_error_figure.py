"""Mean node error of reduced robots against time: where they part from the full ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@figure_style()
def node_error_figure(error_mm: Mapping[str, np.ndarray], frame_s: float) -> Figure:
    """Return the error of each run against time.

    Args:
        error_mm: Mean node error of each frame [mm], by the run's name.
        frame_s: Time from frame to frame [s].
    """
    figure = new_figure()
    axes = figure.add_subplot()
    for name, error in error_mm.items():
        axes.plot(frame_s * np.arange(len(error)), error, linewidth=1.0, label=name)
    axes.set(xlabel="time (s)", ylabel="mean node error (mm)", ylim=(0.0, None))
    axes.legend(loc="upper left", fontsize="x-small", ncols=2 if len(error_mm) > 6 else 1)
    return figure
