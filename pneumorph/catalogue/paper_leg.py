"""The legs of the paper's robot, by name: shape, material, and the physics that belongs to them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_from_dict
from pneumorph.catalogue.density_check import (
    IN_GRAMS,
    WEIGHED_G_PER_ML,
    check_density,
    material_volume,
)
from pneumorph.catalogue.hub_spec import HUB_SURFACE, HubModel
from pneumorph.catalogue.masses import CastDensities, Masses, MassModel, cast_leg_mass_kg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.part_physics import PhysicsName, refuse_other_physics
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.silicones import BEAM_RELAXATION, silicone
from pneumorph.geometry.attachment import attachment_frame, face_of_mesh
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.surfaces import PRINTED_PLASTIC, SILICONE
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.scaled_part import REDUCED_SO, as_made_first, scaled_part

LegName = Literal["published", "hyperelastic", "measured"]
"""The published leg, one of the silicone's own stiffness, or one of all that was measured of it."""

_OLDER_LEGS = {"paper": "published"}


@cache
def paper_leg_mesh() -> Mesh:
    """Mesh of the PneuNet leg that ships; made by ``pneumorph mesh leg --preset paper``."""
    return Mesh.load(data_file("leg_mesh.npz"))


@cache
def measured_leg_mesh() -> Mesh:
    """The same, tied to the hub over the end face of its first tooth, which is solid."""
    return tied_over_face(hyperelastic_leg_mesh())


@cache
def load_default_leg(name: LegName = "measured") -> ReducedPart:
    """A reduced leg that ships; see `pneumorph reduce` for what made it.

    Raises:
        ValueError: No such leg.
        FileNotFoundError: Its reduction does not ship.
    """
    try:
        path = data_file(f"leg_{name}.npz")
    except FileNotFoundError as error:
        raise FileNotFoundError(
            f"no reduction of the {name} leg ships; make one with pneumorph reduce and "
            "give it as --part, or simulate finite elements with --model full"
        ) from error
    return ReducedPart.load(path)


HYPERELASTIC_MATERIALS = LegMaterials(
    silicone=Material(600.0, 0.45, "stable_neo_hookean"),
    sheet=Material(1200.0, 0.49, "stable_neo_hookean"),
)
"""A leg as its silicone's data sheet has it, the sheet twice as stiff; its reduction was made with
the published mass."""

HYPERELASTIC_PRESSURE_MAP = PressureMap(1.247, -4.404)
"""Makes the hyperelastic leg bend as the published pairs say the real one does, to 2 kPa; made by
reproduce/actuator_bend."""


MEASURED_MATERIALS = LegMaterials(
    silicone=silicone("Dragon Skin 30").material(relaxation=BEAM_RELAXATION, small_strain=True),
    sheet=Material(2e6, 0.3, "st_venant_kirchhoff"),
    sheet_thickness_mm=0.1,
    mass_kg=0.0468,
    mass_lumping="volume",
    relaxation=BEAM_RELAXATION,
)
"""A leg of the silicone's tension test. The sheet is paper of 2 GPa, which nobody measured: the leg
bends alike as long as it is stiff (`reproduce/measured_bend`)."""


@cache
def hyperelastic_leg_mesh() -> Mesh:
    """Mesh of quadratic tetrahedra that ships.

    Made by ``pneumorph mesh leg --no-face-tied``.
    """
    return Mesh.load(data_file("leg_mesh_quadratic.npz"))


def current_leg(name: Any) -> Any:
    """What a leg is called now that an earlier version called ``paper``."""
    return _OLDER_LEGS.get(name, name) if isinstance(name, str) else name


def with_current_leg(content: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of an earlier version with their leg as it is called now."""
    return {**content, "leg": current_leg(content["leg"])} if "leg" in content else dict(content)


@dataclass(frozen=True)
class LegKind:
    """What a leg's name stands for: its shape and material, and the robot and physics about it."""

    mesh: Callable[[], Mesh]
    materials: LegMaterials
    physics: Physics
    mass_model: MassModel
    hub_model: HubModel = "soft"
    full_order: FullOrderSettings = field(default_factory=FullOrderSettings)


def leg_kind(name: LegName) -> LegKind:
    """What a leg's name stands for.

    Raises:
        ValueError: No such leg.
    """
    if name not in _KINDS:
        raise ValueError(f"leg must be one of {', '.join(_KINDS)}, got {name!r}")
    return _KINDS[name]


_KINDS: dict[str, LegKind] = {
    "published": LegKind(paper_leg_mesh, LegMaterials(), Physics(), "published"),
    "hyperelastic": LegKind(
        hyperelastic_leg_mesh,
        HYPERELASTIC_MATERIALS,
        Physics(pressure_map=HYPERELASTIC_PRESSURE_MAP),
        "cast",
    ),
    "measured": LegKind(
        measured_leg_mesh,
        MEASURED_MATERIALS,
        Physics(
            damping="objective",
            mass_damping_per_s=0.0,
            stiffness_damping_s=0.0,  # what damps is the silicone, which relaxes
            pressure_map=PressureMap(1.0, 0.0),
            # Nobody measured it: the middles of what is known, see `measured_worlds`.
            friction=SILICONE.nominal,
            friction_by_surface=((HUB_SURFACE, PRINTED_PLASTIC.nominal),),
            # Chambers as the leg's finite elements have them up to 105 kPa, to 0.7 %.
            air=Air("orifice", chamber_growth=(0.0166, 0.0, 9.7e-7)),
        ),
        "cast",
        hub_model="rigid",  # the printed hub gives a fiftieth of what a leg does
        # 2000 steps of this error in one direction would be a fiftieth of a millimetre.
        full_order=FullOrderSettings(
            integrator="implicit_euler", newton_matrix="kept", displacement_tolerance_mm=1e-5
        ),
    ),
}


def physics_of(name: LegName) -> PhysicsName:
    """The physics that a leg is of.

    Raises:
        ValueError: No such leg.
    """
    return "measured" if leg_kind(name).materials.relaxation.weights else "published"


def pressure_map(name: LegName) -> PressureMap:
    """Real to simulated pressure of a leg.

    Raises:
        ValueError: No such leg.
    """
    return leg_kind(name).physics.pressure_map


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


def masses_of(name: LegName) -> Masses:
    """What a robot with a leg weighs where nothing else is asked for: a leg of the silicone's own
    stiffness weighs what it is.

    Raises:
        ValueError: No such leg.
    """
    return Masses(leg_kind(name).mass_model)


def paper_leg(
    name: LegName = "measured",
    part: ReducedPart | Path | None = None,
    mesh: Mesh | Path | None = None,
    materials: LegMaterials | None = None,
    masses: Masses | None = None,
    size_factor: float = 1.0,
    label: str | None = None,
    shape: PneuNetShape | None = None,
) -> Module:
    """A PneuNet leg as the paper's robot has it.

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
    """How a leg is made; fields as the arguments of `paper_leg`. Unlike functions inside that one,
    its methods go into other processes with a robot."""

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
        if self.part is not None and self.mesh is None:
            _check_full(self._reduced_as_made, self._shipped_mesh())
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
        if self.part is not None and self.mesh is None:
            _check_shape(self._reduced_as_made, self._shipped_mesh())
        return cast_leg_mass_kg(self._shape(), masses.densities)

    @cached_property
    def _reduced_as_made(self) -> ReducedPart:
        if self.part is None:
            return load_default_leg(self.name)
        part = self.part if isinstance(self.part, ReducedPart) else ReducedPart.load(self.part)
        if not part.metadata.get(REDUCED_SO, False):
            return part
        first = as_made_first(part, self._shape())
        return _without_rounding(first, self.materials or self._materials_of(first))

    def _recorded_materials(self) -> LegMaterials:
        usual = leg_kind(self.name).materials
        return usual if self.part is None else self._materials_of(self._reduced_as_made)

    def _materials_of(self, part: ReducedPart) -> LegMaterials:
        recorded = part.metadata.get("materials")
        if recorded is None:
            return leg_kind(self.name).materials
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


def _check_full(part: ReducedPart, mesh: Mesh) -> None:
    """Refuse to walk as the leg that ships what was reduced from another mesh."""
    try:
        part.check_mesh(mesh)
    except ArtefactError as error:
        raise ValueError(
            "the finite elements of this reduced leg are of another mesh than the leg that ships; "
            "give the mesh that it was made from as full.mesh"
        ) from error


def attachment_of(part: ReducedPart, shipped: Mesh) -> Pose | None:
    """The attachment face of a reduced part: as its reduction noted it, or that of the mesh that
    ships where it was made from that, or where its modes leave nodes in place; None where nothing
    tells.

    Args:
        part: The reduced part.
        shipped: A mesh that it may have been made from.

    Raises:
        MeshError: The nodes span no face.
    """
    recorded = part.metadata.get("attachment_nodes")
    if recorded is None and part.metadata.get("mesh_digest") == shipped.digest():
        return face_of_mesh(shipped)
    held = (
        np.flatnonzero(np.abs(part.modes).max(axis=(1, 2)) == 0.0)
        if recorded is None
        else np.array(recorded, dtype=int)
    )
    if len(held) < 3:
        return None
    return attachment_frame(part.rest_nodes[held], part.rest_nodes.mean(axis=0))


def _check_shape(part: ReducedPart, mesh: Mesh) -> None:
    """Refuse to weigh a reduced part by a mesh that it was not made from."""
    try:
        part.check_mesh(mesh)
    except ArtefactError as error:
        raise ValueError(
            "the mass of a cast leg comes from its mesh, and this reduced leg was made from another"
            " mesh than the leg that ships; give full.mesh, or a weighed masses.leg_mass_g"
        ) from error


@cache
def paper_leg_model() -> PartModel:
    """Finite elements of the leg that ships, with the paper's materials."""
    return paper_leg("published").full
