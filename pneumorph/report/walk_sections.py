"""Sections of robots that walked: replay, stills, distance, steps, gait, one cycle."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.report import page
from pneumorph.report.frames_figure import frames_figure, has_ended
from pneumorph.report.page import Section
from pneumorph.report.plan import plan_of_walk
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.scene import Actor, full_pressure_kPa
from pneumorph.report.sheet import Sheet
from pneumorph.report.walk_figures import (
    cycle_figure,
    distance_figure,
    highest_regulator,
    path_figure,
    pressure_figure,
    step_figure,
)
from pneumorph.study.recorded_trajectories import recorded_trajectories
from pneumorph.trajectory import Trajectory

_CYCLE_S = 4.0
"""Period of the paper's baseline, over which a slide back is counted [s]."""
_STILL_COUNT = 5


def walk_sections(folder: Path, sheet: Sheet, goal: Goal = FORWARD) -> list[Section]:
    """Return the sections of a run's trajectories, a group of robots after the other.

    A robot that did not come to the end of its walk is replayed; it has no distance.
    """
    sections = []
    for group, trajectories in recorded_trajectories(folder).items():
        seen = {name: each for name, each in trajectories.items() if can_be_drawn(each)}
        if seen:
            sections.append(replay_section(group, seen, sheet, goal))
        whole = {name: each for name, each in trajectories.items() if each.status == "completed"}
        if len(whole) < len(trajectories):
            sections.append(_failures_section(group, trajectories))
        if whole:
            sections.append(_distance_section(group, whole, sheet, goal))
            sections += _gait_sections(group, whole, sheet, goal)
    return sections


def _failures_section(group: str, trajectories: Mapping[str, Trajectory]) -> Section:
    rows = [
        (name, each.metadata.get("design", ""), each.status, float(each.time_s[-1]))
        for name, each in trajectories.items()
        if each.status != "completed"
    ]
    body = page.table(["robot", "design", "how its walk ended", "after (s)"], rows)
    return Section(_titled("Robots without a distance", group), body)


def can_be_drawn(trajectory: Trajectory) -> bool:
    """Whether a walk was recorded with all that a replay shows."""
    return trajectory.node_positions_mm is not None and trajectory.skin_triangles is not None


def _titled(title: str, group: str) -> str:
    return f"{title}: {group}" if group else title


def _named(name: str, group: str) -> str:
    return f"{name}_{group.replace(' ', '_')}" if group else name


def replay_section(
    group: str, trajectories: Mapping[str, Trajectory], sheet: Sheet, goal: Goal = FORWARD
) -> Section:
    """Return robots that can be drawn, side by side: a replay, and stills of it."""
    actors = [
        Actor.of(each, f"{name}\n{each.metadata.get('design', '')}".strip(), goal)
        for name, each in trajectories.items()
    ]
    replay = sheet.replayed(
        actors,
        "Forward is to the right. A leg has its regulator's colour, full at "
        f"{full_pressure_kPa(actors):.0f} kPa; of several regulators the mean of theirs.",
    )
    end_s = max(float(each.time_s[-1]) for each in trajectories.values())
    times_s = [end_s * number / (_STILL_COUNT - 1) for number in range(_STILL_COUNT)]
    whole = all(each.status == "completed" for each in trajectories.values())
    ended = "" if whole else " or how it ended before its end"
    shorter = any(has_ended(each, end_s) for each in actors)
    pale = "; pale where a walk was over" if shorter else ""
    stills = sheet.drawn(
        _named("frames", group),
        frames_figure(actors, [round(each, 2) for each in times_s]),
        f"The robots at instants of their walk, with their {goal.label}{ended}; lines are 5 cm "
        f"apart{pale}.",
    )
    return Section(_titled("Replay", group), replay + stills)


def _distance_section(
    group: str, trajectories: Mapping[str, Trajectory], sheet: Sheet, goal: Goal
) -> Section:
    return Section(
        _titled(f"{goal.title} and path", group),
        page.side_by_side(
            sheet.drawn(
                _named("distance", group),
                distance_figure(trajectories, goal),
                "Forward distance of the tracked point, by default the middle of the hub's top."
                if goal.is_forward
                else f"{goal.title}, since the start.",
            ),
            sheet.drawn(
                _named("path", group),
                path_figure(trajectories),
                "Paths seen from above, each robot drawn where it ended.",
            ),
        ),
    )


def _gait_sections(
    group: str, trajectories: Mapping[str, Trajectory], sheet: Sheet, goal: Goal
) -> list[Section]:
    first, trajectory = next(iter(trajectories.items()))
    plan = plan_of_walk(trajectory)
    gait = page.side_by_side(
        sheet.drawn(
            _named("pressures", group),
            pressure_figure(trajectory, highest_regulator(plan)),
            f"Pressures of the robot called {first}: what is commanded, and what the regulators "
            "reach.",
        ),
        sheet.drawn(
            _named("design", group),
            plan_view_figure(plan, trajectory.metadata.get("design", "")),
            "The design from above: colours and numbers are the regulators', a letter the kind of "
            "module; the arrow is forward.",
        ),
    )
    sections = [Section(_titled("Gait", group), gait)]
    long_enough = {name: each for name, each in trajectories.items() if each.time_s[-1] >= _CYCLE_S}
    if not long_enough:
        return sections
    steps = sheet.drawn(
        _named("steps", group),
        step_figure(
            {name: (each.time_s, goal.along(each)) for name, each in long_enough.items()}, goal=goal
        ),
        f"{goal.title} of every second, and below zero the furthest slide back within each 4 s.",
    )
    name, walked = next(iter(long_enough.items()))
    if not can_be_drawn(walked):
        return [*sections, Section(_titled("Step by step", group), steps)]
    cycle = sheet.drawn(
        _named("cycle", group),
        cycle_figure(walked, goal=goal),
        f"The last whole 4 s of the robot called {name}: pressures, tilt of the hub, how high "
        "each leg's lowest node is (over the floor it is below zero where the leg sags between its "
        "contact points, and by up to 2 mm where these give way under load, which drawn nodes do "
        f"not show), what the floor bears of it where that was recorded, and {goal.label}.",
    )
    return [
        *sections, Section(_titled("Step by step", group), page.side_by_side(steps, cycle)),
    ]  # fmt: skip
