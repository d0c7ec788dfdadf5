"""Walks, robots and meshes as a notebook shows them.

Each player is a page of its own inside a frame: pages of one notebook share no names, and nothing
is fetched. The same player as that of replay pages.
"""

from __future__ import annotations

import html
from functools import singledispatch

import numpy as np

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.robot_shape import stacked
from pneumorph.report.mesh_figure import mesh_figure
from pneumorph.report.page import drawn
from pneumorph.report.plan import plans_of_spec
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.replay.page import page_of, replay_fragment
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.scene import Actor
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Robot
from pneumorph.trajectory import Trajectory

REPLAY = ReplaySettings(tolerance_mm=0.05, frame_interval_s=0.05)
"""A notebook keeps what it shows: half as much as a replay page of its own."""

_WALK_HEIGHT_PX, _STILL_HEIGHT_PX = 620, 400
_STILL = "<style>.pr-bar, .pr-slider, .pr-time { display: none !important; }</style>"
"""A robot that does not move needs no time line."""


@singledispatch
def html_of(value: object) -> str | None:
    """HTML of a trajectory (its replay), a robot (at rest, to turn about), a mesh (its regions), a
    robot's description (its usual design from above) or specification (a leg at every site).

    Args:
        value: What to show.

    Returns:
        HTML that a notebook may hold several times; None where there is nothing to draw, such as a
        walk that was recorded without nodes.
    """
    return None


@html_of.register
def _(walk: Trajectory) -> str | None:
    if walk.node_positions_mm is None or walk.skin_triangles is None:
        return None
    if walk.shape is None and not isinstance(walk.metadata.get("design"), str):
        return None  # of an earlier version, and it does not say what its robot looks like
    return _framed(walk, str(walk.metadata.get("design", "robot")), _WALK_HEIGHT_PX)


@html_of.register
def _(robot: Robot) -> str | None:
    if not robot.mounts:
        return None
    label = "robot" if robot.design is None else str(robot.design)
    return _framed(_at_rest(robot), label, _STILL_HEIGHT_PX, _STILL)


@html_of.register
def _(mesh: Mesh) -> str:
    return drawn(mesh_figure(mesh), repr(mesh))


@html_of.register
def _(robot: RobotSpec) -> str:
    return _plan(robot, Design((1,) * len(robot.sites)), repr(robot))


@html_of.register
def _(robot: RobotDescription) -> str:
    design = robot.usual_design
    return _plan(robot.spec(), Design.parse(design), f"{robot!r}, {design}")


def _plan(spec: RobotSpec, design: Design, alt: str) -> str:
    """A design from above, forward to the right."""
    return drawn(plan_view_figure(plans_of_spec(spec)(design)), alt)


def _at_rest(robot: Robot) -> Trajectory:
    """The robot as a walk of one frame, without pressure."""
    shape, skin = robot.shape
    nodes = [mount.pose.apply(mount.part.rest_nodes) for mount in robot.mounts]
    still = np.zeros((1, 3))
    none = np.zeros((1, max(max(mount.regulators) for mount in robot.mounts) + 1))
    return Trajectory(
        time_s=np.zeros(1),
        hub_position_mm=still,
        hub_rotation=np.eye(3)[None],
        tracked_point_mm=robot.hub.tracked_point[None],
        commanded_kPa=none,
        regulated_kPa=none,
        contact_count=np.zeros(1, dtype=int),
        node_positions_mm=stacked(nodes, fill_last=True)[None].astype(np.float32),
        skin_triangles=skin,
        shape=shape,
    )


def _framed(walk: Trajectory, label: str, height_px: int, style: str = "") -> str:
    page = page_of(label, style + replay_fragment([Actor.of(walk, label)], REPLAY))
    return (
        f'<iframe srcdoc="{html.escape(page)}" title="{html.escape(label)}" loading="lazy" '
        f'style="width: 100%; height: {height_px}px; border: 0"></iframe>'
    )
