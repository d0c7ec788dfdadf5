"""Everything that a workshop needs to build a design: solids, parts and tubes, made and checked."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_atomically
from pneumorph.base.checked import Checked, Positive
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.masses import PRINTED_HUB, cast_leg_mass_kg
from pneumorph.catalogue.paper_leg import paper_leg_mesh
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fabrication.hub import HubSettings, make_hub
from pneumorph.fabrication.hub_stiffness import (
    HubCheckSettings,
    HubStiffness,
    hub_model,
    hub_stiffness,
)
from pneumorph.fabrication.leg_mould import (
    LegMould,
    MouldSettings,
    check_leg_mould,
    make_leg_mould,
)
from pneumorph.fabrication.parts_list import (
    MM3_PER_ML,
    Part,
    Printed,
    TubeRun,
    WorkshopSettings,
    parts_csv,
    parts_list,
    tube_plan,
    tubes_csv,
)
from pneumorph.fabrication.solid import FabricationError, surface_of, write_step
from pneumorph.fabrication.wall_thickness import wall_thickness_mm
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.surface import write_stl
from pneumorph.robot.design import Design

LARGEST_MASS_DIFFERENCE = 0.1
"""Share by which a simulated mass may differ from the built one without a warning."""


@dataclass(frozen=True)
class FabricationSettings(Checked):
    """Shapes of the parts, and how they are made."""

    mesh: Path | None = None
    """Mesh of the simulated leg, whose volume the casting is compared with; by default the one that
    ships."""
    surface_size_mm: Positive = 8.0
    """Largest edge of the triangles in the STL files [mm]."""
    leg: PneuNetShape = field(default_factory=PneuNetShape)
    disk: DiskShape = field(default_factory=DiskShape)
    mounting: RadialMounting = field(default_factory=RadialMounting)
    mould: MouldSettings = field(default_factory=MouldSettings)
    hub: HubSettings = field(default_factory=HubSettings)
    workshop: WorkshopSettings = field(default_factory=WorkshopSettings)
    check_hub: bool = False
    """Compute the hub's deflection with finite elements, about a minute."""
    hub_check: HubCheckSettings = field(default_factory=HubCheckSettings)


@dataclass(frozen=True)
class FabricatedSolid:
    """A solid to print or to mill: its files, volume and thinnest wall."""

    step: str
    stl: str
    volume_mm3: float
    surface_volume_mm3: float
    """Volume inside the triangles of the STL file [mm^3]."""
    triangle_count: int
    thinnest_wall_mm: float | None
    """Between triangles of the STL file, which cut across a curved wall: where edges of e go around
    a radius r by up to e^2 / (8 r) less than the solid's own wall. None where no wall has an
    opposite side."""


@dataclass(frozen=True)
class FabricatedRobot:
    """Volumes, masses and checks of what a design is built from."""

    design: str
    leg_count: int
    cast_volume_mm3: float
    mesh_volume_mm3: float
    cast_volume_error_percent: float
    undercut_mm3: dict[str, float]
    """Volume in the way when each part of the mould is taken off."""
    watertight: bool
    silicone_ml: float
    silicone_g: float
    leg_mass_g: float
    """Silicone and sheet of a leg as it is cast [g]."""
    solids: dict[str, FabricatedSolid]
    parts: tuple[Part, ...]
    tubes: tuple[TubeRun, ...]
    wall_s: float
    drawing: str | None = None
    """The assembly drawing, once it is drawn."""
    hub_mass_g: float | None = None
    """Mass of the hub as it is printed [g]."""
    simulated_leg_mass_g: float | None = None
    """Mass of a leg in the simulation [g]."""
    simulated_hub_mass_g: float | None = None
    """Mass of the hub in the simulation [g]."""
    mass_warning: str | None = None
    """What to do where built and simulated masses differ; None where they agree."""
    hub_stiffness: HubStiffness | None = None
    """How far the hub gives way; None where it was not computed."""


def fabricate(
    design: Design | str,
    settings: FabricationSettings,
    folder: RunFolder,
    robot: RobotSpec | None = None,
) -> FabricatedRobot:
    """Make, check and write mould, core, hub and leg, the parts list and the tube plan.

    Args:
        design: The design.
        settings: Shapes and how they are made.
        folder: Receives ``mould_upper``, ``mould_lower``, ``core``, ``hub`` and ``leg`` (.step,
            .stl), ``parts.csv`` and ``tubes.csv``.
        robot: The simulation whose masses stand beside those that are built; the paper's robot by
            default.

    Raises:
        ValueError: The design has no legs, or does not fit the hub's sockets.
        FabricationError: A wall is too thin, a surface not closed, or the mould does not come off.
    """
    start = time.monotonic()
    design = _fitting(design, settings.mounting)
    robot = robot or paper_robot()
    mesh = paper_leg_mesh() if settings.mesh is None else Mesh.load(settings.mesh)
    folder.progress.stage("making the mould")
    mould = make_leg_mould(settings.leg, settings.mould)
    checks = check_leg_mould(mould, settings.leg, float(mesh.volumes.sum()))
    folder.progress.stage("making the hub")
    hub = make_hub(settings.disk, settings.leg, settings.mounting, settings.hub)
    made = _made(mould, hub, settings, folder)
    tubes = tube_plan(
        design, settings.mounting, _channel_length_mm(settings.mounting), settings.workshop
    )
    printed = _printed(made["hub"].volume_mm3, settings.hub)
    parts = parts_list(
        design,
        settings.leg,
        mould.cast_volume_mm3,
        printed,
        {n: made[n].volume_mm3 for n in ("mould_upper", "mould_lower", "core")},
        tubes,
        settings.workshop,
    )
    write_atomically(folder / "parts.csv", lambda stream: stream.write(parts_csv(parts).encode()))
    write_atomically(folder / "tubes.csv", lambda stream: stream.write(tubes_csv(tubes).encode()))
    leg_mass_g = _known(parts[0].mass_g) + _known(parts[2].mass_g)
    simulated_leg_g, simulated_hub_g = 1e3 * robot.module.full.mass_kg, 1e3 * robot.hub.mass_kg
    warning = mass_warning(leg_mass_g, printed.mass_g, simulated_leg_g, simulated_hub_g)
    if warning is not None:
        folder.progress.say(warning)
    stiffness = None
    if settings.check_hub:
        folder.progress.stage("computing how far the hub gives way")
        mass_kg = 1e-3 * (printed.mass_g + design.leg_count * leg_mass_g)
        stiffness = hub_stiffness(
            hub_model(hub, 1e-3 * printed.mass_g, settings.hub_check),
            robot.module.full,
            settings.leg,
            settings.mounting,
            settings.hub_check.largest_force_mN(mass_kg),
        )
    return FabricatedRobot(
        design=str(design),
        leg_count=design.leg_count,
        **checks,
        watertight=True,  # surface_of raises otherwise
        silicone_ml=_known(parts[1].volume_ml),
        silicone_g=_known(parts[1].mass_g),
        leg_mass_g=leg_mass_g,
        solids=made,
        parts=tuple(parts),
        tubes=tuple(tubes),
        wall_s=time.monotonic() - start,
        hub_mass_g=printed.mass_g,
        simulated_leg_mass_g=simulated_leg_g,
        simulated_hub_mass_g=simulated_hub_g,
        mass_warning=warning,
        hub_stiffness=stiffness,
    )


def _made(
    mould: LegMould, hub: Any, settings: FabricationSettings, folder: RunFolder
) -> dict[str, FabricatedSolid]:
    """Every solid by name, written and checked."""
    folder.progress.stage("writing and checking surfaces")
    solids = {
        "mould_upper": (mould.upper, settings.mould.smallest_wall_mm),
        "mould_lower": (mould.lower, settings.mould.smallest_wall_mm),
        "core": (mould.core, settings.mould.smallest_wall_mm),
        "hub": (hub, settings.hub.smallest_wall_mm),
        "leg": (mould.body + mould.plate, settings.mould.smallest_silicone_mm),
    }
    made = {}
    for number, (name, (solid, smallest)) in enumerate(solids.items(), start=1):
        made[name] = _written(name, solid, smallest, settings.surface_size_mm, folder)
        folder.progress(number, len(solids), name)
    return made


def mass_warning(
    leg_g: float, hub_g: float, simulated_leg_g: float, simulated_hub_g: float
) -> str | None:
    """Say where built and simulated masses differ by more than a tenth, and what makes them agree.

    Args:
        leg_g: Mass of a leg as it is built [g].
        hub_g: Mass of the hub as it is built [g].
        simulated_leg_g: Mass of a leg in the simulation [g].
        simulated_hub_g: Mass of the hub in the simulation [g].
    """
    pairs = {"leg": (leg_g, simulated_leg_g), "hub": (hub_g, simulated_hub_g)}
    apart = {name: pair for name, pair in pairs.items() if _differ(*pair)}
    if not apart:
        return None
    masses = "; ".join(
        f"{name}: {built:.1f} g as built, {simulated:.1f} g in the simulation "
        f"({100.0 * (simulated / built - 1.0):+.0f} %)"
        for name, (built, simulated) in apart.items()
    )
    usual = (1e3 * cast_leg_mass_kg(paper_leg_mesh()), 1e3 * PRINTED_HUB.mass_kg)
    if not any(_differ(*each) for each in zip((leg_g, hub_g), usual, strict=True)):
        flags = "--masses.model cast"
    else:
        flags = " ".join(f"--masses.{name}-mass-g {pair[0]:.1f}" for name, pair in apart.items())
    return f"masses differ: {masses}; distances depend on them: simulate and learn with {flags}"


def _differ(built: float, simulated: float) -> bool:
    return abs(simulated / built - 1.0) > LARGEST_MASS_DIFFERENCE


def _printed(volume_mm3: float, settings: HubSettings) -> Printed:
    volume_ml = volume_mm3 / MM3_PER_ML
    detail = f"{settings.material}, walls of {settings.wall_mm:g} mm, open below"
    return Printed(detail, volume_ml, volume_ml * settings.density_g_per_ml)


def _known(value: float | None) -> float:
    assert value is not None  # legs and silicone are weighed
    return value


def _fitting(design: Design | str, mounting: RadialMounting) -> Design:
    design = Design.parse(str(design))
    if design.location_count != mounting.location_count:
        raise ValueError(
            f"design {design} has {design.location_count} locations, expected "
            f"{mounting.location_count} as the hub has sockets"
        )
    if design.leg_count == 0:
        raise ValueError(f"design {design} has no legs, expected at least one")
    return design


def _written(
    name: str, solid: Any, smallest_mm: float, size_mm: float, folder: RunFolder
) -> FabricatedSolid:
    """Write a solid and check its surface and its walls."""
    surface = surface_of(solid, size_mm)  # raises unless it is watertight
    thickness = wall_thickness_mm(surface)
    place = int(np.argmin(thickness))
    thinnest = float(thickness[place])
    if thinnest < smallest_mm - 1e-6:
        middle = surface.nodes[surface.triangles[place]].mean(axis=0)
        raise FabricationError(
            f"{name} has a wall of {thinnest:.2f} mm at ({', '.join(f'{v:.1f}' for v in middle)}) "
            f"mm, expected {smallest_mm:g} mm or more"
        )
    step = write_step(folder / f"{name}.step", solid)
    stl = write_stl(folder / f"{name}.stl", surface.nodes, surface.triangles)
    return FabricatedSolid(
        step=str(step),
        stl=str(stl),
        volume_mm3=float(sum(each.mass for each in solid.solids)),
        surface_volume_mm3=surface.volume_mm3,
        triangle_count=len(surface.triangles),
        thinnest_wall_mm=thinnest if np.isfinite(thinnest) else None,
    )


def _channel_length_mm(mounting: RadialMounting) -> float:
    """From a socket's face to the hub's middle along the pitched channel [mm]."""
    return mounting.hub_radius_mm / float(np.cos(np.radians(mounting.pitch_deg)))
