"""The body that modules are mounted on, rigid and as finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pneumorph.fem.hub_body import HubBody
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.mesh import Mesh
from pneumorph.robot.robot import Hub, hub_of_mesh

HubModel = Literal["soft", "rigid"]


@dataclass(frozen=True, eq=False)
class HubSpec:
    """A hub.

    Attributes:
        mesh: Its shape, in the robot's frame.
        material: What it is made of.
        mass_kg: Its mass, spread evenly over the nodes [kg].
        tracked_point: Point whose travel is rewarded [mm], (3,).
        contact_points: Points that may touch the floor [mm], (point, 3).
    """

    mesh: Mesh
    material: Material
    mass_kg: float
    tracked_point: np.ndarray
    contact_points: np.ndarray

    @cached_property
    def rigid(self) -> Hub:
        """The rigid body of reduced robots."""
        return hub_of_mesh(self.mesh, self.mass_kg, self.tracked_point, self.contact_points)

    def full(self, model: HubModel) -> HubBody:
        """The hub of a full-order robot.

        Raises:
            ValueError: No such model.
        """
        if model == "rigid":
            return RigidHub(self.mesh, self.mass_kg, self.contact_points)
        if model == "soft":
            part = PartModel(self.mesh, self.material, self.mass_kg)
            return SoftHub(part, self.contact_points)
        raise ValueError(f'hub must be "soft" or "rigid", got {model!r}')

    def scaled(self, mass_factor: float) -> HubSpec:
        """The same hub of another mass."""
        return replace(self, mass_kg=self.mass_kg * mass_factor)
