"""A robot: a rigid hub and reduced parts mounted on it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pneumorph.base.notebook import ShownInNotebooks
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.robot_shape import PlacedPart, RobotShape
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design


@dataclass(frozen=True, eq=False)
class Hub:
    """The rigid body that parts are mounted on; its frame is the robot's frame at rest.

    Args:
        mass: Mass [kg].
        first_moment: sum m r about the frame's origin [kg mm], (3,).
        second_moment: sum m r r^T about the frame's origin [kg mm^2], (3, 3).
        tracked_point: Point whose travel is rewarded [mm], (3,).
        contact_points: Points that may touch the floor [mm], (point, 3).
        contact_surfaces: What they lie on; None for one surface without a name.
        mesh: Its shape in its frame, for drawing; None where it is not known.
        payload_mm: Where what it carries lies in its frame, for drawing: mass and moments have it
            in them [mm], (3,); None for nothing.

    Raises:
        ValueError: The mass is not positive, or an array has the wrong shape or is not finite.
    """

    mass: float
    first_moment: np.ndarray
    second_moment: np.ndarray
    tracked_point: np.ndarray
    contact_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    contact_surfaces: ContactSurfaces | None = None
    mesh: Mesh | None = None
    payload_mm: np.ndarray | None = None

    def __repr__(self) -> str:
        return f"Hub({1e3 * self.mass:.4g} g, {len(self.contact_points)} contact points)"

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"hub mass must be positive [kg], got {self.mass}")
        shapes = {"first_moment": (3,), "second_moment": (3, 3), "tracked_point": (3,)}
        shapes["contact_points"] = (len(self.contact_points), 3)
        for name, shape in shapes.items():
            value = np.ascontiguousarray(getattr(self, name), dtype=float)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ValueError(f"hub {name} must be finite of shape {shape}, got {value.shape}")
            object.__setattr__(self, name, value)
        points, surfaces = len(self.contact_points), self.contact_surfaces
        if surfaces is not None and len(surfaces.names) != points:
            raise ValueError(
                f"hub contact_surfaces has {len(surfaces.names)} names, expected one for each of "
                f"the {points} contact points"
            )


def hub_of_mesh(
    mesh: Mesh,
    mass_kg: float,
    tracked_point: np.ndarray,
    contact_points: np.ndarray,
    contact_surfaces: ContactSurfaces | None = None,
) -> Hub:
    """A rigid hub with the mass of a mesh spread evenly over its nodes, as the full model has it.

    Args:
        mesh: Shape of the hub in the robot's frame.
        mass_kg: Total mass [kg].
        tracked_point: Point whose travel is rewarded [mm], (3,).
        contact_points: Points that may touch the floor [mm], (point, 3).
        contact_surfaces: What they lie on.
    """
    node_mass = mass_kg / len(mesh.nodes)
    return Hub(
        mass=mass_kg,
        first_moment=node_mass * mesh.nodes.sum(axis=0),
        second_moment=node_mass * mesh.nodes.T @ mesh.nodes,
        tracked_point=tracked_point,
        contact_points=contact_points,
        contact_surfaces=contact_surfaces,
        mesh=mesh,
    )


@dataclass(frozen=True, eq=False)
class Mount:
    """One part on the hub.

    Args:
        part: The reduced part, in its own frame.
        pose: Where it sits in the robot's frame.
        regulators: For each of the part's cavities the number of its regulator, counted from 0.
    """

    part: ReducedPart
    pose: Pose
    regulators: tuple[int, ...]

    def __post_init__(self) -> None:
        if len(self.regulators) != self.part.cavity_count:
            raise ValueError(
                f"regulators has {len(self.regulators)} entries for a part of "
                f"{self.part.cavity_count} cavities; give one regulator for each cavity"
            )


@dataclass(frozen=True, eq=False)
class Robot(ShownInNotebooks):
    """A hub, what is mounted on it, and the design it was built from."""

    hub: Hub
    mounts: tuple[Mount, ...]
    design: Design | None = None
    kin_surfaces: frozenset[str] = frozenset()
    """Names of surfaces that other designs of the robot have."""

    def __repr__(self) -> str:
        whose = "" if self.design is None else f"{self.design}: "
        mass = self.hub.mass + sum(mount.part.mass for mount in self.mounts)
        return f"Robot({whose}{len(self.mounts)} parts on a hub, {1e3 * mass:.4g} g)"

    @cached_property
    def shape(self) -> tuple[RobotShape, np.ndarray | None]:
        """What it looks like, and the skin triangles of its different parts."""
        sites = [each.location for each in self.design.fittings] if self.design else []
        if len(sites) != len(self.mounts):
            sites = list(range(len(self.mounts)))
        legs = [
            PlacedPart(
                mount.part, mount.part.skin, mount.pose,
                tuple(regulator + 1 for regulator in mount.regulators), site,
                mount.part.cavity_centres_mm,
            )
            for mount, site in zip(self.mounts, sites, strict=True)
        ]  # fmt: skip
        return RobotShape.of(self.hub.mesh, legs, self.hub.payload_mm)

    @cached_property
    def standing_points(self) -> np.ndarray:
        """All contact points at rest in the robot's frame [mm], the hub's first, (point, 3)."""
        legs = (mount.pose.apply(mount.part.contact_points) for mount in self.mounts)
        return np.concatenate([self.hub.contact_points, *legs])

    @cached_property
    def contact_surfaces(self) -> ContactSurfaces:
        """What all contact points lie on, the hub's first and then those of each mount."""
        hub = self.hub.contact_surfaces
        joined = ContactSurfaces.joined(
            [
                ContactSurfaces.unnamed(len(self.hub.contact_points)) if hub is None else hub,
                *(mount.part.contact_surfaces for mount in self.mounts),
            ]
        )
        return replace(joined, elsewhere=self.kin_surfaces)
