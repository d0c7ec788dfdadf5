"""Trials on a rig: commanded and sensed pressures, and where the robot went."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pneumorph.report.style import (
    INK_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
    regulator_colour,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.hardware.deployment_log import LoggedPressures
    from pneumorph.hardware.marker_track import MarkerTrack


@figure_style()
def trials_figure(logs: Sequence[LoggedPressures], tracks: Sequence[MarkerTrack] = ()) -> Figure:
    """Return pressures over time, a panel a channel, and below the travel where it was tracked.

    Args:
        logs: Log of each trial, with at least one sample.
        tracks: Track of each trial that has one.

    Raises:
        ValueError: No log.
    """
    if not logs:
        raise ValueError("logs is empty, expected that of at least one trial")
    channels = logs[0].commanded_kPa.shape[1]
    rows = channels + bool(tracks)
    heights = [1.0] * channels + ([2.0] if tracks else [])
    figure = new_figure(5.2, 0.8 + 0.85 * sum(heights))
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for index, axes in enumerate(panels[:channels]):
        draw_channel(axes, logs, index)
        axes.set_ylabel(f"p{index + 1} (kPa)", color=regulator_colour(index + 1))
    panels[0].legend(
        loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, fontsize=7, borderaxespad=0.1
    )
    for number, track in enumerate(tracks):
        panels[-1].plot(
            track.time_s,
            track.forward_cm(track.time_s),
            color=REGULATOR_COLOURS[number % len(REGULATOR_COLOURS)],
            linewidth=1.1,
            label=f"trial {number + 1}",
        )
    if tracks:
        panels[-1].axhline(0.0, color=INK_COLOUR, linewidth=0.6)
        panels[-1].set_ylabel("forward distance (cm)")
        panels[-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
    panels[-1].set_xlabel("time (s)")
    return figure


def draw_channel(axes: Axes, logs: Sequence[LoggedPressures], index: int) -> None:
    """Draw what a channel was commanded and what was sensed in every trial, the first boldly."""
    axes.step(
        logs[0].time_s,
        logs[0].commanded_kPa[:, index],
        where="post",
        color=INK_COLOUR,
        linewidth=0.8,
        linestyle=(0, (3, 2)),
        label="commanded",
    )
    for number, log in enumerate(logs):
        axes.plot(
            log.time_s,
            log.sensed_kPa[:, index],
            color=regulator_colour(index + 1),
            linewidth=1.2,
            alpha=1.0 if number == 0 else 0.25,
            label="sensed" if number == 0 else None,
        )
    axes.set_yticks([0, 45, 90])
