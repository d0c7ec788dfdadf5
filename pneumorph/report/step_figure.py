"""Reward of every step and the slide back within each cycle (paper, sections V and VI)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.gait.walk import cycle_slides_cm, step_rewards_cm
from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory


@figure_style()
def step_figure(
    paths: Mapping[str, tuple[np.ndarray, np.ndarray]], step_s: float = 1.0, cycle_s: float = 4.0
) -> Figure:
    """Return a panel for each robot: reward of each step as bars, slide back as a line.

    Args:
        paths: Time [s], (time,), and forward travel [cm], (time,), by label.
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].

    Raises:
        ValueError: No path, or one shorter than a cycle.
    """
    if not paths:
        raise ValueError("paths is empty, expected at least one robot's")
    figure = new_figure(5.2, 0.6 + 1.5 * len(paths))
    panels = figure.subplots(len(paths), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    colours = (LEARNED_COLOUR, BASELINE_COLOUR, *REGULATOR_COLOURS[2:])
    for (label, (time_s, forward_cm)), axes, colour in zip(
        paths.items(), panels, colours * len(paths), strict=False
    ):
        reward = step_rewards_cm(time_s, forward_cm, step_s)
        begin = step_s * np.arange(len(reward))
        axes.bar(begin, reward, step_s, align="edge", color=colour, edgecolor="white")
        slide = cycle_slides_cm(time_s, forward_cm, cycle_s)
        cycles = cycle_s * np.arange(len(slide) + 1)
        axes.step(cycles, -np.append(slide, slide[-1:]), where="post", color=INK_COLOUR)
        axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
        axes.set_title(
            f"{label}: {reward.sum():.1f} cm, slides back {slide.mean():.2f} cm a cycle", size=9
        )
        axes.set_ylabel("cm")
    panels[-1].set_xlabel("time (s)")
    figure.supylabel(f"bars: reward of {step_s:g} s; line: slide back in {cycle_s:g} s", size=7)
    return figure


def path_of(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return the times [s] and the forward travel [cm] of a trajectory's tracked point."""
    x = trajectory.tracked_point_mm[:, 0]
    return trajectory.time_s, (x - x[0]) / 10.0
