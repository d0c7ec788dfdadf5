"""A dimension line of the workshop drawing is as long as what it measures."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from pneumorph.report.assembly_drawing import _dimension

POINTS_PER_INCH = 72.0


@pytest.mark.parametrize("end", [(40.0, 10.0), (10.0, 40.0)])
def test_a_dimension_line_reaches_from_one_end_to_the_other(end: tuple[float, float]) -> None:
    figure = Figure(figsize=(4.0, 4.0))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, 50.0), ylim=(0.0, 50.0))
    start = (10.0, 10.0)
    _dimension(axes, start, end, "30", 1.0)
    figure.draw_without_rendering()
    (line,) = (each for each in axes.texts if isinstance(each, Annotation))
    assert line.arrow_patch is not None
    drawn = line.arrow_patch.get_path().vertices
    wanted = axes.transData.transform([start, end])
    # The middle of the tip's line, 0.6 points wide, is behind the tip: by half its width over the
    # sine of half the tip's angle, 0.2 / hypot(0.2, 0.4).
    most = 1.01 * 0.3 / 0.447 * figure.dpi / POINTS_PER_INCH
    along = np.argmax(np.abs(np.subtract(end, start)))
    assert np.abs(drawn[:, along].min() - wanted[0, along]) < most
    assert np.abs(drawn[:, along].max() - wanted[1, along]) < most
