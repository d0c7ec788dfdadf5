"""The robot of the paper, ready to use: meshes and the reduced legs that ship with the package.

Everything that this file imports is general; here the numbers of one robot come together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_from_dict
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.masses import PRINTED_HUB, Masses, cast_leg_mass_kg
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec, Site
from pneumorph.fem.material import DiskMaterials, LegMaterials, Material
from pneumorph.fem.part_model import PartModel, leg_model
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part

LegName = Literal["published", "hyperelastic"]
"""The published leg, or one of the silicone's own stiffness."""

_OLDER_LEGS = {"paper": "published"}

DISK_MASS_KG = 0.075
"""Mass of the disk in the simulation: 2.5 times the real one's [kg]."""


def data_file(name: str) -> Path:
    """Path of a file that ships with the package.

    Raises:
        FileNotFoundError: This installation lacks it.
    """
    path = Path(str(files("pneumorph").joinpath("data", name)))
    if not path.exists():
        raise FileNotFoundError(f"{path} does not ship with this installation of pneumorph")
    return path


def data_folder(name: str) -> Path:
    """Path of a folder that ships with the package; it may be empty or missing."""
    return Path(str(files("pneumorph").joinpath("data", name)))


@cache
def paper_leg_mesh() -> Mesh:
    """Mesh of the PneuNet leg that ships; made by ``pneumorph mesh leg``."""
    return Mesh.load(data_file("leg_mesh.npz"))


@cache
def paper_disk_mesh() -> Mesh:
    """Mesh of the disk that ships; made by ``pneumorph mesh disk``."""
    return Mesh.load(data_file("disk_mesh.npz"))


@cache
def load_default_leg(name: LegName = "published") -> ReducedPart:
    """A reduced leg that ships; see `pneumorph reduce` for what made it.

    Raises:
        ValueError: No such leg.
        FileNotFoundError: Its reduction does not ship.
    """
    try:
        path = data_file(f"leg_{_known_leg(name)}.npz")
    except FileNotFoundError as error:
        raise FileNotFoundError(
            f"no reduction of the {name} leg ships; make one with pneumorph reduce and "
            "give it as --part, or simulate finite elements with --model full"
        ) from error
    return ReducedPart.load(path)


def disk_rim_points(mesh: Mesh) -> np.ndarray:
    """Nodes on the two rims of a disk [mm], (point, 3): its corners, all that a floor can meet."""
    points = []
    for name in ("bottom", "top"):
        face = mesh.nodes[mesh.node_sets[name]]
        radius = np.hypot(face[:, 0], face[:, 1])
        points.append(face[radius > radius.max() - 1e-6])
    return np.concatenate(points)


HYPERELASTIC_MATERIALS = LegMaterials(
    silicone=Material(600.0, 0.45, "stable_neo_hookean"),
    sheet=Material(1200.0, 0.49, "stable_neo_hookean"),
)
"""A leg as its silicone's data sheet has it, the sheet twice as stiff; its reduction was made with
the published mass."""

HYPERELASTIC_PRESSURE_MAP = PressureMap(1.247, -4.404)
"""Makes the hyperelastic leg bend as the published pairs say the real one does, to 2 kPa; made by
reproduce/actuator_bend."""


@cache
def hyperelastic_leg_mesh() -> Mesh:
    """Mesh of quadratic tetrahedra that ships.

    Made by ``pneumorph mesh leg --quadratic --leg-mesher.size-mm 6 --leg-mesher.grading 0.9``.
    """
    return Mesh.load(data_file("leg_mesh_quadratic.npz"))


def current_leg(name: Any) -> Any:
    """What a leg is called now that an earlier version called ``paper``."""
    return _OLDER_LEGS.get(name, name)


def with_current_leg(content: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of an earlier version with their leg as it is called now."""
    return {**content, "leg": current_leg(content["leg"])} if "leg" in content else dict(content)


def leg_materials(name: LegName) -> LegMaterials:
    """What a leg is made of.

    Raises:
        ValueError: No such leg.
    """
    return HYPERELASTIC_MATERIALS if _known_leg(name) == "hyperelastic" else LegMaterials()


def pressure_map(name: LegName) -> PressureMap:
    """Real to simulated pressure of a leg.

    Raises:
        ValueError: No such leg.
    """
    return HYPERELASTIC_PRESSURE_MAP if _known_leg(name) == "hyperelastic" else PressureMap()


def _known_leg(name: LegName) -> LegName:
    if name not in get_args(LegName):
        raise ValueError(f"leg must be one of {', '.join(get_args(LegName))}, got {name!r}")
    return name


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
    return Masses("cast" if _known_leg(name) == "hyperelastic" else "published")


def paper_leg(
    name: LegName = "published",
    part: ReducedPart | Path | None = None,
    mesh: Mesh | Path | None = None,
    materials: LegMaterials | None = None,
    masses: Masses | None = None,
) -> Module:
    """A PneuNet leg as the paper's robot has it.

    Args:
        name: Which material and elements.
        part: Its reduction or the file of one; None for the one that ships.
        mesh: Its mesh or the file of one; None for the one that ships.
        materials: What it is made of; None for what its reduction says, or else the name.
        masses: What it weighs; None for what its materials and its reduction say.

    Raises:
        ValueError: No such leg.
    """
    _known_leg(name)
    shipped_mesh = hyperelastic_leg_mesh if name == "hyperelastic" else paper_leg_mesh

    def shape() -> Mesh:
        return Mesh.load(mesh) if isinstance(mesh, Path) else mesh or shipped_mesh()

    def mass_kg() -> float | None:
        """What is asked for; None leaves it as it is."""
        if masses is None or (masses.leg_mass_g is None and masses.model == "published"):
            return None
        if masses.leg_mass_g is not None:
            return 1e-3 * masses.leg_mass_g
        if part is not None and mesh is None:
            _check_shape(reduced_as_made(), shipped_mesh())
        return cast_leg_mass_kg(shape(), masses.densities)

    @cache
    def reduced_as_made() -> ReducedPart:
        if part is None:
            return load_default_leg(name)
        return part if isinstance(part, ReducedPart) else ReducedPart.load(part)

    def reduced() -> ReducedPart:
        made, weight = reduced_as_made(), mass_kg()
        return made if weight is None else scaled_part(made, 1.0, weight / made.mass)

    def recorded_materials() -> LegMaterials:
        usual = leg_materials(name)
        recorded = (
            None
            if part is None or name != "published"
            else reduced_as_made().metadata.get("materials")
        )
        return usual if recorded is None else settings_from_dict(LegMaterials, recorded)

    def full(modulus_factor: float, mass_factor: float) -> PartModel:
        made_of, weight = materials or recorded_materials(), mass_kg()
        if weight is not None:
            made_of = replace(made_of, mass_kg=weight)
        return leg_model(shape(), scaled_materials(made_of, modulus_factor, mass_factor))

    label = f"the {name} leg that ships" if part is None or isinstance(part, ReducedPart) else part
    return Module(str(label), reduced, full, pressure_map=pressure_map(name))


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
    return paper_leg().full


@cache
def paper_hub(masses: Masses | None = None) -> HubSpec:
    """The disk; its rims may touch the floor, the centre of its top is rewarded.

    Args:
        masses: What it weighs; None for the published mass.
    """
    masses, mesh = masses or Masses(), paper_disk_mesh()
    hub = HubSpec(
        mesh,
        DiskMaterials().body,
        PRINTED_HUB if masses.model == "cast" else DISK_MASS_KG,
        np.array(DiskShape().top_centre_mm),
        disk_rim_points(mesh),
    )
    return hub if masses.hub_mass_g is None else hub.weighing(1e-3 * masses.hub_mass_g)


def _named(leg: LegName | Module) -> str:
    return f"the {leg} leg" if isinstance(leg, str) else leg.name


def paper_robot(
    leg: LegName | Module = "published",
    physics: Physics | None = None,
    masses: Masses | None = None,
    **rest: Any,
) -> RobotSpec:
    """The robot of the paper: a disk with eight places for legs.

    Args:
        leg: A leg that ships, or a module of your own for every place.
        physics: What acts on the robot, with the leg's own map of real to simulated pressure; None
            for the published physics with that map.
        masses: What the hub weighs, and a leg that ships; None for what is the leg's own: published
            masses but for the hyperelastic leg, which weighs what is cast. A module of your own has
            its own mass.
        **rest: Other fields of `RobotSpec`, such as ``thread_count``.

    Raises:
        ValueError: No such leg, or physics with the published leg's pressure map for another leg.
    """
    own = pressure_map(leg) if isinstance(leg, str) else leg.pressure_map or PressureMap()
    if physics is None:
        physics = Physics(pressure_map=own)
    elif physics.pressure_map == PressureMap() != own:
        raise ValueError(
            "physics.pressure_map is the published leg's, of slope "
            f"{PressureMap().slope:g}, expected that of {_named(leg)}, of slope {own.slope:g}: it "
            "would be inflated otherwise than the real one; give Physics(pressure_map="
            'pressure_map("hyperelastic")), which is in pneumorph.catalogue.paper_robot'
        )
    if masses is None:
        masses = masses_of(leg) if isinstance(leg, str) else Masses()
    module = paper_leg(leg, masses=masses) if isinstance(leg, str) else leg
    mounting = RadialMounting()
    sites = tuple(Site(mounting.pose(k), module) for k in range(mounting.location_count))
    return RobotSpec(paper_hub(masses), sites, physics, **rest)
