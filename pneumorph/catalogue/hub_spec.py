"""The body that modules are mounted on, rigid and as finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pneumorph.fem.hub_body import HubBody
from pneumorph.fem.matched_mass import matched_node_mass
from pneumorph.fem.material import MassLumping, Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh
from pneumorph.robot.robot import Hub, hub_of_mesh

HubModel = Literal["soft", "rigid"]


@dataclass(frozen=True, eq=False)
class HubPayload:
    """What a hub carries, as a point.

    Attributes:
        mass_kg: Its mass [kg].
        place_mm: Where it lies in the robot's frame [mm], (3,).
    """

    mass_kg: float
    place_mm: np.ndarray


@dataclass(frozen=True, eq=False)
class HubSpec:
    """A hub.

    Attributes:
        mesh: Its shape, in the robot's frame.
        material: What it is made of.
        mass: Its mass, spread evenly over the nodes [kg], or mass, centre and inertia in the
            robot's frame; with what it carries.
        tracked_point: Point whose travel is rewarded [mm], (3,).
        contact_points: Points that may touch the floor [mm], (point, 3).
        surface: What they lie on, by name; friction may be given for it.
        payload: What of the mass it carries, which is told and drawn; None for nothing.
    """

    mesh: Mesh
    material: Material
    mass: float | MassProperties
    tracked_point: np.ndarray
    contact_points: np.ndarray
    surface: str = ""
    payload: HubPayload | None = None

    def __repr__(self) -> str:
        points = len(self.contact_points)
        return f"HubSpec({1e3 * self.mass_kg:.4g} g, {points} contact points, {self.mesh!r})"

    @property
    def mass_kg(self) -> float:
        """Its mass [kg]."""
        return self.mass.mass_kg if isinstance(self.mass, MassProperties) else self.mass

    def mass_numbers(self) -> list[float]:
        """All that is given of its mass: one number, or mass, centre and inertia in a row."""
        given = self.mass
        if isinstance(given, MassProperties):
            return [given.mass_kg, *given.centre_mm.tolist(), *given.inertia.ravel().tolist()]
        return [given]

    @cached_property
    def rigid(self) -> Hub:
        """The rigid body of reduced robots."""
        surfaces = ContactSurfaces.of_one(
            self.surface, self.mesh.skin_area_mm2, len(self.contact_points)
        )
        if isinstance(self.mass, MassProperties):
            return Hub(
                self.mass.mass_kg,
                self.mass.first_moment,
                self.mass.second_moment,
                self.tracked_point,
                self.contact_points,
                surfaces,
                self.mesh,
                self._payload_mm,
            )
        return hub_of_mesh(self.mesh, self.mass, self.tracked_point, self.contact_points, surfaces)

    @property
    def centre_mm(self) -> np.ndarray:
        """Its centre of mass in the robot's frame, with what it carries [mm], (3,)."""
        given = self.mass
        centre: np.ndarray = (
            given.centre_mm if isinstance(given, MassProperties) else self.mesh.nodes.mean(axis=0)
        )
        return centre

    @property
    def _payload_mm(self) -> np.ndarray | None:
        return None if self.payload is None else self.payload.place_mm

    def full(self, model: HubModel) -> HubBody:
        """The hub of a full-order robot.

        Raises:
            ValueError: No such model.
        """
        if model == "rigid":
            return RigidHub(
                self.mesh, self.mass, self.contact_points, self.surface, self._payload_mm
            )
        if model == "soft":
            lumping: MassLumping | np.ndarray = (
                matched_node_mass(self.mesh, self.mass)
                if isinstance(self.mass, MassProperties)
                else "even"
            )
            part = PartModel(self.mesh, self.material, self.mass_kg, mass_lumping=lumping)
            return SoftHub(part, self.contact_points, self.surface)
        raise ValueError(f'hub must be "soft" or "rigid", got {model!r}')

    def scaled(self, mass_factor: float) -> HubSpec:
        """The same hub of another mass; inertia and what it carries are scaled with it."""
        return self.weighing(self.mass_kg * mass_factor)

    def weighing(self, mass_kg: float) -> HubSpec:
        """The same hub of a mass that a balance says; inertia and what it carries are scaled with
        it."""
        payload = self.payload
        if payload is not None:
            payload = replace(payload, mass_kg=payload.mass_kg * (mass_kg / self.mass_kg))
        if isinstance(self.mass, MassProperties):
            return replace(self, mass=self.mass.weighing(mass_kg), payload=payload)
        return replace(self, mass=mass_kg, payload=payload)
