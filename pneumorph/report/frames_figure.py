"""Robots at instants of their walk, one row each, as in figures 1 and 8 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pneumorph.report.frame_painter import FilmSettings, FramePainter
from pneumorph.report.scene import full_pressure_kPa
from pneumorph.report.style import figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.report.scene import Actor


_PALE = 0.3
"""How opaque a picture is of a robot whose walk has ended."""


def has_ended(actor: Actor, time_s: float) -> bool:
    """Whether the walk of a robot was over before a time: times in headings are rounded."""
    return time_s > actor.end_s + 0.02


@figure_style()
def frames_figure(actors: Sequence[Actor], times_s: Sequence[float], width: int = 480) -> Figure:
    """Return pictures of each robot at the same instants; lines on the floor are 5 cm apart.

    Behind the end of its walk a robot is pale, and the picture says when that was.

    Args:
        actors: The robots.
        times_s: When [s].
        width: Width of a picture in pixels.

    Raises:
        ValueError: No robots, or no instants.
    """
    if not actors or not times_s:
        raise ValueError(
            f"got {len(actors)} robots and {len(times_s)} instants, expected at least one of each"
        )
    full_kPa = full_pressure_kPa(actors)
    painters = [
        FramePainter([actor], FilmSettings(width), captions=False, full_kPa=full_kPa)
        for actor in actors
    ]
    tall = max(painter.size[1] / painter.size[0] for painter in painters)
    figure = new_figure(7.0, 0.3 + 7.0 / len(times_s) * tall * len(actors))
    panels = figure.subplots(len(actors), len(times_s), squeeze=False)
    for row, (actor, painter) in enumerate(zip(actors, painters, strict=True)):
        for column, time_s in enumerate(times_s):
            axes = panels[row, column]
            over = has_ended(actor, time_s)
            axes.imshow(painter.paint(time_s), alpha=_PALE if over else 1.0)
            travelled = actor.travelled(actor.frame_at(time_s))
            if over:
                axes.text(0.02, 0.97, f"ended at {actor.end_s:.3g} s", size=7, ha="left", va="top",
                          transform=axes.transAxes)  # fmt: skip
            axes.text(0.98, 0.03, travelled, size=7, ha="right", va="bottom",
                      transform=axes.transAxes)  # fmt: skip
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
            axes.grid(False)
            if row == 0:
                axes.set_title(f"{time_s:g} s", size=8, loc="center")
            if column == 0:
                axes.set_ylabel(actor.label, size=7)
    return figure
