"""The robot of the paper, ready to use: meshes and the reduced leg that ship with the package.

Everything below this file is general; here the numbers of one robot come together.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from pneumorph.fem.floor import Floor
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.material import DiskMaterials, LegMaterials, Material
from pneumorph.fem.part_model import PartModel, disk_model, leg_model
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Hub, Robot, hub_of_mesh, robot_builder
from pneumorph.simulation.simulation_settings import SimulationSettings

LegName = Literal["paper", "hyperelastic"]
"""The published leg, or one of the silicone's own stiffness."""

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
def load_default_leg(name: LegName = "paper") -> ReducedPart:
    """A reduced leg that ships; made by ``pneumorph reduce --preset NAME``.

    Raises:
        ValueError: No such leg.
        FileNotFoundError: Its reduction does not ship.
    """
    try:
        path = data_file(f"leg_{_known_leg(name)}.npz")
    except FileNotFoundError as error:
        raise FileNotFoundError(
            f"no reduction of the {name} leg ships; make one with pneumorph reduce --preset {name} "
            "and give it as --part, or simulate finite elements with --model full"
        ) from error
    return ReducedPart.load(path)


@cache
def paper_hub() -> Hub:
    """The disk as a rigid hub; its rim may touch the floor, the centre of its top is rewarded."""
    mesh = paper_disk_mesh()
    return hub_of_mesh(
        mesh, DISK_MASS_KG, np.array(DiskShape().top_centre_mm), disk_rim_points(mesh)
    )


def disk_rim_points(mesh: Mesh) -> np.ndarray:
    """Nodes on the two rims of a disk [mm], (point, 3): its corners, all that a floor can meet."""
    points = []
    for name in ("bottom", "top"):
        face = mesh.nodes[mesh.node_sets[name]]
        radius = np.hypot(face[:, 0], face[:, 1])
        points.append(face[radius > radius.max() - 1e-6])
    return np.concatenate(points)


def paper_robot_builder(part: ReducedPart | None = None) -> Callable[[Design], Robot]:
    """Turns designs of the paper's space into reduced robots.

    Args:
        part: The reduced leg; None for the one that ships.
    """
    mounting = RadialMounting()
    poses = [mounting.pose(location) for location in range(mounting.location_count)]
    return robot_builder(part if part is not None else load_default_leg(), paper_hub(), poses)


HYPERELASTIC_MATERIALS = LegMaterials(
    silicone=Material(600.0, 0.45, "stable_neo_hookean"),
    paper=Material(1200.0, 0.49, "stable_neo_hookean"),
)
"""A leg as its silicone's data sheet has it, the paper layer twice as stiff."""

HYPERELASTIC_PRESSURE_MAP = PressureMap(1.247, -4.404)
"""Makes the hyperelastic leg bend as the published pairs say the real one does, to 2 kPa; made by
reproduce/actuator_bend."""


@cache
def hyperelastic_leg_mesh() -> Mesh:
    """Mesh of quadratic tetrahedra that ships.

    Made by ``pneumorph mesh leg --quadratic --leg-mesher.size-mm 6 --leg-mesher.grading 0.9``.
    """
    return Mesh.load(data_file("leg_mesh_quadratic.npz"))


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


def full_leg(
    name: LegName, mesh: Mesh | None = None, materials: LegMaterials | None = None
) -> PartModel:
    """Finite elements of a leg.

    Args:
        name: Which elements and materials.
        mesh: Its mesh; None for the one that ships.
        materials: What it is made of; None for what the name says.

    Raises:
        ValueError: No such leg.
    """
    shipped = hyperelastic_leg_mesh if _known_leg(name) == "hyperelastic" else paper_leg_mesh
    return leg_model(mesh or shipped(), materials or leg_materials(name))


@cache
def paper_leg_model() -> PartModel:
    """Finite elements of the leg that ships, with the paper's materials."""
    return full_leg("paper")


def paper_full_robot(
    design: Design,
    settings: SimulationSettings | None = None,
    hub: Literal["soft", "rigid"] = "soft",
    leg: PartModel | None = None,
    floor: Floor | None = None,
    disk_materials: DiskMaterials | None = None,
    **numerics: Any,
) -> FullRobot:
    """Finite elements of a whole robot: the one that a reduced robot of this design stands for.

    Args:
        design: The design; its regulators must exist in the settings.
        settings: Physics of the reduced robot; numerics are the full model's own.
        hub: The disk as finite elements, or a rigid one.
        leg: Finite elements of a leg; None for the one that ships.
        floor: What the robot stands on; None for a plane or `numerics`' height map.
        disk_materials: What the disk is made of; None for the paper's.
        **numerics: Other fields of FullOrderSettings, such as ``friction_solver``.

    Raises:
        ValueError: No such hub.
    """
    if hub not in ("soft", "rigid"):
        raise ValueError(f'hub must be "soft" or "rigid", got {hub!r}')
    settings = settings or SimulationSettings()
    disk_materials = disk_materials or DiskMaterials(mass_kg=DISK_MASS_KG)
    disk = paper_disk_mesh()
    rim = disk_rim_points(disk)
    mounting = RadialMounting()
    leg = leg or paper_leg_model()
    return FullRobot(
        SoftHub(disk_model(disk, disk_materials), rim)
        if hub == "soft"
        else RigidHub(disk, disk_materials.mass_kg, rim),
        [(leg, mounting.pose(location), regulator - 1) for location, regulator in design.legs],
        FullOrderSettings(
            time_step_s=settings.time_step_s,
            damping=settings.damping,
            mass_damping_per_s=settings.mass_damping_per_s,
            stiffness_damping_s=settings.stiffness_damping_s,
            gravity_mm_per_s2=settings.gravity_mm_per_s2,
            floor_slope_deg=settings.floor_slope_deg,
            friction=settings.friction,
            floor_height_mm=settings.floor_height_mm,
            regulator_count=settings.regulator_count,
            pressure_rate_kPa_per_s=settings.pressure_rate_kPa_per_s,
            pressure_map=settings.pressure_map,
            **numerics,
        ),
        tracked_point=np.array(DiskShape().top_centre_mm),
        floor=floor,
    )
