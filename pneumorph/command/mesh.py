"""Mesh a part, or read a mesh of your own, and check it.

The leg and the disk of the paper come out as they are; every size is a flag. A mesh file of your
own (gmsh, VTK, ...) is read with --file: its regions are gmsh's physical groups by name, or cell
data `region` whose numbers --regions names, such as --regions 1=cavity 2=paper 3=attachment. A leg
to be reduced needs the surfaces cavity and paper and the node sets attachment and outer_end_face. A
mesh that cannot be computed with is refused with its reason.

Writes mesh.npz, which `pneumorph reduce --mesh` reads.

Example: pneumorph mesh leg --leg.tooth-height-mm 9 --leg-mesher.size-mm 3 --out runs/tall-leg
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import tyro

from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.geometry.disk import DiskShape, mesh_disk
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.surface import enclosed_volume
from pneumorph.settings import settings_to_dict


@dataclass(frozen=True)
class MeshOptions:
    """What to mesh, or which file to read."""

    part: tyro.conf.Positional[Literal["leg", "disk"]] = "leg"
    """Which part to mesh."""
    file: Path | None = None
    """A mesh of your own to read instead."""
    regions: tuple[str, ...] = ()
    """Names of the region numbers of a file without named groups, such as 1=cavity 2=paper."""
    scale: float = 1.0
    """Length of the file's unit in mm: 1000 for metres."""
    surfaces: tuple[str, ...] = ("cavity", "paper")
    """Surface regions that the file must have."""
    node_sets: tuple[str, ...] = ("attachment",)
    """Node sets that the file must have."""
    contact_spacing_mm: float = 10.0
    """Distance between the contact points of a file's mesh, which are nodes of its skin [mm]."""
    quadratic: bool = False
    """Add a node in the middle of every edge: 10-node tetrahedra, which do not lock in bending."""
    leg: PneuNetShape = field(default_factory=PneuNetShape)
    disk: DiskShape = field(default_factory=DiskShape)
    leg_mesher: MesherSettings = field(default_factory=MesherSettings)
    disk_mesher: MesherSettings = field(default_factory=lambda: MesherSettings(size_mm=20.0))


def mesh(options: MeshOptions, folder: RunFolder) -> dict[str, Any]:
    """Make or read a mesh, save it and return its size."""
    start = time.monotonic()
    made = quadratic_mesh(_made(options)) if options.quadratic else _made(options)
    path = made.save(folder / "mesh.npz", {"settings": settings_to_dict(options)})
    summary: dict[str, Any] = {
        "mesh": str(path),
        "node_count": len(made.nodes),
        "tetrahedron_count": len(made.tetrahedra),
        "volume_mm3": float(made.volumes.sum()),
    }
    if "cavity" in made.surfaces:
        summary["cavity_volume_mm3"] = enclosed_volume(made.nodes, made.surfaces["cavity"])
    return summary | {
        "surfaces": {name: len(triangles) for name, triangles in made.surfaces.items()},
        "node_sets": {name: len(nodes) for name, nodes in made.node_sets.items()},
        "contact_point_count": len(made.contact_points),
        "digest": made.digest(),
        "wall_s": time.monotonic() - start,
    }


def _made(options: MeshOptions) -> Mesh:
    if options.file is not None:
        return read_mesh_file(
            options.file,
            options.surfaces,
            options.node_sets,
            region_names=_region_names(options.regions),
            scale=options.scale,
            contact_spacing_mm=options.contact_spacing_mm,
        )
    if options.part == "disk":
        return mesh_disk(options.disk, options.disk_mesher)
    return mesh_pneunet(options.leg, options.leg_mesher)


def _region_names(regions: tuple[str, ...]) -> dict[int, str]:
    names = {}
    for region in regions:
        number, separator, name = region.partition("=")
        if not (separator and name and number.strip().isdigit()):
            raise ValueError(f"region {region!r} is not NUMBER=NAME, expected such as 1=cavity")
        names[int(number)] = name.strip()
    return names


VERB = Verb(MeshOptions, mesh)
