"""What a leg's name stands for: shape, material, and the robot and physics that belong to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Literal

from pneumorph.catalogue.hub_spec import HubModel
from pneumorph.catalogue.masses import Masses, MassModel
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.silicones import BEAM_RELAXATION, silicone
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.surfaces import HUB_SURFACE, PRINTED_PLASTIC, SILICONE
from pneumorph.reduction.reduced_part import ReducedPart

LegName = Literal["published", "hyperelastic", "measured"]
"""The published leg, one of the silicone's own stiffness, or one of all that was measured of it."""


@cache
def paper_leg_mesh() -> Mesh:
    """Mesh of the PneuNet leg that ships; made by ``pneumorph mesh leg --preset paper``."""
    return Mesh.load(data_file("leg_mesh.npz"))


@cache
def hyperelastic_leg_mesh() -> Mesh:
    """Mesh of quadratic tetrahedra that ships.

    Made by ``pneumorph mesh leg --no-face-tied``.
    """
    return Mesh.load(data_file("leg_mesh_quadratic.npz"))


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


def masses_of(name: LegName) -> Masses:
    """What a robot with a leg weighs where nothing else is asked for: a leg of the silicone's own
    stiffness weighs what it is.

    Raises:
        ValueError: No such leg.
    """
    return Masses(leg_kind(name).mass_model)
