"""What a film shows of one robot at one instant: triangles in the world and the colour of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.robot_shape import PlacedPart, RobotShape
from pneumorph.geometry.simple_solids import cone_solid
from pneumorph.report.ground_surface import GroundSurface, ground_surface
from pneumorph.report.payload_mark import PayloadMark, payload_mark_of
from pneumorph.report.style import DISK_COLOUR, INK_COLOUR, red_green_blue, regulator_colour
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from pneumorph.trajectory import Trajectory

ColourBy = Literal["regulator", "pressure"]
"""What the colour of a leg tells."""

_LEAST_FULL_KPA = 90.0
"""What the highest pressure of the paper's gaits is."""
_SLACK_TINT = 0.45
_SHOWN_EDGE_MM = 9.0


class Pressurised(Protocol):
    """Anything of which is known what its regulators reached [real kPa], (frame, regulator)."""

    @property
    def regulated_kPa(self) -> np.ndarray: ...


def full_pressure_kPa(shown: Iterable[Pressurised]) -> float:
    """Return the pressure at which a leg has its full colour [real kPa]: 90 kPa as in the paper's
    gaits, or the highest that a regulator of any of these robots reached where that is more.

    Args:
        shown: All robots that are shown beside each other.
    """
    highest = [np.fmax.reduce(each.regulated_kPa, axis=None, initial=0.0) for each in shown]
    return float(max([_LEAST_FULL_KPA, *highest]))


@dataclass(frozen=True, eq=False)
class ShownLeg:
    """A leg as it is drawn: its skin's nodes in the world [mm], (frame, node, 3), and triangles."""

    nodes: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class Actor:
    """One robot of a film.

    Attributes:
        trajectory: What it did, with node positions and skin.
        label: What to write beside it.
        shape: What it looks like.
        lane_mm: Where to place it across the direction of travel (y).
        goal: What of its walk is told.
    """

    trajectory: Trajectory
    label: str
    shape: RobotShape
    lane_mm: float = 0.0
    goal: Goal = FORWARD

    def __post_init__(self) -> None:
        nodes, skin = self.trajectory.node_positions_mm, self.trajectory.skin_triangles
        if nodes is None or skin is None:
            raise ValueError(
                f"the trajectory of {self.label!r} holds no node positions or no skin, which"
                " drawing needs; simulate again and record the nodes"
            )
        if nodes.shape[1] != len(self.regulators):
            raise ValueError(
                f"{self.label!r} has {len(self.regulators)} regulators, expected one for each of "
                f"the {nodes.shape[1]} legs of its trajectory"
            )

    @classmethod
    def of(cls, trajectory: Trajectory, label: str, goal: Goal = FORWARD) -> Actor:
        """Return the actor of a trajectory.

        One of an earlier version does not say what its robot looks like: it is the paper's, with
        the design that the metadata names.

        Raises:
            ValueError: Nothing to draw, or neither a shape nor a design.
        """
        return cls(trajectory, label, shape_of(trajectory, label), goal=goal)

    def travelled(self, frame: int) -> str:
        """What it has achieved at a frame, for a person; how its walk ended where that was before
        its end: such a robot has no distance."""
        if self.trajectory.status not in ("completed", "running"):
            return self.trajectory.status
        way = self.goal.along(self.trajectory)[frame]
        return f"{way:+.{self.goal.digits}f}{self.goal.symbol}"

    @property
    def regulated_kPa(self) -> np.ndarray:
        """What its regulators reached [real kPa], (frame, regulator)."""
        return self.trajectory.regulated_kPa

    @property
    def regulators(self) -> tuple[tuple[int, ...], ...]:
        """Regulators of each leg's cavities, 1, 2, ..., in the trajectory's order of legs."""
        return self.shape.regulators

    @cached_property
    def legs(self) -> tuple[ShownLeg, ...]:
        """Each leg with the nodes of its own skin alone, in ascending order of their numbers."""
        nodes, skin = self.trajectory.node_positions_mm, self.trajectory.skin_triangles
        assert nodes is not None
        assert skin is not None
        kept: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        shown = []
        for leg, part in enumerate(self.shape.leg_part.tolist()):
            if part not in kept:
                own = skin[self.shape.skin_of(leg)]
                used, renumbered = np.unique(own, return_inverse=True)
                kept[part] = used, renumbered.reshape(own.shape).astype(np.int32)
            used, triangles = kept[part]
            shown.append(ShownLeg(np.ascontiguousarray(nodes[:, leg, used]), triangles))
        return tuple(shown)

    @cached_property
    def ground(self) -> GroundSurface | None:
        """What it walked on where that is no plane, without the lane."""
        return ground_surface(self.trajectory)

    @property
    def end_s(self) -> float:
        """Time of its last frame [s]."""
        return float(self.trajectory.time_s[-1])

    @property
    def path_mm(self) -> np.ndarray:
        """Way of the tracked point from above, in its lane, (frame, 2)."""
        return np.asarray(self.trajectory.tracked_point_mm[:, :2] + np.array([0.0, self.lane_mm]))

    def extent_mm(self) -> np.ndarray:
        """Return corners of boxes around all that it will be drawn with, (point, 3)."""
        lane = np.array([0.0, self.lane_mm, 0.0])
        ends = np.array(
            [(np.nanmin(leg.nodes, axis=(0, 1)), np.nanmax(leg.nodes, axis=(0, 1)))
             for leg in self.legs]
        )  # fmt: skip
        low, high = ends[:, 0].min(axis=0) + lane, ends[:, 1].max(axis=0) + lane
        high[2] = max(high[2], low[2] + 45.0)
        others = np.concatenate([self._hub_extent_mm(), self._mark_extent_mm()]) + lane
        # A mast of a robot that lies in the floor, and the hub of one.
        others[:, 2] = np.maximum(others[:, 2], low[2])
        return np.concatenate([_box_corners(low, high), others])

    @cached_property
    def mark(self) -> PayloadMark | None:
        """How what it carries is drawn, in its frame; None where it carries nothing."""
        return payload_mark_of(self.shape)

    def _hub_extent_mm(self) -> np.ndarray:
        """Return corners of a box around its hub in all frames, (point, 3)."""
        nodes, turns = self.shape.hub_nodes_mm, self.trajectory.hub_rotation
        places = self.trajectory.hub_position_mm
        known = np.isfinite(places).all(axis=1) & np.isfinite(turns).all(axis=(1, 2))
        if not len(nodes) or not known.any():
            return np.zeros((0, 3))
        hubs = (
            nodes @ turn.T + place for turn, place in zip(turns[known], places[known], strict=True)
        )
        ends = np.array([(hub.min(axis=0), hub.max(axis=0)) for hub in hubs])
        return _box_corners(ends[:, 0].min(axis=0), ends[:, 1].max(axis=0))

    def _mark_extent_mm(self) -> np.ndarray:
        """Return ends of what it carries in all frames, (point, 3)."""
        if self.mark is None:
            return np.zeros((0, 3))
        hub = self.trajectory
        way = hub.hub_rotation @ self.mark.place_mm + hub.hub_position_mm
        way = way[np.isfinite(way).all(axis=1)]
        return np.concatenate([way - self.mark.radius_mm, way + self.mark.radius_mm])

    def frame_at(self, time_s: float) -> int:
        """Return the last recorded frame at or before a time."""
        times = self.trajectory.time_s
        return max(int(np.searchsorted(times, time_s + 1e-9, side="right")) - 1, 0)

    def corners(self, frame: int) -> np.ndarray:
        """Return all surface triangles in the world, legs first, (triangle, 3, 3) mm."""
        legs = [leg.nodes[frame][leg.triangles] for leg in self.legs]
        lane = np.array([0.0, self.lane_mm, 0.0])
        return np.concatenate([*legs, self._with_hub(self._hub_corners, frame)]) + lane

    def mark_corners(self, frame: int) -> np.ndarray:
        """Return the triangles of what it carries in the world, drawn over all of `corners`,
        (triangle, 3, 3) mm."""
        if self.mark is None:
            return np.zeros((0, 3, 3))
        return self._with_hub(self.mark.corners_mm, frame) + np.array([0.0, self.lane_mm, 0.0])

    def mark_colours(self, frame: int) -> np.ndarray:
        """Return the colour of each triangle of `mark_corners`, (triangle, 3) in 0..1."""
        return np.tile(red_green_blue(INK_COLOUR), (len(self.mark_corners(frame)), 1))

    def _with_hub(self, corners: np.ndarray, frame: int) -> np.ndarray:
        """Return triangles of the hub's frame in the world, (triangle, 3, 3) mm."""
        hub = self.trajectory
        return np.asarray(corners @ hub.hub_rotation[frame].T + hub.hub_position_mm[frame])

    @cached_property
    def _hub_corners(self) -> np.ndarray:
        """Surface of the hub, (triangle, 3, 3) mm: as small as those of legs, among which they are
        sorted by depth."""
        return halved(self.shape.hub_nodes_mm[self.shape.hub_triangles], _SHOWN_EDGE_MM)

    def colours(
        self, frame: int, colour_by: ColourBy = "regulator", full_kPa: float | None = None
    ) -> np.ndarray:
        """Return the colour of each triangle of `corners`, (triangle, 3) in 0..1.

        A leg has its regulator's colour, pale where it is slack and full at the full pressure, or
        the pressure's colour from 0 to that in cividis, made for any colour vision; one of several
        cavities what these come to in the mean.

        Args:
            frame: Its frame.
            colour_by: What the colour of a leg tells.
            full_kPa: The full pressure [real kPa], above 0; None for that of this robot alone
                (`full_pressure_kPa`).
        """
        full_kPa = full_pressure_kPa([self]) if full_kPa is None else full_kPa
        pressure = np.clip(self.regulated_kPa[frame] / full_kPa, 0.0, 1.0)
        legs = np.array([self._colour(pressure, each, colour_by) for each in self.regulators])
        hub = np.tile(red_green_blue(DISK_COLOUR), (len(self._hub_corners), 1))
        counts = [len(leg.triangles) for leg in self.legs]
        return np.concatenate([np.repeat(legs, counts, axis=0), hub])

    @staticmethod
    def _colour(inflated: np.ndarray, regulators: tuple[int, ...], by: ColourBy) -> np.ndarray:
        """Of a leg, (3,), where its regulators are inflated by shares, (regulator,)."""
        import matplotlib

        own = inflated[np.array(regulators) - 1]
        if by == "pressure":
            return np.asarray(matplotlib.colormaps["cividis"](own.mean())[:3])
        full = np.array([red_green_blue(regulator_colour(each)) for each in regulators])
        strength = _SLACK_TINT + (1.0 - _SLACK_TINT) * own
        mean: np.ndarray = (1.0 - strength[:, None] * (1.0 - full)).mean(axis=0)
        return mean


def _box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the corners of a box, (8, 3)."""
    corners = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij"))
    return np.asarray(corners.reshape(3, -1).T)


def shape_of(trajectory: Trajectory, label: str) -> RobotShape:
    """Return what the robot of a trajectory looks like.

    Args:
        trajectory: What it did.
        label: What messages call it.

    Raises:
        ValueError: It holds neither a shape nor the name of a design of the paper's robot.
    """
    if trajectory.shape is not None:
        return trajectory.shape
    design = trajectory.metadata.get("design")
    if not isinstance(design, str):
        raise ValueError(
            f"the trajectory of {label!r} says neither what its robot looks like nor its design, "
            "expected such as 1.0.0.2.2.0.0.1 in its metadata"
        )
    triangles = trajectory.skin_triangles
    return paper_shape(Design.parse(design), 0 if triangles is None else len(triangles))


def paper_shape(design: Design, triangle_count: int = 0) -> RobotShape:
    """Return what a design looks like on the paper's disk, or on one of as many locations.

    Args:
        design: The design.
        triangle_count: Triangles of a leg's skin.
    """
    disk, mounting = DiskShape(), RadialMounting(design.location_count)
    cone = cone_solid(disk.bottom_radius_mm, disk.top_radius_mm, disk.height_mm, disk.bottom_mm)
    skin = np.zeros((triangle_count, 3), dtype=np.int32)
    legs = [
        PlacedPart(None, skin, mounting.pose(each.location), each.regulators, each.location)
        for each in design.fittings
    ]
    return RobotShape.of(cone, legs)[0]


def halved(corners: np.ndarray, edge_mm: float) -> np.ndarray:
    """Return triangles cut in four until no edge is longer than a length.

    Args:
        corners: Triangles, (triangle, 3, 3) mm.
        edge_mm: The length [mm].
    """
    while len(corners):
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        long = edges > edge_mm
        if not long.any():
            break
        a, b, c = corners[long].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([corners[~long], *(np.stack(each, axis=1) for each in quarters)])
    return corners
