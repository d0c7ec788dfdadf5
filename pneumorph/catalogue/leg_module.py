"""Any leg as a module: one that ships, a part of one's own, or what a catalogue has built."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_from_dict
from pneumorph.catalogue.density_check import (
    IN_GRAMS,
    WEIGHED_G_PER_ML,
    check_density,
    material_volume,
)
from pneumorph.catalogue.leg_kinds import (
    LegName,
    leg_kind,
    load_default_leg,
    physics_of,
    pressure_map,
)
from pneumorph.catalogue.masses import CastDensities, Masses, cast_leg_mass_kg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.part_physics import refuse_other_physics
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.attachment import face_of_mesh
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.part_attachment import attachment_of
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.scaled_part import REDUCED_SO, as_made_first, scaled_part


def module_of_leg(
    name: LegName = "measured",
    part: ReducedPart | Path | None = None,
    mesh: Mesh | Path | None = None,
    materials: LegMaterials | None = None,
    masses: Masses | None = None,
    size_factor: float = 1.0,
    label: str | None = None,
    shape: PneuNetShape | None = None,
) -> Module:
    """A leg as a module: one that ships, a part of one's own, or a catalogue's.

    Args:
        name: Which material and elements.
        part: Its reduction or the file of one; None for the one that ships.
        mesh: Its mesh or the file of one; None for the one that ships.
        materials: What it is made of; None for what its reduction says, or else the name.
        masses: What it weighs; None for what its materials and its reduction say.
        size_factor: All its lengths over those it is made with; it keeps its density where no
            weighed mass is given.
        label: What it is called in summaries; None for the file or the name.
        shape: Sizes that `mesh` was made from; None for those of the mesh that ships, and unknown
            of any other.

    Raises:
        ValueError: No such leg; of `Module.reduced`, that the reduction is of another physics than
            the name, or that materials were given without one that was made of them.
    """
    if shape is None and part is None and mesh is None:
        shape = PneuNetShape()
    made = _Leg(name, part, mesh, materials, masses, size_factor, label)
    if label is None:
        unnamed = part is None or isinstance(part, ReducedPart)
        label = f"the {name} leg that ships" if unnamed else str(part)
    return Module(
        label,
        made.reduced,
        made.full,
        pressure_map=pressure_map(name),
        find_face=made.face,
        shape=None if shape is None else shape.scaled(size_factor),
    )


@dataclass(frozen=True, eq=False)
class _Leg:
    """How a leg is made; fields as the arguments of `module_of_leg`. Unlike functions inside that
    one, its methods go into other processes with a robot."""

    name: LegName
    part: ReducedPart | Path | None
    mesh: Mesh | Path | None
    materials: LegMaterials | None
    masses: Masses | None
    size_factor: float
    label: str | None

    def reduced(self) -> ReducedPart:
        made, weight = self._reduced_as_made, self._mass_kg()
        usual = leg_kind(self.name).materials
        if self.part is None and self.materials not in (None, usual):
            raise ValueError(
                "materials were given without a reduced part, expected one that was made of them: "
                f"the {self.name} leg that ships is of others; reduce the leg and give its part"
            )
        if self.part is not None:
            remedy = f"ask for a leg of the other physics in place of {self.name!r}"
            refuse_other_physics(made, physics_of(self.name), "the reduced leg", remedy)
        if weight is not None:
            made = scaled_part(made, 1.0, weight / made.mass)
        if self.size_factor == 1.0:
            return made
        resized, shape = resized_part(made, self.size_factor), self._shape()
        if made.metadata.get("mesh_digest") != shape.digest():
            return resized
        # It stands for that mesh in its size as it did for it before.
        now = shape.scaled(self.size_factor).digest()
        return replace(resized, metadata={**resized.metadata, "mesh_digest": now})

    def full(self, modulus_factor: float, mass_factor: float) -> PartModel:
        size = self.size_factor
        self._refuse_other_mesh(
            "the finite elements of this reduced leg are of",
            "give the mesh that it was made from as full.mesh",
        )
        made_of, weight = self.materials or self._recorded_materials(), self._mass_kg()
        if weight is not None:
            made_of = replace(made_of, mass_kg=weight)
        if size != 1.0:
            made_of = replace(
                made_of,
                sheet_thickness_mm=made_of.sheet_thickness_mm * size,
                mass_kg=made_of.mass_kg * size**3,
            )
        resized = self._shape() if size == 1.0 else self._shape().scaled(size)
        return leg_model(resized, scaled_materials(made_of, modulus_factor, mass_factor))

    def face(self) -> Pose | None:
        if self.part is None or self.mesh is not None:
            found: Pose | None = face_of_mesh(self._shape())
        else:
            found = attachment_of(self._reduced_as_made, self._shipped_mesh())
        if found is None:
            return None
        return Pose(found.rotation, self.size_factor * found.translation)

    def _shipped_mesh(self) -> Mesh:
        return leg_kind(self.name).mesh()

    def _shape(self) -> Mesh:
        mesh = self.mesh
        return load_leg_mesh(mesh) if isinstance(mesh, Path) else mesh or self._shipped_mesh()

    def _refuse_other_mesh(self, what: str, remedy: str) -> None:
        """Refuse to take the mesh that ships for that of a part that was reduced from another."""
        if self.part is None or self.mesh is not None:
            return
        try:
            self._reduced_as_made.check_mesh(self._shipped_mesh())
        except ArtefactError as error:
            raise ValueError(f"{what} another mesh than the leg that ships; {remedy}") from error

    def _mass_kg(self) -> float | None:
        """What is asked for; None leaves it as it is."""
        masses = self.masses
        if masses is None or (masses.leg_mass_g is None and masses.model == "published"):
            return None
        if masses.leg_mass_g is not None:
            mass, resized = 1e-3 * masses.leg_mass_g, self.size_factor**3
            own = self.part is None and self.mesh is not None
            volume = (
                float(self._shape().volumes.sum())
                if own
                else material_volume(self._reduced_as_made)
            )
            named = "" if self.label is None else f" {self.label}"
            what = f"the leg{named}, of masses.leg_mass_g or a module of mass_g,"
            check_density(what, mass, volume * resized, WEIGHED_G_PER_ML, IN_GRAMS)
            return mass / resized  # before it is resized
        if self.part is not None:
            made_by = self._reduced_as_made.metadata.get("masses", {})
            if made_by.get("model") == "cast" and masses.densities == CastDensities():
                return None  # it weighs what was cast of it when it was reduced
        self._refuse_other_mesh(
            "the mass of a cast leg comes from its mesh, and this reduced leg was made from",
            "give full.mesh, or a weighed masses.leg_mass_g",
        )
        return cast_leg_mass_kg(self._shape(), masses.densities)

    @cached_property
    def _reduced_as_made(self) -> ReducedPart:
        if self.part is None:
            return load_default_leg(self.name)
        part = self.part if isinstance(self.part, ReducedPart) else ReducedPart.load(self.part)
        if not part.metadata.get(REDUCED_SO, False):
            return part
        first = as_made_first(part, self._shape())
        return _without_rounding(first, self.materials or recorded_materials(first, self.name))

    def _recorded_materials(self) -> LegMaterials:
        usual = leg_kind(self.name).materials
        return usual if self.part is None else recorded_materials(self._reduced_as_made, self.name)


def recorded_materials(part: ReducedPart, name: LegName) -> LegMaterials:
    """What a reduction says that it was made of; where it says nothing, what the leg that it bends
    as is made of."""
    recorded = part.metadata.get("materials")
    if recorded is None:
        return leg_kind(name).materials
    return settings_from_dict(LegMaterials, recorded)


def _without_rounding(part: ReducedPart, made_of: LegMaterials) -> ReducedPart:
    """A part of given materials, whose numbers it may have but for rounding."""

    def exact(own: Material, given: Material) -> Material:
        young = given.young_modulus_kPa
        near = math.isclose(own.young_modulus_kPa, young, rel_tol=1e-12)
        return given if near and replace(own, young_modulus_kPa=young) == given else own

    weights = np.array(made_of.relaxation.weights)
    near = part.relaxation_weight.shape == weights.shape and np.allclose(
        part.relaxation_weight, weights, rtol=1e-12, atol=0.0
    )
    return replace(
        part,
        tetrahedron_material=exact(part.tetrahedron_material, made_of.silicone),
        membrane_material=exact(part.membrane_material, made_of.sheet),
        relaxation_weight=weights if near else part.relaxation_weight,
    )


def scaled_materials(
    usual: LegMaterials, modulus_factor: float = 1.0, mass_factor: float = 1.0
) -> LegMaterials:
    """A leg of a stiffer or heavier material."""
    return replace(
        usual,
        silicone=usual.silicone.stiffer(modulus_factor),
        sheet=usual.sheet.stiffer(modulus_factor),
        mass_kg=usual.mass_kg * mass_factor,
    )
