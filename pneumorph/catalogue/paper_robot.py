"""The robot of the paper, ready to use: meshes and the reduced legs that ship with the package.

Everything that this file imports is general; here the numbers of one robot come together.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, get_args

import numpy as np

from pneumorph.catalogue.density_check import IN_GRAMS, WEIGHED_G_PER_ML, check_density
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, masses_of, pressure_map
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import PRINTED_HUB, Masses
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.catalogue.site import Site
from pneumorph.fem.material import Material
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.surfaces import (
    HUB_SURFACE,
    PRINTED_PLASTIC,
    SHEET_SURFACE,
    SILICONE,
    SILICONE_OVER_SHEET,
    SKIN_SURFACE,
)

DISK_MATERIAL = Material(5000.0, 0.3)
"""What the disk is made of."""
DISK_MASS_KG = 0.075
"""Mass of the disk in the simulation: 2.5 times the real one's [kg]."""

SURFACES = {
    SHEET_SURFACE: SILICONE_OVER_SHEET,
    SKIN_SURFACE: SILICONE,
    HUB_SURFACE: PRINTED_PLASTIC,
}
"""What is known of the friction of a leg's underside, of all else of it, and of the disk."""


@cache
def paper_disk_mesh() -> Mesh:
    """Mesh of the disk that ships; made by ``pneumorph mesh disk``."""
    return Mesh.load(data_file("disk_mesh.npz"))


def disk_rim_points(mesh: Mesh) -> np.ndarray:
    """Nodes on the two rims of a disk [mm], (point, 3): its corners, all that a floor can meet."""
    points = []
    for name in ("bottom", "top"):
        face = mesh.nodes[mesh.node_sets[name]]
        radius = np.hypot(face[:, 0], face[:, 1])
        points.append(face[radius > radius.max() - 1e-6])
    return np.concatenate(points)


@cache
def paper_hub(masses: Masses | None = None) -> HubSpec:
    """The disk; its rims may touch the floor, the centre of its top is rewarded.

    Args:
        masses: What it weighs; None for the published mass.
    """
    masses, mesh = masses or Masses(), paper_disk_mesh()
    hub = HubSpec(
        mesh,
        DISK_MATERIAL,
        PRINTED_HUB if masses.model == "cast" else DISK_MASS_KG,
        np.array(DiskShape().top_centre_mm),
        disk_rim_points(mesh),
        HUB_SURFACE,
    )
    if masses.hub_mass_g is None:
        return hub
    mass, volume = 1e-3 * masses.hub_mass_g, float(mesh.volumes.sum())
    check_density("the disk of masses.hub_mass_g", mass, volume, WEIGHED_G_PER_ML, IN_GRAMS)
    return hub.weighing(mass)


PAPER_FACE = Pose(np.eye(3), np.array([-52.0, 0.0, 12.0]))
"""The attachment face of the paper's leg, the end of its first tooth, in the leg's frame."""


def ring_of_sites(mounting: RadialMounting, modules: tuple[Module, ...]) -> tuple[Site, ...]:
    """Sites around a disk; a module's attachment face comes where that of the paper's leg is, and
    legs go outwards.

    Args:
        mounting: How many and where.
        modules: Allowed at each.
    """
    face = Pose(np.eye(3), np.array([-mounting.half_tooth_length_mm, *PAPER_FACE.translation[1:]]))
    return tuple(
        Site(mounting.pose(k), modules, face, str(k), outwards=True)
        for k in range(mounting.location_count)
    )


def _named(leg: LegName | Module) -> str:
    return f"the {leg} leg" if isinstance(leg, str) else leg.name


def paper_robot(
    leg: LegName | Module = "measured",
    physics: Physics | None = None,
    masses: Masses | None = None,
    **rest: Any,
) -> RobotSpec:
    """The robot of the paper: a disk with eight places for legs, which point outwards along their x
    axes whatever face of theirs is attached.

    Args:
        leg: A leg that ships, or a module of your own for every place. By default the robot is as
            its materials were measured; ``"published"`` is as the paper simulated it.
        physics: What acts on the robot, with the leg's own map of real to simulated pressure; None
            for those of the leg's name. A module has those of the leg whose map of pressures it
            has, such as the measured one's, 1:1, with `Air.chamber_growth`; of none, those of the
            published leg with its own map.
        masses: What the hub weighs, and a leg that ships; None for what is the leg's own: published
            masses or, of legs of the silicone's own stiffness, those that are cast and printed. A
            module of your own has its own mass.
        **rest: Other fields of `RobotSpec`, such as ``thread_count``; the hub's model and the
            finite elements' numerics are those of the leg where they are not given.

    Raises:
        TypeError: The leg is neither a name nor a module.
        ValueError: No such leg, or physics with the published leg's pressure map for another leg.
    """
    if isinstance(leg, str):
        kind = leg
    elif isinstance(leg, Module):
        names = [each for each in get_args(LegName) if pressure_map(each) == leg.pressure_map]
        kind = names[0] if names else "published"
    else:
        names = ", ".join(get_args(LegName))
        raise TypeError(f"leg is {leg!r:.60}, expected a Module, or the name of a leg: {names}")
    about = leg_kind(kind)
    own = about.physics
    if isinstance(leg, Module):
        own = replace(own, pressure_map=leg.pressure_map or PressureMap())
    rest = {"hub_model": about.hub_model, "full_order": about.full_order, **rest}
    if physics is None:
        physics = own
    elif physics.pressure_map == PressureMap() != own.pressure_map:
        names = [each for each in get_args(LegName) if pressure_map(each) == own.pressure_map]
        asked = (
            f'leg_kind("{names[0]}").physics'
            if names
            else f"Physics(pressure_map={own.pressure_map})"
        )
        raise ValueError(
            "physics.pressure_map is the published leg's, of slope "
            f"{PressureMap().slope:g}, expected that of {_named(leg)}, of slope "
            f"{own.pressure_map.slope:g}: it would be inflated otherwise than the real one; change "
            f"{asked} by dataclasses.replace (of pneumorph.catalogue.leg_kinds), or ask for "
            'paper_robot("published")'
        )
    if masses is None:
        masses = masses_of(kind)
    module = module_of_leg(leg, masses=masses) if isinstance(leg, str) else leg
    mounting = RadialMounting()
    sites = ring_of_sites(mounting, (module,))
    return RobotSpec(paper_hub(masses), sites, physics, **rest)
