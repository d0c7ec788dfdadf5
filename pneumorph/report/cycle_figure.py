"""What a robot does within one cycle: pressures, tilt, legs' height and load, travel.

The paper explains its best gait by the roll that lifts a front leg (section VI-A); this shows it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.report.style import (
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
    regulator_colour,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory

_LEG_LINES: tuple[Any, ...] = (
    "-", (0, (5, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (6, 2, 2, 2)), (0, (2, 3)),
)  # fmt: skip


@figure_style()
def cycle_figure(trajectory: Trajectory, cycle_s: float = 4.0) -> Figure:
    """Return the last whole cycle of a robot, one panel above the other.

    Roll is about the forward axis (left side up), pitch about the axis to the left (front down);
    a leg's height is that of its lowest node over the lowest of all in the recording, and its load
    is what the floor presses up with, where that was recorded.

    Args:
        trajectory: Of a robot with its nodes and its design in the metadata.
        cycle_s: Length of a cycle [s].

    Raises:
        ValueError: The trajectory is shorter than a cycle, or was recorded without nodes.
    """
    time_s = trajectory.time_s
    count = int(time_s[-1] / cycle_s + 1e-6)
    if count < 1:
        raise ValueError(
            f"the trajectory lasts {time_s[-1]:g} s, expected at least a cycle of {cycle_s:g} s"
        )
    nodes = trajectory.node_positions_mm
    if nodes is None:
        raise ValueError("the trajectory holds no node positions, expected them for legs' heights")
    begin = (count - 1) * cycle_s
    inside = (time_s >= begin - 1e-6) & (time_s <= begin + cycle_s + 1e-6)
    since = time_s[inside] - begin
    design = Design.parse(trajectory.metadata["design"])
    loads = trajectory.contact_force_mN
    figure = new_figure(5.2, 5.6 if loads is None else 6.8)
    panels = list(figure.subplots(4 if loads is None else 5, 1, sharex=True))
    pressure, tilt, height, travel = (*panels[:3], panels[-1])
    for index in range(max(design.assignment)):
        kPa = trajectory.regulated_kPa[inside, index]
        pressure.plot(since, kPa, color=regulator_colour(index + 1), label=f"regulator {index + 1}")
    pressure.set(ylabel="kPa", yticks=[0, 45, 90])
    roll, pitch = tilt_deg(trajectory.hub_rotation[inside])
    tilt.plot(since, roll, color=LEARNED_COLOUR, label="roll, left up")
    tilt.plot(since, pitch, color=NEUTRAL_COLOUR, linestyle="--", label="pitch, front down")
    tilt.axhline(0.0, color=INK_COLOUR, linewidth=0.6)
    tilt.set(ylabel="tilt (°)")
    lowest = nodes[..., 2].min(axis=2)
    over = lowest[inside] - lowest.min()
    _draw_legs(height, since, over, design)
    height.set(ylabel="lowest (mm)")
    if loads is not None:
        pressed_N = loads[inside][..., 2].sum(axis=2) / 1e3
        _draw_legs(panels[3], since, pressed_N, design)
        panels[3].set(ylabel="load (N)")
    x = trajectory.tracked_point_mm[inside, 0]
    travel.plot(since, (x - x[0]) / 10.0, color=INK_COLOUR)
    travel.set(ylabel="travel (cm)", xlabel=f"time since {begin:g} s (s)", xlim=(0, cycle_s))
    for axes in panels[:-1]:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
    return figure


def _draw_legs(axes: Axes, since: np.ndarray, values: np.ndarray, design: Design) -> None:
    for leg, (location, regulator) in enumerate(design.legs):
        axes.plot(
            since,
            values[:, leg],
            color=regulator_colour(regulator),
            linestyle=_LEG_LINES[leg % len(_LEG_LINES)],
            label=f"leg {location + 1}",
        )


def tilt_deg(rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return roll and pitch [degrees], each (frame,), of rotations hub to world, (frame, 3, 3).

    The hub's own forward and left axes against the horizontal, so heading does not count.
    """
    roll = np.degrees(np.arcsin(np.clip(rotation[:, 2, 1], -1.0, 1.0)))
    pitch = np.degrees(np.arcsin(np.clip(-rotation[:, 2, 0], -1.0, 1.0)))
    return roll, pitch
