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
HUB_SURFACE = "hub"
"""What points of a hub lie on, where friction is given by surface and nothing else is said."""


@dataclass(frozen=True, eq=False)
class HubSpec:
    """A hub.

    Attributes:
        mesh: Its shape, in the robot's frame.
        material: What it is made of.
        mass: Its mass, spread evenly over the nodes [kg], or mass, centre and inertia in the
            robot's frame.
        tracked_point: Point whose travel is rewarded [mm], (3,).
        contact_points: Points that may touch the floor [mm], (point, 3).
        surface: What they lie on, by name; friction may be given for it.
    """

    mesh: Mesh
    material: Material
    mass: float | MassProperties
    tracked_point: np.ndarray
    contact_points: np.ndarray
    surface: str = ""

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
            )
        return hub_of_mesh(self.mesh, self.mass, self.tracked_point, self.contact_points, surfaces)

    def full(self, model: HubModel) -> HubBody:
        """The hub of a full-order robot.

        Raises:
            ValueError: No such model.
        """
        if model == "rigid":
            return RigidHub(self.mesh, self.mass, self.contact_points, self.surface)
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
        """The same hub of another mass; inertia is scaled with it."""
        return self.weighing(self.mass_kg * mass_factor)

    def weighing(self, mass_kg: float) -> HubSpec:
        """The same hub of a mass that a balance says; inertia is scaled with it."""
        if isinstance(self.mass, MassProperties):
            return replace(self, mass=self.mass.weighing(mass_kg))
        return replace(self, mass=mass_kg)
