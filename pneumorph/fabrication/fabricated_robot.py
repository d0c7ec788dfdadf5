"""Everything that a workshop needs to build a design: solids, parts and tubes, made and checked."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import write_text
from pneumorph.base.run_folder import SUMMARY, RunFolder, read_summary
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fabrication.fabricated_solid import (
    FabricatedSolid,
    made_solids,
    skin_of,
    write_skin,
)
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.file_names import OF_A_MOULD, file_name, file_names, on_paper
from pneumorph.fabrication.hub_stiffness import HubStiffness, hub_model, hub_stiffness
from pneumorph.fabrication.leg_mould import (
    MouldSettings,
    check_leg_mould,
    check_leg_sizes,
    make_leg_mould,
)
from pneumorph.fabrication.mass_warning import mass_warning
from pneumorph.fabrication.parts_list import (
    MM3_PER_ML,
    LegMaterial,
    Part,
    Printed,
    parts_csv,
    parts_list,
)
from pneumorph.fabrication.robot_to_make import LegToMake, RobotToMake
from pneumorph.fabrication.solid import FabricationError
from pneumorph.fabrication.tube_plan import TubeRun, tube_plan, tubes_csv
from pneumorph.fabrication.workshop_settings import WorkshopSettings
from pneumorph.geometry.surface import surface_area


@dataclass(frozen=True)
class FabricatedLeg:
    """A kind of leg that a design is built from."""

    name: str
    """Empty where there is one kind."""
    count: int
    """How many of it the design has."""
    cast_volume_mm3: float
    """Silicone of one: what its mould holds, or its mesh where it has none [mm^3]."""
    mesh_volume_mm3: float
    """Volume of the simulated leg [mm^3]."""
    undercut_mm3: dict[str, float] | None
    """Volume in the way when each part of the mould is taken off; None without a mould."""
    mass_g: float
    """Silicone and sheet of one as it is cast [g]."""
    simulated_mass_g: float
    """Mass in the simulation [g]."""

    @property
    def said(self) -> str:
        """Its masses, for a person."""
        return (
            f"{self.count} x {self.name}: {self.mass_g:.1f} g as built, "
            f"{self.simulated_mass_g:.1f} g in the simulation"
        )

    @property
    def cast_error_percent(self) -> float:
        """How much more is cast than is simulated [%]."""
        # Of the same boxes; what is left is of sums.
        return round(100.0 * (self.cast_volume_mm3 / self.mesh_volume_mm3 - 1.0), 9)


@dataclass(frozen=True)
class FabricatedRobot:
    """Volumes, masses and checks of what a design is built from. What is of a leg is of its one
    kind, and None of several; `legs` has all of them."""

    design: str
    leg_count: int
    cast_volume_mm3: float | None
    mesh_volume_mm3: float | None
    cast_volume_error_percent: float | None
    undercut_mm3: dict[str, float]
    """Volume in the way when each part of the mould is taken off; empty of several kinds."""
    watertight: bool
    silicone_ml: float
    silicone_g: float
    leg_mass_g: float | None
    """Silicone and sheet of a leg as it is cast [g]."""
    solids: dict[str, FabricatedSolid]
    parts: tuple[Part, ...]
    tubes: tuple[TubeRun, ...]
    wall_s: float
    drawing: str | None = None
    """The assembly drawing, once it is drawn."""
    hub_mass_g: float | None = None
    """Mass of the hub as it is printed [g]; None in files of earlier versions where its density was
    not known."""
    simulated_leg_mass_g: float | None = None
    """Mass of a leg in the simulation [g]."""
    simulated_hub_mass_g: float | None = None
    """Mass of the hub in the simulation [g]."""
    mass_warning: str | None = None
    """What to do where built and simulated masses differ; None where they agree."""
    hub_stiffness: HubStiffness | None = None
    """How far the hub gives way; None where it was not computed."""
    legs: tuple[FabricatedLeg, ...] = ()
    """The kinds of legs of the design."""
    notes: tuple[str, ...] = ()
    """Volumes and masses of each kind, where there are several."""


def fabricate(
    robot: RobotToMake, settings: FabricationSettings, folder: RunFolder
) -> FabricatedRobot:
    """Make, check and write moulds, cores, hub and legs, the parts list and the tube plan.

    Args:
        robot: What there is to make: `paper_robot_to_make`, `described_robot_to_make`.
        settings: How it is made.
        folder: Receives ``mould_upper``, ``mould_lower``, ``core``, ``leg`` of each kind of leg,
            after its name and ``_`` where it has one (see `file_names`), and ``hub`` (.step, .stl),
            ``parts.csv`` and ``tubes.csv``.

    Raises:
        FabricationError: A wall is too thin, a surface not closed, or the mould does not come off.
    """
    start = time.monotonic()
    refuse_thin_fins(robot.legs, settings.mould)
    folder.progress.stage("making moulds and hub")
    solids, checks = _of_legs(robot.legs, settings)
    if robot.hub.solid is not None:
        solids["hub"] = robot.hub.solid, settings.hub.smallest_wall_mm
    names = file_names([leg.name for leg in robot.legs])
    meshes = {
        file_name(names[leg.name], "leg"): leg.mesh for leg in robot.legs if leg.shape is None
    }
    if robot.hub.mesh is not None:
        meshes["hub"] = robot.hub.mesh
    skins = {name: skin_of(name, mesh) for name, mesh in meshes.items()}
    made = made_solids(solids, settings, folder)
    made |= {name: write_skin(name, skin, folder) for name, skin in skins.items()}
    volume_ml = robot.hub.walls_ml
    if volume_ml is None:
        volume_ml = made["hub"].volume_mm3 / MM3_PER_ML
    printed = Printed(robot.hub.detail, volume_ml, volume_ml * robot.hub.density_g_per_ml)
    materials = [
        _material(leg, checks[leg.name]["cast_volume_mm3"], settings.workshop) for leg in robot.legs
    ]
    tubes = tube_plan(robot.seats, settings.workshop)
    moulds = {
        on_paper(name, names): solid.volume_mm3
        for name, solid in made.items()
        if name.endswith(OF_A_MOULD)
    }
    parts = parts_list(materials, printed, moulds, tubes, settings.workshop, robot.hub.payload)
    write_text(folder / "parts.csv", parts_csv(parts))
    write_text(folder / "tubes.csv", tubes_csv(tubes))
    _remove_earlier(made, folder)
    legs = tuple(
        FabricatedLeg(
            leg.name,
            leg.count,
            checks[leg.name]["cast_volume_mm3"],
            checks[leg.name]["mesh_volume_mm3"],
            checks[leg.name].get("undercut_mm3"),
            material.mass_g(settings.workshop),
            leg.simulated_mass_g,
        )
        for leg, material in zip(robot.legs, materials, strict=True)
    )
    notes = tuple(
        f"{leg.said}; {leg.cast_volume_mm3:.0f} mm3 cast, {leg.mesh_volume_mm3:.0f} in its mesh"
        for leg in legs
    )
    if robot.file is not None and len(legs) == 1:
        folder.progress.say(legs[0].said)
    warning = mass_warning(
        {leg.name: (leg.mass_g, leg.simulated_mass_g) for leg in legs},
        (printed.mass_g, robot.hub.simulated_mass_g),
        robot.file,
        robot.hub.hollow,
    )
    if warning is not None:
        folder.progress.say(warning)
    mixed = [part for part in parts if part.name == "silicone to mix"]
    only = legs[0] if len(legs) == 1 else None
    return FabricatedRobot(
        design=str(robot.design),
        leg_count=robot.design.leg_count,
        cast_volume_mm3=None if only is None else only.cast_volume_mm3,
        mesh_volume_mm3=None if only is None else only.mesh_volume_mm3,
        cast_volume_error_percent=None if only is None else only.cast_error_percent,
        undercut_mm3={} if only is None else only.undercut_mm3 or {},
        watertight=True,  # surface_of raises otherwise
        silicone_ml=sum(_known(part.volume_ml) for part in mixed),
        silicone_g=sum(_known(part.mass_g) for part in mixed),
        leg_mass_g=None if only is None else only.mass_g,
        solids=made,
        parts=tuple(parts),
        tubes=tuple(tubes),
        wall_s=time.monotonic() - start,
        hub_mass_g=printed.mass_g,
        simulated_leg_mass_g=None if only is None else only.simulated_mass_g,
        simulated_hub_mass_g=robot.hub.simulated_mass_g,
        mass_warning=warning,
        legs=legs,
        notes=() if only is not None else notes,
    )


def _remove_earlier(made: Mapping[str, FabricatedSolid], folder: RunFolder) -> None:
    """Remove the solids of another design that a finished call made there before: somebody would
    make them. A summary that is none tells of nothing."""
    summary = read_summary(folder.path) if (folder.path / SUMMARY).exists() else {}
    earlier = summary.get("solids")
    if summary.get("verb") != "fabricate" or not isinstance(earlier, Mapping):
        return
    ours = {Path(file).name for solid in made.values() for file in (solid.step, solid.stl) if file}
    named = [solid.get(kind) for solid in earlier.values() if isinstance(solid, Mapping)
             for kind in ("step", "stl")]  # fmt: skip
    theirs = {Path(file).name for file in named if isinstance(file, str)}
    older = sorted(name for name in theirs - ours if (folder.path / name).exists())
    for name in older:
        (folder.path / name).unlink()
    if older:
        folder.progress.say(f"removed what was made there before: {', '.join(older)}")


def checked_hub(
    made: FabricatedRobot,
    asked: RobotToMake,
    robot: RobotSpec,
    settings: FabricationSettings,
    folder: RunFolder,
) -> FabricatedRobot:
    """With how far the paper's hub gives way, as finite elements.

    Args:
        made: The paper's robot as it was made.
        asked: What it was made of.
        robot: The simulation, for the leg beside which the hub is judged.
        settings: How it was made.
        folder: Tells that it is computed.
    """
    folder.progress.stage("computing how far the hub gives way")
    hub_g = _known(made.hub_mass_g)
    stiffness = hub_stiffness(
        hub_model(asked.hub.solid, 1e-3 * hub_g, settings.hub_check),
        robot.module.full,
        settings.leg,
        settings.mounting,
        settings.hub_check.largest_force_mN(
            1e-3 * (hub_g + made.leg_count * _known(made.leg_mass_g))
        ),
    )
    return replace(made, hub_stiffness=stiffness)


def refuse_thin_fins(legs: Sequence[LegToMake], settings: MouldSettings) -> None:
    """Refuse legs whose mould has thinner walls between the teeth than can be made, all at once.

    Raises:
        FabricationError: There are some; names them.
    """
    thin = {
        leg.name or "leg": leg.shape.tooth_gap_mm
        for leg in legs
        if leg.shape is not None and leg.shape.tooth_gap_mm < settings.smallest_wall_mm - 1e-6
    }
    if thin:
        told = ", ".join(f"{name} {gap:g} mm" for name, gap in thin.items())
        raise FabricationError(
            f"the mould's walls between the teeth are as thick as their gaps: {told}, expected "
            f"{settings.smallest_wall_mm:g} mm or more; if you can make them, say so by "
            f"--mould.smallest-wall-mm {min(thin.values()):g}"
        )


def _of_legs(
    legs: Sequence[LegToMake], settings: FabricationSettings
) -> tuple[dict[str, tuple[Any, float]], dict[str, dict[str, Any]]]:
    """Solids with their thinnest wall by name, and what is known of each kind of leg by its."""
    solids: dict[str, tuple[Any, float]] = {}
    checks: dict[str, dict[str, Any]] = {}
    names = file_names([leg.name for leg in legs])
    for leg in legs:
        volume = float(leg.mesh.volumes.sum())
        if leg.shape is None:
            checks[leg.name] = {"cast_volume_mm3": volume, "mesh_volume_mm3": volume}
            continue
        check_leg_sizes(leg.shape, leg.mesh)
        mould = make_leg_mould(leg.shape, settings.mould)
        checks[leg.name] = check_leg_mould(mould, leg.shape, volume)
        for name, solid in zip(OF_A_MOULD, (mould.upper, mould.lower, mould.core), strict=True):
            solids[file_name(names[leg.name], name)] = solid, settings.mould.smallest_wall_mm
        whole = mould.body + mould.plate
        solids[file_name(names[leg.name], "leg")] = whole, settings.mould.smallest_silicone_mm
    return solids, checks


def _material(leg: LegToMake, volume_mm3: float, workshop: WorkshopSettings) -> LegMaterial:
    area, size = 0.0, ""
    if leg.shape is not None:
        length, width, _ = leg.shape.base_plate_mm
        area, size = length * width, f"{length:g} x {width:g} mm"
    elif "sheet" in leg.mesh.surfaces:
        area = surface_area(leg.mesh.nodes, leg.mesh.surface("sheet"))
        size = f"{area:.0f} mm2, as its mesh has it"
    return LegMaterial(
        leg.name, leg.count, volume_mm3, area, size, *workshop.silicone_for(leg.silicone)
    )


def _known(value: float | None) -> float:
    assert value is not None  # silicone and the paper's hub are weighed
    return value
