"""What summaries say of a robot's mass: that of its hub, what the hub carries, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.reduced_part import ReducedPart

Place = tuple[float, float, float]


@dataclass(frozen=True)
class RobotMass:
    """Masses of a robot at rest, and their centres in its frame."""

    hub_kg: float
    """Of the hub, with what it carries."""
    hub_centre_mm: Place
    """Its centre of mass, likewise."""
    payload_kg: float = 0.0
    """Of what the hub carries."""
    payload_mm: Place | None = None
    """Where that lies; None where it carries nothing."""
    robot_kg: float | None = None
    """Of all of a design; None where a result is of several."""
    robot_centre_mm: Place | None = None
    """Its centre of mass, without pressure; None likewise."""

    @property
    def words(self) -> str:
        """In a line, such as ``0.162 kg, of it hub 40 g and on it payload 20 g at (18, 0, 46) mm,
        centre of mass (3, 0, 31) mm``."""
        empty = f"hub {1e3 * (self.hub_kg - self.payload_kg):.4g} g"
        if self.payload_words:
            empty += f" and on it {self.payload_words}"
        if self.robot_kg is None or self.robot_centre_mm is None:
            return f"{empty}, centre of mass {_told(self.hub_centre_mm)}"
        centre = _told(self.robot_centre_mm)
        return f"{self.robot_kg:.3g} kg, of it {empty}, centre of mass {centre}"

    @property
    def payload_words(self) -> str:
        """What the hub carries, such as ``payload 20 g at (18, 0, 46) mm``; empty for nothing."""
        if self.payload_mm is None:
            return ""
        return f"payload {1e3 * self.payload_kg:.4g} g at {_told(self.payload_mm)}"


def robot_mass(
    hub: HubSpec, mounted: Sequence[tuple[ReducedPart | PartModel, Pose]] | None = None
) -> RobotMass:
    """What a hub weighs and carries and, with what is mounted on it, the whole robot, at rest.

    Args:
        hub: The hub.
        mounted: The parts of a design and where they are; None for the hub alone.
    """
    carried = hub.payload
    of_hub = RobotMass(
        hub_kg=hub.mass_kg,
        hub_centre_mm=_as_place(hub.centre_mm),
        payload_kg=0.0 if carried is None else carried.mass_kg,
        payload_mm=None if carried is None else _as_place(carried.place_mm),
    )
    if mounted is None:
        return of_hub
    mass, moment = hub.mass_kg, hub.mass_kg * hub.centre_mm
    for part, pose in mounted:
        if isinstance(part, PartModel):
            own, first = part.mass_kg, part.node_mass @ part.rest_nodes
        else:
            own, first = part.mass, part.first_moment
        mass, moment = mass + own, moment + own * pose.apply(first[None] / own)[0]
    return replace(of_hub, robot_kg=float(mass), robot_centre_mm=_as_place(moment / mass))


def _as_place(point: np.ndarray) -> Place:
    x, y, z = (np.round(point, 6) + 0.0).tolist()  # without what is left of sums that are 0
    return x, y, z


def _told(place: Place) -> str:
    # Rounded first: -0 would be told as -0.
    return f"({', '.join(f'{round(each, 1) + 0.0:.4g}' for each in place)}) mm"
