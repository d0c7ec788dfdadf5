"""Solids of a design: checked one by one, and written once all of them can be made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.file_names import OF_A_MOULD
from pneumorph.fabrication.solid import ClosedSurface, FabricationError, surface_of, write_step
from pneumorph.fabrication.wall_thickness import wall_thickness_mm
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.surface import boundary_triangles, write_stl

_GRAZED = (
    "; a leg's socket or base plate may graze a face or, in a hollow hub, the inside of a wall: "
    "move the site, or the hub by its bottom_mm, or leave out wall_mm"
)


@dataclass(frozen=True)
class FabricatedSolid:
    """A solid to print or to mill: its files, volume and thinnest wall."""

    step: str | None
    """None of a part that is known by its mesh alone."""
    stl: str
    volume_mm3: float
    surface_volume_mm3: float
    """Volume inside the triangles of the STL file [mm^3]."""
    triangle_count: int
    thinnest_wall_mm: float | None
    """Between triangles of the STL file, which cut across a curved wall: where edges of e go around
    a radius r by up to e^2 / (8 r) less than the solid's own wall. None where no wall has an
    opposite side."""


def made_solids(
    solids: dict[str, tuple[Any, float]], settings: FabricationSettings, folder: RunFolder
) -> dict[str, FabricatedSolid]:
    """Write every solid as STEP and STL, once all are checked.

    Args:
        solids: OpenCASCADE solid and its thinnest wall that can be made [mm], by name.
        settings: Size of the triangles.
        folder: Receives the files.

    Raises:
        FabricationError: A surface is not closed, or a wall is too thin; nothing is written.
    """
    folder.progress.stage("checking surfaces")
    checked = {}
    for number, (name, (solid, smallest)) in enumerate(solids.items(), start=1):
        checked[name] = checked_surface(name, solid, smallest, settings.surface_size_mm)
        folder.progress(number, len(solids), name)
    return {
        name: _written(name, solids[name][0], surface, thinnest, folder)
        for name, (surface, thinnest) in checked.items()
    }


def _allowed_by(name: str) -> str:
    """Flag that allows thinner walls of what is made."""
    if name == "hub":
        return "--hub.smallest-wall-mm"
    return f"--mould.smallest-{'wall' if name.endswith(OF_A_MOULD) else 'silicone'}-mm"


def checked_surface(
    name: str, solid: Any, smallest_mm: float, size_mm: float
) -> tuple[ClosedSurface, float]:
    """Surface of a solid and its thinnest wall [mm].

    Args:
        name: What its files are called.
        solid: OpenCASCADE solid.
        smallest_mm: Thinnest wall that can be made [mm].
        size_mm: Largest edge of a triangle [mm].

    Raises:
        FabricationError: The surface is not closed, or a wall is too thin.
    """
    surface = surface_of(solid, size_mm)  # raises unless it is watertight
    thickness = wall_thickness_mm(surface)
    place = int(np.argmin(thickness))
    thinnest = float(thickness[place])
    if thinnest < smallest_mm - 1e-6:
        middle = surface.nodes[surface.triangles[place]].mean(axis=0)
        raise FabricationError(
            f"{name} has a wall of {thinnest:.2f} mm at ({', '.join(f'{v:.1f}' for v in middle)}) "
            f"mm, expected {smallest_mm:g} mm or more; if you can make it, say so by "
            f"{_allowed_by(name)} {0.9 * thinnest:.2g}" + (_GRAZED if name == "hub" else "")
        )
    return surface, thinnest


def _written(
    name: str, solid: Any, surface: ClosedSurface, thinnest: float, folder: RunFolder
) -> FabricatedSolid:
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


def skin_of(name: str, mesh: Mesh) -> ClosedSurface:
    """Skin of a part that is known by its mesh.

    Args:
        name: What its file is called.
        mesh: The mesh.

    Raises:
        FabricationError: It is not closed, or inside out.
    """
    triangles = boundary_triangles(mesh.tetrahedra)
    used, renumbered = np.unique(triangles, return_inverse=True)
    try:
        return ClosedSurface(mesh.nodes[used], renumbered.reshape(triangles.shape))
    except FabricationError as error:
        raise FabricationError(
            f"the mesh of {name} has no skin that can be made: {error}; its elements may hang "
            "together by an edge or a corner alone, or some be inside out"
        ) from error


def write_skin(name: str, skin: ClosedSurface, folder: RunFolder) -> FabricatedSolid:
    """Write a skin as STL."""
    stl = write_stl(folder / f"{name}.stl", skin.nodes, skin.triangles)
    volume = skin.volume_mm3
    return FabricatedSolid(None, str(stl), volume, volume, len(skin.triangles), None)
