"""Figures of robots that walked: distance, path, pressures, steps, and one cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.walk import cycle_slides, last_cycle, step_rewards
from pneumorph.report.ground_surface import above_floor
from pneumorph.report.plan import Plan, plan_of_walk
from pneumorph.report.plan_view import draw_plan_view
from pneumorph.report.style import (
    INK_COLOUR,
    LEARNED_COLOUR,
    LEG_LINES,
    NEUTRAL_COLOUR,
    PATH_COLOURS,
    figure_style,
    legend_above,
    legend_beside,
    new_axes,
    new_figure,
    regulator_colour,
    zero_line,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.trajectory import Trajectory

_ROBOT_CM = 16.0
"""How far the paper's robot reaches from its middle [cm]."""


@figure_style()
def distance_figure(trajectories: Mapping[str, Trajectory], goal: Goal = FORWARD) -> Figure:
    """Return what of a goal is achieved against time in s, one line a robot (paper, figure 8).

    Args:
        trajectories: Trajectories by label, the most important first.
        goal: What is achieved.
    """
    figure, axes = new_axes()
    for number, (label, trajectory) in enumerate(trajectories.items()):
        time_s, way = trajectory.time_s, goal.along(trajectory)
        colour = PATH_COLOURS[number % len(PATH_COLOURS)]
        axes.plot(time_s, way, color=colour, label=label)
        axes.annotate(
            f"{way[-1]:.{goal.digits}f}", (time_s[-1], way[-1]), xytext=(4, 0),
            textcoords="offset points", va="center", color=colour,
        )  # fmt: skip
    zero_line(axes)
    axes.set(xlabel="time (s)", ylabel=goal.axis)
    # Inside it would lie on one that goes backward, or on the line of nothing.
    figure.legend(loc="outside upper left", ncols=2)
    return figure


@figure_style()
def path_figure(trajectories: Mapping[str, Trajectory]) -> Figure:
    """Return the paths of the tracked point in cm from above, each robot drawn at its end.

    Args:
        trajectories: Trajectories by label.
    """
    figure = new_figure(5.2, 2.6)
    panels = figure.subplots(1, len(trajectories), squeeze=False, sharex=True, sharey=True)[0]
    paths, hubs = (
        [(way(each) - each.tracked_point_mm[0])[:, :2] / 10 for each in trajectories.values()]
        for way in (attrgetter("tracked_point_mm"), attrgetter("hub_position_mm"))
    )
    plans = [plan_of_walk(each) for each in trajectories.values()]
    reach_cm = max(_ROBOT_CM, *(0.1 * plan.reach_mm for plan in plans))
    least, most = _seen_cm([*paths, *(hub[-1:] for hub in hubs)], reach_cm)
    for number, (label, trajectory) in enumerate(trajectories.items()):
        axes, colour = panels[number], PATH_COLOURS[number % len(PATH_COLOURS)]
        path_cm = paths[number]
        rotation = trajectory.hub_rotation[-1]
        heading = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
        x, y = hubs[number][-1].tolist()  # the plan's origin, where the point need not be
        draw_plan_view(axes, plans[number], (x, y), heading, size_mm=0.1)
        axes.plot(*path_cm.T, color=colour, linewidth=2.0, zorder=3)
        axes.plot(0, 0, "o", color=colour, markersize=4, zorder=3)
        axes.set_title(label)
        axes.set(xlabel="forward (cm)", aspect="equal")
    panels[0].set(xlim=(least[0], most[0]), ylim=(least[1], most[1]), ylabel="sideways (cm)")
    return figure


def _seen_cm(paths: Sequence[np.ndarray], reach_cm: float) -> tuple[np.ndarray, np.ndarray]:
    """Least and most x and y of a picture that has robots of such a reach about all points of
    paths, and is not smaller for short ones [cm]."""
    points = np.concatenate(paths)
    least = np.minimum(points.min(axis=0) - reach_cm, (-18.0, -18.0))
    most = np.maximum(points.max(axis=0) + reach_cm, (32.0, 18.0))
    return least, most


@figure_style()
def pressure_figure(trajectory: Trajectory, regulator_count: int | None = None) -> Figure:
    """Return pressures in kPa against time in s, one panel a regulator (paper, figure 8).

    Args:
        trajectory: Whose gait.
        regulator_count: How many regulators the design uses; None for all recorded.
    """
    count = regulator_count or trajectory.commanded_kPa.shape[1]
    time_s = trajectory.time_s
    figure = new_figure(5.2, 0.7 + 0.85 * count)
    panels = figure.subplots(count, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for index, axes in enumerate(panels):
        colour = regulator_colour(index + 1)
        axes.step(time_s, trajectory.commanded_kPa[:, index], color=colour, linewidth=0.9,
                  linestyle=(0, (3, 2)), label="commanded")  # fmt: skip
        axes.plot(time_s, trajectory.regulated_kPa[:, index], color=colour, label="regulated")
        axes.set_ylabel(f"regulator {index + 1}", color=colour)
        axes.set_yticks([0, 45, 90])
    legend_above(panels[0])
    panels[0].set_title("pressure (kPa)")
    panels[-1].set_xlabel("time (s)")
    return figure


@figure_style()
def step_figure(
    paths: Mapping[str, tuple[np.ndarray, np.ndarray]],
    step_s: float = 1.0,
    cycle_s: float = 4.0,
    goal: Goal = FORWARD,
) -> Figure:
    """Return a panel for each robot: reward of each step as bars, slide back in each cycle as a
    line (paper, sections V and VI).

    Args:
        paths: Time [s], (time,), and what of a goal is achieved [its unit], (time,), by label.
        step_s: Length of a step, over which a reward is counted [s].
        cycle_s: Length of a cycle, over which a slide back is counted [s].
        goal: What is achieved.

    Raises:
        ValueError: No path, or one shorter than a cycle.
    """
    if not paths:
        raise ValueError("paths is empty, expected at least one robot's")
    figure = new_figure(5.2, 0.6 + 1.5 * len(paths))
    panels = figure.subplots(len(paths), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for number, (label, (time_s, way)) in enumerate(paths.items()):
        axes, colour = panels[number], PATH_COLOURS[number % len(PATH_COLOURS)]
        reward = step_rewards(time_s, way, step_s)
        begin = step_s * np.arange(len(reward))
        axes.bar(begin, reward, step_s, align="edge", color=colour, edgecolor="white")
        slide = cycle_slides(time_s, way, cycle_s)
        cycles = cycle_s * np.arange(len(slide) + 1)
        axes.step(cycles, -np.append(slide, slide[-1:]), where="post", color=INK_COLOUR)
        zero_line(axes)
        back = f"slides back {slide.mean():.2f}{goal.symbol} a cycle"
        axes.set_title(
            f"{label}: {goal.said(reward.sum())}, {back}",
            size=9,
        )
        axes.set_ylabel(goal.symbol.strip())
    panels[-1].set_xlabel("time (s)")
    figure.supylabel(
        f"bars: {goal.label} of {step_s:g} s; line: slide back in {cycle_s:g} s", size=7
    )
    return figure


@figure_style()
def cycle_figure(trajectory: Trajectory, cycle_s: float = 4.0, goal: Goal = FORWARD) -> Figure:
    """Return the last whole cycle of a robot: pressures, tilt, legs' height and load, travel.

    The paper explains its best gait by the roll that lifts a front leg (section VI-A). Roll is
    about the forward axis (left side up), pitch about the axis to the left (front down); a leg's
    height is that of its lowest node above the floor straight below it, and its load is what the
    floor presses up with, where that was recorded. Legs touch the floor with their contact points;
    a node between them may sag below it, and where points give way under load, which nodes do not
    show, it lies up to 2 mm below. Where the floor is not known, heights are above the lowest
    of all nodes in the recording.

    Args:
        trajectory: Of a robot with its nodes and its design in the metadata.
        cycle_s: Length of a cycle [s].

    Raises:
        ValueError: The trajectory is shorter than a cycle, or was recorded without nodes.
    """
    begin_s, inside = last_cycle(trajectory.time_s, cycle_s)
    nodes, forces = trajectory.node_positions_mm, trajectory.contact_force_mN
    if nodes is None:
        raise ValueError("the trajectory holds no node positions, expected them for legs' heights")
    since = trajectory.time_s[inside] - begin_s
    plan, legs = plan_of_walk(trajectory), legs_of(trajectory)
    figure = new_figure(5.2, 5.6 if forces is None else 6.8)
    panels = list(figure.subplots(4 if forces is None else 5, 1, sharex=True))
    pressure, tilt, height, travel = (*panels[:3], panels[-1])
    for index in range(highest_regulator(plan)):
        kPa = trajectory.regulated_kPa[inside, index]
        pressure.plot(since, kPa, color=regulator_colour(index + 1), label=f"regulator {index + 1}")
    pressure.set(ylabel="kPa", yticks=[0, 45, 90])
    roll, pitch = trajectory.tilt_deg
    tilt.plot(since, roll[inside], color=LEARNED_COLOUR, label="roll, left up")
    tilt.plot(since, pitch[inside], color=NEUTRAL_COLOUR, linestyle="--", label="pitch, front down")
    zero_line(tilt)
    tilt.set(ylabel="tilt (°)")
    above = above_floor(trajectory, nodes)
    known = above is not None
    lowest = (nodes[..., 2] - nodes[..., 2].min() if above is None else above).min(axis=2)
    draw_legs(height, since, lowest[inside], legs)
    zero_line(height)
    height.set(ylabel=f"lowest node\nover {'floor' if known else 'all'} (mm)")
    if forces is not None:
        draw_legs(panels[3], since, forces[inside][..., 2].sum(axis=2) / 1e3, legs)
        panels[3].set(ylabel="load (N)")
    achieved = goal.along(trajectory)[inside]
    travel.plot(since, achieved - achieved[0], color=INK_COLOUR)
    way = goal.in_unit("turn" if goal.turns else "travel")
    travel.set(ylabel=way, xlabel=f"time since {begin_s:g} s (s)", xlim=(0, cycle_s))
    for axes in panels[:-1]:
        legend_beside(axes)
    return figure


def draw_legs(
    axes: Axes, since: np.ndarray, values: np.ndarray, legs: Sequence[tuple[int, int]]
) -> None:
    """Draw a value of each leg, (frame, leg), in its regulator's colour and a style of its own;
    legs are numbers of their sites, from 0, and of their regulators."""
    for leg, (site, regulator) in enumerate(legs):
        style = LEG_LINES[leg % len(LEG_LINES)]
        axes.plot(since, values[:, leg], color=regulator_colour(regulator), linestyle=style,
                  label=f"leg {site}")  # fmt: skip


def legs_of(trajectory: Trajectory) -> list[tuple[int, int]]:
    """Numbers of site, from 0, and of the first cavity's regulator of each leg of a recorded
    robot."""
    shape = trajectory.shape
    if shape is None:
        return list(Design.parse(trajectory.metadata["design"]).legs)
    return list(zip(shape.leg_site.tolist(), shape.leg_regulators[:, 0].tolist(), strict=True))


def highest_regulator(plan: Plan) -> int:
    """Highest number of a regulator that a robot uses."""
    return max((max(each) for each in plan.regulators), default=0)
