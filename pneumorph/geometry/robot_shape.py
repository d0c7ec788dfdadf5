"""What a robot looks like: the surface of its hub, and of each part at its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from pneumorph.base.numbering import check_within
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.surface import boundary_triangles

_PREFIX = "shape:"


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """A part on a hub, as it is drawn.

    Attributes:
        part: What it is: legs of the same object have the same nodes.
        skin: Its outer triangles, (triangle, 3).
        pose: Its frame in the robot's.
        regulators: Numbers of the regulators of its cavities, from 1.
        site: Number of its site.
        cavity_centres_mm: Middle of each cavity in its frame, (cavity, 3); None where that is not
            known.
    """

    part: Any
    skin: np.ndarray
    pose: Pose
    regulators: tuple[int, ...]
    site: int
    cavity_centres_mm: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class RobotShape:
    """A robot as it was simulated, at rest. Axes: leg, cavity, triangle, node of the hub."""

    hub_nodes_mm: np.ndarray
    """Nodes of the hub's surface in the robot's frame [mm], (node, 3); none of a hub whose shape is
    not known."""
    hub_triangles: np.ndarray
    """Their triangles, normals outward, (triangle, 3)."""
    leg_part: np.ndarray
    """Number of each leg's part among the different ones, (leg,)."""
    leg_site: np.ndarray
    """Number of the site that each leg is mounted at, (leg,)."""
    leg_regulators: np.ndarray
    """Number of the regulator of each cavity, from 1; 0 for a cavity that a part has not, (leg,
    cavity)."""
    leg_rotation: np.ndarray
    """Each leg's frame to the robot's, (leg, 3, 3)."""
    leg_position_mm: np.ndarray
    """Origin of each leg's frame in the robot's [mm], (leg, 3)."""
    skin_part: np.ndarray
    """Number of the part that each of a trajectory's skin triangles belongs to, (triangle,)."""
    leg_cavity_mm: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3)))
    """Middle of each leg's cavities in the robot's frame [mm], (leg, cavity, 3), NaN for one that
    it has not or whose place is not known; none in files of earlier versions."""
    payload_mm: np.ndarray | None = None
    """Where what the hub carries lies in the robot's frame [mm], (3,); None where it carries
    nothing, and in files of earlier versions."""

    def __post_init__(self) -> None:
        leg = len(self.leg_part)
        shapes = {
            "leg_site": (leg,),
            "leg_rotation": (leg, 3, 3),
            "leg_position_mm": (leg, 3),
            "hub_nodes_mm": (len(self.hub_nodes_mm), 3),
            "hub_triangles": (len(self.hub_triangles), 3),
            **({} if self.payload_mm is None else {"payload_mm": (3,)}),
        }
        for name, expected in shapes.items():
            if np.shape(getattr(self, name)) != expected:
                raise ValueError(
                    f"{name} must have shape {expected}, got {np.shape(getattr(self, name))}"
                )
        if self.payload_mm is not None and not np.isfinite(self.payload_mm).all():
            raise ValueError(f"payload_mm is {self.payload_mm}, expected finite numbers")
        check_within("hub_triangles", self.hub_triangles, len(self.hub_nodes_mm), "nodes")
        check_within("leg_part", self.leg_part, leg, "parts")
        check_within("skin_part", self.skin_part, leg, "parts")
        if np.ndim(self.leg_regulators) != 2 or len(self.leg_regulators) != leg:
            raise ValueError(
                f"leg_regulators must have shape ({leg}, cavity), got "
                f"{np.shape(self.leg_regulators)}"
            )

    @classmethod
    def of(
        cls, hub: Mesh | None, legs: Sequence[PlacedPart], payload_mm: np.ndarray | None = None
    ) -> tuple[RobotShape, np.ndarray | None]:
        """The shape of parts on a hub, and the triangles of all different parts.

        Args:
            hub: Its mesh in the robot's frame; None where it is not known.
            legs: The parts.
            payload_mm: Where what the hub carries lies in the robot's frame [mm], (3,); None for
                nothing.
        """
        parts = list({id(leg.part): leg for leg in legs}.values())
        number = {id(leg.part): place for place, leg in enumerate(parts)}
        nodes, triangles = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
        if hub is not None:
            boundary = boundary_triangles(hub.tetrahedra)
            used, renumbered = np.unique(boundary, return_inverse=True)
            nodes, triangles = hub.nodes[used], renumbered.reshape(-1, 3).astype(np.int32)
        cavities = max((len(leg.regulators) for leg in legs), default=1)
        known = [np.zeros((0, 3)) if (own := leg.cavity_centres_mm) is None else leg.pose.apply(own)
                 for leg in legs]  # fmt: skip
        # One regulator may drive several cavities.
        centres = np.full((len(legs), max(map(len, known), default=0), 3), np.nan)
        for row, each in zip(centres, known, strict=True):
            row[: len(each)] = each
        shape = cls(
            hub_nodes_mm=nodes,
            hub_triangles=triangles,
            leg_part=np.array([number[id(leg.part)] for leg in legs], dtype=np.int32),
            leg_site=np.array([leg.site for leg in legs], dtype=np.int32),
            leg_regulators=np.array(
                [(*leg.regulators, *([0] * (cavities - len(leg.regulators)))) for leg in legs],
                dtype=np.int32,
            ).reshape(len(legs), cavities),
            leg_rotation=np.array([leg.pose.rotation for leg in legs]).reshape(-1, 3, 3),
            leg_position_mm=np.array([leg.pose.translation for leg in legs]).reshape(-1, 3),
            skin_part=np.concatenate(
                [np.zeros(0, np.int32)]
                + [np.full(len(leg.skin), place, np.int32) for place, leg in enumerate(parts)]
            ),
            leg_cavity_mm=centres,
            payload_mm=payload_mm,
        )
        skins = [np.asarray(leg.skin, dtype=np.int32).reshape(-1, 3) for leg in parts]
        return shape, np.concatenate(skins) if skins else None

    @property
    def regulators(self) -> tuple[tuple[int, ...], ...]:
        """Regulators of each leg's cavities, from 1."""
        return tuple(tuple(r for r in row if r) for row in self.leg_regulators.tolist())

    def cavities_of(self, leg: int) -> np.ndarray | None:
        """Middle of each of a leg's cavities in the robot's frame [mm], (cavity, 3); None where
        that is not known."""
        if leg >= len(self.leg_cavity_mm):
            return None
        centres = self.leg_cavity_mm[leg]
        own: np.ndarray = centres[~np.isnan(centres).any(axis=1)]
        return own if len(own) else None

    def skin_of(self, leg: int) -> np.ndarray:
        """Which of a trajectory's skin triangles are a leg's, (triangle,) bool."""
        own: np.ndarray = self.skin_part == self.leg_part[leg]
        return own

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything by name, for a file."""
        named = {_PREFIX + each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in named.items() if value is not None}

    @classmethod
    def taken_from(cls, arrays: Mapping[str, np.ndarray]) -> RobotShape | None:
        """What `arrays` gave a file; None of a file without it."""
        own = {k.removeprefix(_PREFIX): v for k, v in arrays.items() if k.startswith(_PREFIX)}
        return cls(**own) if own else None


def stacked(values: Sequence[np.ndarray], fill_last: bool) -> np.ndarray:
    """Rows of several legs as one array, the shorter ones filled up.

    Args:
        values: Of each leg, (row, 3).
        fill_last: Repeat the last row, as of nodes; or else with zeros, as of forces.

    Returns:
        (leg, row, 3).
    """
    most = max((len(each) for each in values), default=0)
    if all(len(each) == most for each in values):
        return np.array(values)
    filled = []
    for each in values:
        last = each[-1:] if fill_last and len(each) else np.zeros((1, 3))
        filled.append(np.concatenate([each, np.repeat(last, most - len(each), axis=0)]))
    return np.array(filled)
