"""Make the files that a workshop needs to build a design.

STEP and STL of the mould's two halves (with registration pins, pour and vent holes), of the core
for the cavity and of the hub with its sockets and tube channels; the parts list with the silicone's
volume and mass; the tube plan; and an assembly drawing of this design.

Everything is checked: surfaces are watertight, the mould comes off without undercut, the cast
volume is that of the mesh within 0.5 %, and no wall is thinner than can be made.

Writes mould_upper, mould_lower, core, hub and leg (.step, .stl), parts.csv, tubes.csv, drawing.pdf.

Example: pneumorph fabricate 1.0.0.2.2.0.0.1 --out runs/robot
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.artefact import write_atomically
from pneumorph.command.run_folder import RunFolder, read_summary
from pneumorph.command.verb import Verb
from pneumorph.fabrication.hub import HubSettings, make_hub
from pneumorph.fabrication.leg_mould import MouldSettings, check_leg_mould, make_leg_mould
from pneumorph.fabrication.parts_list import (
    WorkshopSettings,
    parts_csv,
    parts_list,
    tube_plan,
    tubes_csv,
)
from pneumorph.fabrication.solid import FabricationError, surface_of, write_step, write_stl
from pneumorph.fabrication.wall_thickness import wall_thickness_mm
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.presets import paper_leg_mesh
from pneumorph.report.assembly_drawing import assembly_drawing
from pneumorph.report.style import save_figure
from pneumorph.robot.design import Design


@dataclass(frozen=True)
class FabricateOptions:
    """The design and how to make it."""

    design: tyro.conf.Positional[str] = tyro.MISSING
    """Design such as 1.0.0.2.2.0.0.1, or a coopt run's folder for its best one."""
    mesh: Path | None = None
    """Mesh of the simulated leg, to compare volumes with; by default the shipped one."""
    surface_size_mm: float = 8.0
    """Largest triangle of the STL files [mm]."""
    leg: PneuNetShape = field(default_factory=PneuNetShape)
    disk: DiskShape = field(default_factory=DiskShape)
    mounting: RadialMounting = field(default_factory=RadialMounting)
    mould: MouldSettings = field(default_factory=MouldSettings)
    hub: HubSettings = field(default_factory=HubSettings)
    workshop: WorkshopSettings = field(default_factory=WorkshopSettings)


def fabricate(options: FabricateOptions, folder: RunFolder) -> dict[str, Any]:
    """Make, check and write everything, and return volumes, masses and checks."""
    start = time.monotonic()
    design = _design(options)
    mesh = paper_leg_mesh() if options.mesh is None else Mesh.load(options.mesh)
    folder.progress.stage("making the mould")
    mould = make_leg_mould(options.leg, options.mould)
    checks = check_leg_mould(mould, options.leg, float(mesh.volumes.sum()))
    folder.progress.stage("making the hub")
    hub = make_hub(options.disk, options.leg, options.mounting, options.hub)
    solids = {
        "mould_upper": (mould.upper, options.mould.smallest_wall_mm),
        "mould_lower": (mould.lower, options.mould.smallest_wall_mm),
        "core": (mould.core, options.mould.smallest_wall_mm),
        "hub": (hub, options.hub.smallest_wall_mm),
        "leg": (mould.body + mould.plate, options.mould.smallest_silicone_mm),
    }
    folder.progress.stage("writing and checking surfaces")
    made = {}
    for number, (name, (solid, smallest)) in enumerate(solids.items(), start=1):
        made[name] = _written(name, solid, smallest, options.surface_size_mm, folder)
        folder.progress(number, len(solids), name)
    tubes = tube_plan(design, options.mounting, _channel_length_mm(options), options.workshop)
    parts = parts_list(
        design,
        options.leg,
        mould.cast_volume_mm3,
        made["hub"]["volume_mm3"],
        {n: made[n]["volume_mm3"] for n in ("mould_upper", "mould_lower", "core")},
        tubes,
        options.workshop,
    )
    write_atomically(folder / "parts.csv", lambda stream: stream.write(parts_csv(parts).encode()))
    write_atomically(folder / "tubes.csv", lambda stream: stream.write(tubes_csv(tubes).encode()))
    figure = assembly_drawing(design, parts, tubes, options.leg, options.disk, options.mounting)
    drawing = save_figure(figure, folder / "drawing.pdf", ("pdf", "png"))[0]
    silicone = parts[1]
    return {
        "design": str(design),
        "leg_count": design.leg_count,
        **checks,
        "watertight": True,
        "silicone_ml": silicone.volume_ml,
        "silicone_g": silicone.mass_g,
        "leg_mass_g": parts[0].mass_g,
        "solids": made,
        "drawing": str(drawing),
        "wall_s": time.monotonic() - start,
    }


def _design(options: FabricateOptions) -> Design:
    folder = Path(options.design)
    text = str(read_summary(folder)["best_design"]) if folder.is_dir() else options.design
    design = Design.parse(text)
    if design.location_count != options.mounting.location_count:
        raise ValueError(
            f"design {design} has {design.location_count} locations, expected "
            f"{options.mounting.location_count} as the hub has sockets"
        )
    if design.leg_count == 0:
        raise ValueError(f"design {design} has no legs, expected at least one")
    return design


def _written(
    name: str, solid: Any, smallest_mm: float, size_mm: float, folder: RunFolder
) -> dict[str, Any]:
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
    stl = write_stl(folder / f"{name}.stl", surface)
    return {
        "step": str(step),
        "stl": str(stl),
        "volume_mm3": float(sum(each.mass for each in solid.solids)),
        "surface_volume_mm3": surface.volume_mm3,
        "triangle_count": len(surface.triangles),
        "thinnest_wall_mm": thinnest if np.isfinite(thinnest) else None,
    }


def _channel_length_mm(options: FabricateOptions) -> float:
    """From a socket's face to the hub's middle along the pitched channel [mm]."""
    return options.mounting.hub_radius_mm / float(np.cos(np.radians(options.mounting.pitch_deg)))


VERB = Verb(FabricateOptions, fabricate)
