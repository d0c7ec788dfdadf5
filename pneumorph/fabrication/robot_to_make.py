"""What there is to make of a design: its kinds of legs, its hub, and where each leg sits.

`paper_robot_to_make` is the paper's hub with a socket at every place, whatever its sizes;
`described_robot_to_make` is what a robot's file has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from pneumorph.catalogue.description_notes import excluding_sites
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fabrication.described_hub import make_described_hub
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.hub import make_hub
from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.leg_place import end_face_mm, leg_pose
from pneumorph.fem.silicones import silicone_of
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import enclosed_centre
from pneumorph.robot.design import Design

_AROUND = 96
"""Points of a circle that is drawn."""


@dataclass(frozen=True, eq=False)
class LegToMake:
    """A kind of leg of a design.

    Attributes:
        name: What its files begin with; empty where there is one kind and no need of a name.
        shape: Its sizes; None of a part that is known by its mesh alone, which has no mould.
        mesh: Mesh of the simulated leg.
        simulated_mass_g: Mass of the simulated leg [g].
        count: How many of it the design has.
        silicone: What the simulated leg is of, by the supplier's name; None where nobody knows.
    """

    name: str
    shape: PneuNetShape | None
    mesh: Mesh
    simulated_mass_g: float
    count: int
    silicone: str | None = None

    @cached_property
    def chambers_leftwards_mm(self) -> np.ndarray:
        """How far left of the leg's middle plane each chamber's middle is [mm], (chamber,)."""
        regions = [self.mesh.surfaces[name] for name in cavity_regions(self.mesh)]
        return np.array([enclosed_centre(self.mesh.nodes, region)[1] for region in regions])

    @cached_property
    def chamber_names(self) -> tuple[str, ...]:
        """What each chamber is called on paper: left or right where two lie beside each other,
        otherwise as in the mesh; empty of the only one."""
        names, left_mm = cavity_regions(self.mesh), self.chambers_leftwards_mm
        if len(names) == 1:
            return ("",)
        if len(names) == 2 and left_mm.min() < 0.0 < left_mm.max():
            return tuple("left" if each > 0.0 else "right" for each in left_mm)
        return tuple(names)


@dataclass(frozen=True, eq=False)
class Seat:
    """A place for a leg.

    Attributes:
        location: Its number, from 0.
        pose: The leg's frame in the robot's.
        face_mm: Middle of the face by which it is held, in the robot's frame [mm], (3,).
        leg: What sits there, of the kinds of legs; None where it is free.
        regulators: The regulator of each chamber, from 1; empty where it is free.
        name: What its site is called; empty for its number.
        tube_mm: Length of a tube from the leg's face to the hub's middle [mm].
    """

    location: int
    pose: Pose
    face_mm: np.ndarray
    leg: LegToMake | None
    regulators: tuple[int, ...]
    tube_mm: float
    name: str = ""

    @property
    def direction_deg(self) -> float:
        """Where it points, counter-clockwise from forward [degrees], 0 to 360."""
        return self.pose.yaw_deg

    @property
    def roll_deg(self) -> float:
        """How far it is rolled about its length, its left side up [degrees]."""
        return self.pose.roll_deg


@dataclass(frozen=True)
class Payload:
    """What a hub carries.

    Attributes:
        mass_g: Its mass [g].
        place_mm: Where it lies, in the robot's frame [mm].
    """

    mass_g: float
    place_mm: tuple[float, float, float]

    @property
    def told(self) -> str:
        """In a few words, for a drawing and a list."""
        return f"{self.mass_g:g} g at {', '.join(f'{each:g}' for each in self.place_mm)} mm"


@dataclass(frozen=True, eq=False)
class HubToMake:
    """The hub of a robot.

    Attributes:
        make: Makes it as an OpenCASCADE solid; None of a hub that is a mesh.
        mesh: The mesh of such a hub.
        density_g_per_ml: Of what it is made of.
        detail: What it is made of and how, for the parts list.
        simulated_mass_g: Mass of the simulated hub, without a payload [g].
        outline_mm: Points whose convex hull is its outline from each side [mm], (point, 3).
        width_mm: Its size from back to front, a disk's diameter [mm].
        round: Whether it is a disk.
        hollow: Whether it has walls that its file says.
        walls_ml: Volume of the walls that a mesh is printed with [ml]; None of one that is solid.
        payload: What it carries; None for nothing.
        well_radius_mm: Radius of the well in its middle [mm]; 0 for none.
    """

    make: Callable[[], Any] | None
    mesh: Mesh | None
    density_g_per_ml: float
    detail: str
    simulated_mass_g: float
    outline_mm: np.ndarray
    width_mm: float
    round: bool = False
    well_radius_mm: float = 0.0
    hollow: bool = False
    walls_ml: float | None = None
    payload: Payload | None = None

    @cached_property
    def solid(self) -> Any | None:
        """The hub as an OpenCASCADE solid, made once; None of one that is a mesh."""
        return None if self.make is None else self.make()


@dataclass(frozen=True, eq=False)
class RobotToMake:
    """A design as a workshop sees it.

    Attributes:
        design: The design.
        seats: Its places, free ones as well.
        legs: Its kinds of legs.
        hub: Its hub.
        name: What it is called.
        file: The robot's file; None for the paper's robot.
    """

    design: Design
    seats: tuple[Seat, ...]
    legs: tuple[LegToMake, ...]
    hub: HubToMake
    name: str = "crawling robot"
    file: str | None = None


def paper_robot_to_make(
    design: Design | str, settings: FabricationSettings, robot: RobotSpec
) -> RobotToMake:
    """The paper's robot: one kind of leg, and a hub with a socket at every place.

    Args:
        design: The design.
        settings: Sizes.
        robot: The simulation whose masses stand beside those that are built.

    Raises:
        ValueError: The design has no legs, or is of another number of places than the robot; or the
            mounting is.
    """
    mounting, site_count = settings.mounting, len(robot.sites)
    if mounting.location_count != site_count:
        raise ValueError(
            f"mounting.location_count is {mounting.location_count}, expected {site_count} as the "
            "simulated robot has sites: leave it out, or describe a robot with another number of "
            "sites in a file of its own (--robot)"
        )
    design = _with_legs(design)
    if design.location_count != site_count:
        raise ValueError(
            f"design {design} has {design.location_count} locations, expected {site_count} as the "
            "hub has sockets"
        )
    mesh = paper_leg_mesh() if settings.mesh is None else load_leg_mesh(settings.mesh)
    _check_chambers(settings.leg, mesh)
    mass_g = 1e3 * robot.module.full.mass_kg
    rubber = silicone_of(robot.module.full.material)
    leg = LegToMake("", settings.leg, mesh, mass_g, design.leg_count, rubber)
    regulators = _of_chambers(design, robot)
    poses = [leg_pose(settings.leg, mounting, k) for k in range(mounting.location_count)]
    seats = tuple(
        Seat(
            location,
            pose,
            pose.apply(end_face_mm(settings.leg)),
            leg if location in regulators else None,
            regulators.get(location, ()),
            _channel_length_mm(mounting),
        )
        for location, pose in enumerate(poses)
    )
    disk = settings.disk
    hub = HubToMake(
        partial(make_hub, disk, settings.leg, mounting, settings.hub),
        None,
        settings.hub.density_g_per_ml,
        f"{settings.hub.material}, walls of {settings.hub.wall_mm:g} mm, open below",
        1e3 * robot.hub.mass_kg,
        _cone_outline(
            disk.bottom_radius_mm, disk.top_radius_mm, disk.bottom_mm, disk.height_mm
        ),
        2.0 * max(disk.bottom_radius_mm, disk.top_radius_mm),
        True,
        settings.hub.well_radius_mm,
    )  # fmt: skip
    return RobotToMake(design, seats, (leg,), hub)


def described_robot_to_make(
    design: Design | str,
    description: RobotDescription,
    robot: RobotSpec,
    settings: FabricationSettings,
) -> RobotToMake:
    """A robot of a file: the kinds of legs that the design has, and sockets where they sit.

    Args:
        design: The design.
        description: The robot's file.
        robot: What it says.
        settings: Walls of sockets and holes.

    Raises:
        ValueError: The design has no legs, is of another number of sites, or breaks an exclusion;
            or the hub is to be checked, or sizes are given that the file has, or settings of the
            hub that would be ignored.
    """
    if settings.check_hub:
        raise ValueError(
            "check_hub is given beside a robot's file, expected one of them: only the paper's hub "
            "is checked as finite elements"
        )
    usual = FabricationSettings()
    for name in ("leg", "disk", "mounting"):
        if getattr(settings, name) != getattr(usual, name):
            raise ValueError(
                f"{name} is given beside a robot's file, expected the file's own sizes alone: "
                "change them there, for what is built is what is simulated"
            )
    for name, why in _ignored_of_hub(description.hub, settings.hub).items():
        if getattr(settings.hub, name) != getattr(usual.hub, name):
            raise ValueError(
                f"hub.{name} is given beside a robot's file, expected to be left out, for {why}: "
                "it would be ignored"
            )
    design = _with_legs(design)
    if design.location_count != len(robot.sites):
        raise ValueError(
            f"design {design} has {design.location_count} locations, expected "
            f"{len(robot.sites)}: one for each site of {description.name}"
        )
    if (names := excluding_sites(description, design)) is not None:
        raise ValueError(
            f"design {design} has legs at {names}, of which designs.exclusions allows one at most: "
            "they may be in the same place; take one of them away, or the exclusion where both fit"
        )
    hub_mesh = robot.hub.mesh
    middle = 0.5 * (hub_mesh.nodes.min(axis=0) + hub_mesh.nodes.max(axis=0))
    regulators = _of_chambers(design, robot)
    mounted: dict[int, Module] = {
        fitting.location: robot.sites[fitting.location].modules[fitting.module]
        for fitting in design.fittings
    }
    legs = {
        module: LegToMake(
            module.name,
            module.shape,
            module.full.mesh,
            1e3 * module.full.mass_kg,
            sum(each is module for each in mounted.values()),
            silicone_of(module.full.material),
        )
        for module in dict.fromkeys(mounted.values())
    }
    seats, top_mm = [], float(hub_mesh.nodes[:, 2].max())
    for location, site in enumerate(robot.sites):
        if location not in mounted:
            place = site.pose if site.face is None else site.pose.compose(site.face)
            seats.append(Seat(location, place, place.translation, None, (), 0.0, site.name))
            continue
        module = mounted[location]
        pose, face = site.pose_of(module), module.face
        at = pose.translation if face is None else pose.compose(face).translation
        # Inwards, up through the hub, and over it to the middle.
        length = float(np.linalg.norm(at[:2] - middle[:2])) + max(top_mm - float(at[2]), 0.0)
        of_chambers = regulators[location]
        seats.append(Seat(location, pose, at, legs[module], of_chambers, length, site.name))
    hub = replace(
        _described_hub(description.hub, robot, seats, settings),
        payload=_payload(description.hub, robot),
    )
    file = None if description.file is None else str(description.file)
    return RobotToMake(design, tuple(seats), tuple(legs.values()), hub, description.name, file)


def _ignored_of_hub(hub: HubDescription, settings: HubSettings) -> dict[str, str]:
    """The settings that say nothing of a hub of a file, and why."""
    ignored = {"material": "the parts list tells the density of such a hub, and no name"}
    if hub.density_g_per_ml is not None:
        ignored["density_g_per_ml"] = "the file has its own"
    if hub.shape == "mesh":
        of_sockets = {each.name for each in fields(settings)} - {"density_g_per_ml", "material"}
        return ignored | dict.fromkeys(sorted(of_sockets), "its hub is a mesh without sockets")
    names = ["ribs_per_site", "rib_spread_mm", "well_radius_mm"]
    # Thinner ribs than can be printed are refused even where there are none.
    if settings.smallest_wall_mm <= HubSettings().rib_mm:
        names.append("rib_mm")
    return ignored | dict.fromkeys(names, "only the paper's hub has ribs and a well")


def _payload(hub: HubDescription, robot: RobotSpec) -> Payload | None:
    if hub.payload_g == 0.0:
        return None
    x, y, z = hub.payload_place_mm(robot.hub.mesh)
    return Payload(hub.payload_g, (x, y, z))


def _described_hub(
    hub: HubDescription, robot: RobotSpec, seats: Sequence[Seat], settings: FabricationSettings
) -> HubToMake:
    in_sockets = [
        (seat.leg.shape, seat.pose)
        for seat in seats
        if seat.leg is not None and seat.leg.shape is not None
    ]
    simulated_g = 1e3 * robot.hub.mass_kg - hub.payload_g
    # Of a hub whose mass alone the file says, the material is that which is printed with.
    density = hub.density_g_per_ml or settings.hub.density_g_per_ml
    made_of = f" of {density:g} g/ml"
    walls = "solid" if hub.wall_mm is None else f"hollow, walls of {hub.wall_mm:g} mm"
    if hub.shape == "mesh":
        mesh, hollow = robot.hub.mesh, hub.wall_mm is not None
        # Its walls are the slicer's to make: the file is of the outside.
        printed = f", printed {walls} without filling" if hollow else ""
        return HubToMake(
            None,
            mesh,
            density,
            f"as its mesh has it{made_of}{printed}, without sockets",
            simulated_g,
            mesh.nodes,
            float(np.ptp(mesh.nodes[:, 0])),
            hollow=hollow,
            walls_ml=hub.material_ml(mesh) if hollow else None,
        )
    sockets = f"{len(in_sockets)} sockets"
    wide = hub.length_mm or 2.0 * max(hub.radius_mm or 0.0, hub.top_radius_mm or 0.0)
    return HubToMake(
        partial(make_described_hub, hub, in_sockets, settings.hub),
        None,
        density,
        f"{hub.shape}{made_of}, {walls}, {sockets}",
        simulated_g,
        robot.hub.mesh.nodes,
        wide,
        hub.shape == "disk",
        hollow=hub.wall_mm is not None,
    )


def _with_legs(design: Design | str) -> Design:
    design = Design.parse(str(design))
    if design.leg_count == 0:
        raise ValueError(f"design {design} has no legs, expected at least one")
    return design


def _of_chambers(design: Design, robot: RobotSpec) -> dict[int, tuple[int, ...]]:
    """The regulator of each chamber of the leg at each location.

    Raises:
        ValueError: The robot has no such leg, chamber or regulator.
    """
    design.check_regulators(robot.physics.regulator_count)
    found = {}
    for fitting in design.fittings:
        place, site = fitting.location, robot.sites[fitting.location]
        where = f"{place} ({site.name})" if site.name else place
        if fitting.module >= len(site.modules):
            raise ValueError(
                f"design {design} has a leg of kind {fitting.module + 1} at site {where}, expected "
                f"one of {', '.join(module.name for module in site.modules)}"
            )
        module = site.modules[fitting.module]
        found[place] = module.driven_by(fitting.regulators, f"design {design}", where)
    return found


def _check_chambers(shape: PneuNetShape, mesh: Mesh) -> None:
    """Refuse a mould of a leg with another number of chambers than the simulated one: their volumes
    may be within what the mould's check allows.

    Raises:
        ValueError: It is of another number.
    """
    own, simulated = 2 if shape.middle_wall_mm > 0.0 else 1, len(cavity_regions(mesh))
    if own != simulated:
        raise ValueError(
            f"the leg to cast has {own} chamber{'s' * (own > 1)} and the simulated mesh "
            f"{simulated}, expected as many: say the sizes of the leg (such as "
            "--leg.middle-wall-mm), as it was meshed with"
        )


def _channel_length_mm(mounting: RadialMounting) -> float:
    """From a socket's face to the hub's middle along the pitched channel [mm]."""
    return mounting.hub_radius_mm / float(np.cos(np.radians(mounting.pitch_deg)))


def _cone_outline(
    bottom_radius_mm: float, top_radius_mm: float, bottom_mm: float, height_mm: float
) -> np.ndarray:
    """Points of the rims of a disk [mm], (point, 3)."""
    angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_AROUND)])
    rims = [
        (bottom_radius_mm, bottom_mm),
        (top_radius_mm, bottom_mm + height_mm),
    ]
    return np.concatenate([radius * circle + [0.0, 0.0, height] for radius, height in rims])
