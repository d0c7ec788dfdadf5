"""A robot from above, at rest: outlines of its hub and of its legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from pneumorph.geometry.surface import boundary_triangles
from pneumorph.report.payload_mark import PayloadMark, payload_mark, payload_mark_of
from pneumorph.report.plan_bands import chamber_bands
from pneumorph.report.silhouette import silhouette
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from pneumorph.catalogue.robot_options import RobotOptions
    from pneumorph.catalogue.robot_spec import RobotSpec
    from pneumorph.robot.robot import Mount
    from pneumorph.trajectory import Trajectory

DISK_RADIUS_MM = 54.5
LEG_LENGTH_MM = 115.0 * np.cos(np.radians(15.0))
LEG_CENTRE_MM = 52.0 * np.cos(np.radians(15.0)) + 50.0
LEG_WIDTH_MM = 32.0
HALF_WIDTH_MM = 172.0
"""Half the width that the paper's robot is drawn in."""
_CORNERS = 60


@dataclass(frozen=True, eq=False)
class Plan:
    """A robot from above, forward along x.

    Attributes:
        hub_mm: Corners of the hub's outline, (corner, 2), of one polygon: see `silhouette`.
        legs_mm: Of each leg's, each (corner, 2).
        regulators: Of each leg's cavities, or one of all of them, from 1.
        entries: Of each leg in the name of the design: its kind and its regulators, such as ``b2``.
        bands_mm: Of each leg the part of its outline for each of its cavities, each (corner, 2);
            of a single one the outline.
        payload: Mark of what the hub carries; None for nothing.
    """

    hub_mm: np.ndarray
    legs_mm: tuple[np.ndarray, ...]
    regulators: tuple[tuple[int, ...], ...]
    entries: tuple[str, ...]
    bands_mm: tuple[tuple[np.ndarray, ...], ...]
    payload: PayloadMark | None = None

    def coloured(self, leg: int) -> list[tuple[np.ndarray, int]]:
        """Parts of a leg's outline, and the regulator of each."""
        own = self.regulators[leg]
        if len(own) == 1:
            return [(self.legs_mm[leg], own[0])]
        return list(zip(self.bands_mm[leg], own, strict=True))

    @property
    def half_width_mm(self) -> float:
        """Half the width of a square about the origin that holds all of it."""
        return float(max(np.abs(each).max(initial=0.0) for each in self._outlines))

    @property
    def reach_mm(self) -> float:
        """Distance of its furthest point from the origin."""
        return float(max(np.linalg.norm(each, axis=1).max(initial=0.0) for each in self._outlines))

    @property
    def _outlines(self) -> tuple[np.ndarray, ...]:
        carried = () if self.payload is None else (self.payload.outline_mm,)
        return (self.hub_mm, *self.legs_mm, *carried)


PlanOf = Callable[[Design], Plan]
"""What a design of a robot looks like."""


def paper_plan(design: Design) -> Plan:
    """A design of the paper's robot, or of one with as many legs around a disk."""
    turn = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    rectangle = corners * [LEG_LENGTH_MM, LEG_WIDTH_MM] + [LEG_CENTRE_MM, 0.0]
    legs = tuple(rectangle @ _turned(design.angle_rad(each.location)).T for each in design.fittings)
    fittings = zip(legs, design.fittings, strict=True)
    return Plan(
        DISK_RADIUS_MM * np.stack([np.cos(turn), np.sin(turn)], axis=1),
        legs,
        tuple(each.regulators for each in design.fittings),
        tuple(map(str, design.fittings)),
        tuple(tuple(chamber_bands(leg, len(each.regulators))) for leg, each in fittings),
    )


def plan_of_walk(trajectory: Trajectory) -> Plan:
    """A recorded robot as it was simulated, when its recording began; one of an earlier version,
    which does not say what it looks like, is the paper's."""
    shape, nodes = trajectory.shape, trajectory.node_positions_mm
    if shape is None or nodes is None or trajectory.skin_triangles is None:
        return paper_plan(Design.parse(trajectory.metadata["design"]))
    in_hub = (nodes[0] - trajectory.hub_position_mm[0]) @ trajectory.hub_rotation[0]
    legs = tuple(
        _outline(in_hub[leg, np.unique(trajectory.skin_triangles[shape.skin_of(leg)])])
        for leg in range(len(shape.leg_part))
    )
    design = trajectory.metadata.get("design")
    fittings = Design.parse(design).fittings if isinstance(design, str) else ()
    named = {each.location: each for each in fittings}
    sites = list(zip(shape.leg_site.tolist(), shape.regulators, strict=True))
    return Plan(
        silhouette(shape.hub_nodes_mm, shape.hub_triangles),
        legs,
        # One regulator of all cavities is recorded for each of them.
        tuple(named[site].regulators if site in named else own for site, own in sites),
        tuple(str(named.get(site, "+".join(map(str, own)))) for site, own in sites),
        tuple(
            _bands(outline, len(own), shape.cavities_of(leg))
            for leg, (outline, own) in enumerate(zip(legs, shape.regulators, strict=True))
        ),
        payload_mark_of(shape),
    )


def plans_of(robot: RobotOptions) -> PlanOf:
    """What the designs of a robot look like: the paper's, or those of a description or with a leg
    of one's own."""
    if robot.description is None and robot.part is None:
        return paper_plan
    return plans_of_spec(robot.spec())


def plans_of_spec(spec: RobotSpec) -> PlanOf:
    """What the designs of a robot look like, from its hub and modules."""
    mesh, carried = spec.hub.mesh, spec.hub.payload
    skin = boundary_triangles(mesh.tetrahedra)
    hub = silhouette(mesh.nodes, skin)
    mark = None if carried is None else payload_mark(carried.place_mm, mesh.nodes, skin)

    def plan(design: Design) -> Plan:
        mounts = spec.assembly(design).mounts
        legs = tuple(_outline(mount.pose.apply(mount.part.rest_nodes)) for mount in mounts)
        return Plan(
            hub,
            legs,
            tuple(each.regulators for each in design.fittings),
            tuple(map(str, design.fittings)),
            tuple(
                _bands(outline, mount.part.cavity_count, _placed_centres(mount))
                for outline, mount in zip(legs, mounts, strict=True)
            ),
            mark,
        )

    return plan


def _placed_centres(mount: Mount) -> np.ndarray | None:
    """Middle of each of a mount's cavities in the robot's frame [mm], (cavity, 3)."""
    centres = mount.part.cavity_centres_mm
    return None if centres is None else mount.pose.apply(centres)


def _bands(outline: np.ndarray, count: int, centres: np.ndarray | None) -> tuple[np.ndarray, ...]:
    return tuple(chamber_bands(outline, count, None if centres is None else centres[:, :2]))


def _outline(points: np.ndarray) -> np.ndarray:
    """Convex hull of points from above, (corner, 2)."""
    if len(points) < 3:
        return np.zeros((0, 2))
    flat = points[:, :2].astype(float)
    corners: np.ndarray = flat[ConvexHull(flat).vertices]
    return corners


def _turned(angle_rad: float) -> np.ndarray:
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cosine, -sine], [sine, cosine]])
