"""A mesh of a part, made from its shape or read from a file, checked and saved."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.base.checked import Checked, Positive
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.geometry.disk import DiskShape, mesh_disk
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.geometry.mirror_image import mirror_notes
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import connected_pieces, enclosed_volume

PartName = Literal["leg", "disk"]
MESH_FILE = "mesh.npz"


@dataclass(frozen=True)
class MeshSettings(Checked):
    """Shapes of the parts and how finely they are meshed, or a mesh file to read."""

    file: Path | None = None
    """A mesh file of your own to read (gmsh, VTK, ...), instead of the shapes below."""
    regions: tuple[str, ...] = ()
    """For a file whose regions have numbers instead of names: their names, such as 1=cavity
    2=sheet."""
    scale: Positive = 1.0
    """The file's unit of length [mm]: 1000 if it is in metres."""
    surfaces: tuple[str, ...] = ("cavity", "sheet")
    """Surface regions that the file must have, or it is refused; others whose names begin with
    cavity stand for cavity."""
    node_sets: tuple[str, ...] = ("attachment", "outer_end_face")
    """Node sets that the file must have, or it is refused."""
    contact_spacing_mm: Positive = 10.0
    """Distance between contact points on the skin of the file's mesh [mm]; they are nodes."""
    quadratic: bool = False
    """Make 10-node tetrahedra, with a node in the middle of every edge. They do not lock in bending
    as linear ones do, and cost more."""
    face_tied: bool = False
    """Attach the leg to its hub over the whole end face of its first tooth, like the measured leg;
    otherwise at the corners of that face."""
    leg: PneuNetShape = field(default_factory=PneuNetShape)
    disk: DiskShape = field(default_factory=DiskShape)
    leg_mesher: MesherSettings = field(default_factory=MesherSettings)
    disk_mesher: MesherSettings = field(default_factory=lambda: MesherSettings(size_mm=20.0))

    def unused(self, part: PartName) -> list[str]:
        """Names of what is given and would change nothing: shapes and meshers beside a file or of
        the other part, and how a file is read where there is none. What is so by default or in a
        preset is not given.

        Args:
            part: What is meshed where there is no file.
        """
        usual = (MeshSettings(), MeshSettings(**MEASURED_LEG))
        if self.file is not None:
            without: tuple[str, ...] = ("leg", "leg_mesher", "disk", "disk_mesher")
        else:
            other = "leg" if part == "disk" else "disk"
            without = (other, f"{other}_mesher", *_OF_FILES)
        return [
            name
            for name in without
            if getattr(self, name) not in [getattr(each, name) for each in usual]
        ]

    def refuse_unused(self, part: PartName) -> None:
        """Refuse what would change nothing.

        Args:
            part: What is meshed where there is no file.

        Raises:
            ValueError: There is something, see `unused`.
        """
        for name in self.unused(part):
            flag = "--" + name.replace("_", "-")
            if name in _OF_FILES:
                raise ValueError(
                    f"{flag} has no effect on a {part} that is made from its shape, expected "
                    f"--file beside it, or no {flag}{_INSTEAD.get((part, name), '')}"
                )
            if self.file is None:
                raise ValueError(
                    f"{flag}.* has no effect on the mesh of a {part}, expected none: it is of the "
                    f"{name.partition('_')[0]}"
                )
            raise ValueError(
                f"{flag}.* has no effect on the mesh of {self.file}, which is read as it is, "
                f"expected either the file or {flag}.*"
            )


_OF_FILES = ("regions", "scale", "surfaces", "node_sets", "contact_spacing_mm")
"""Settings by which a mesh file is read."""

_INSTEAD = {("leg", "contact_spacing_mm"): "; a leg's own is --leg.contact-spacing-mm"}
"""What there is in place of some of them, by part and name."""

MEASURED_LEG: dict[str, Any] = {
    "quadratic": True,
    "face_tied": True,
    "leg_mesher": MesherSettings(size_mm=6.0, grading=0.9),
}
"""Settings of the mesh of the measured leg that ships."""


@dataclass(frozen=True)
class MadeMesh:
    """Size of a mesh and where it lies."""

    mesh: str
    """File of the mesh."""
    node_count: int
    tetrahedron_count: int
    volume_mm3: float
    surfaces: dict[str, int]
    """Triangles of each named surface."""
    node_sets: dict[str, int]
    """Nodes of each named set."""
    contact_point_count: int
    digest: str
    wall_s: float
    cavity_volume_mm3: float | None = None
    """Of all cavities; None where no surface's name begins with cavity."""
    cavities_mm3: dict[str, float] = field(default_factory=dict)
    """Volume of each by its name."""
    size_mm: tuple[float, float, float] | None = None
    """Along x, y and z; None in runs of earlier versions."""
    notes: tuple[str, ...] = ()
    """What to say of it, such as a cavity of several pieces, or sides that are meshed apart."""


def make_mesh(part: PartName, settings: MeshSettings, folder: RunFolder) -> MadeMesh:
    """Mesh a part or read a mesh file, check it and save it as ``mesh.npz`` in the folder.

    Args:
        part: Which part; without meaning where the settings name a file.
        settings: Its shape, or the file.
        folder: Receives the mesh.

    Raises:
        ValueError: A shape that cannot be, a setting that would change nothing, such as a shape
            beside a file, a region that is no NUMBER=NAME or has a number twice, or a mesh that
            cannot be computed with.
        FileNotFoundError: No such mesh file.
    """
    start = time.monotonic()
    settings.refuse_unused(part)
    mesh = _made(part, settings)
    if settings.quadratic:
        mesh = quadratic_mesh(mesh)
    if settings.face_tied:
        mesh = tied_over_face(mesh)
    asked = {"part": part, **settings_to_dict(settings)}
    path = mesh.save(folder / MESH_FILE, {"settings": asked})
    cavities = {
        name: enclosed_volume(mesh.nodes, mesh.surfaces[name]) for name in cavity_regions(mesh)
    }
    return MadeMesh(
        mesh=str(path),
        node_count=len(mesh.nodes),
        tetrahedron_count=len(mesh.tetrahedra),
        size_mm=_size_mm(mesh),
        volume_mm3=float(mesh.volumes.sum()),
        surfaces={name: len(triangles) for name, triangles in mesh.surfaces.items()},
        node_sets={name: len(nodes) for name, nodes in mesh.node_sets.items()},
        contact_point_count=len(mesh.contact_points),
        digest=mesh.digest(),
        wall_s=time.monotonic() - start,
        cavity_volume_mm3=sum(cavities.values()) if cavities else None,
        cavities_mm3=cavities,
        notes=(*_parted_cavities(mesh), *mirror_notes(mesh)),
    )


def _parted_cavities(mesh: Mesh) -> tuple[str, ...]:
    """What to say of cavities that no air could fill from one place."""
    told = []
    for name in cavity_regions(mesh):
        triangles = mesh.surfaces[name]
        piece = connected_pieces(triangles, len(mesh.nodes))[triangles[:, 0]]
        volumes = [enclosed_volume(mesh.nodes, triangles[piece == k]) for k in np.unique(piece)]
        if len(volumes) > 1:
            sizes = ", ".join(f"{each:.4g}" for each in volumes)
            told.append(
                f"the cavity {name!r} is {len(volumes)} closed pieces, of {sizes} mm^3, which are "
                "inflated as one: connect them, feed each on the real leg, or make each a region "
                f"of its own, such as {name}_1"
            )
    return tuple(told)


def _size_mm(mesh: Mesh) -> tuple[float, float, float]:
    x, y, z = np.ptp(mesh.nodes, axis=0).tolist()
    return x, y, z


def _made(part: PartName, settings: MeshSettings) -> Mesh:
    if settings.file is not None:
        return read_mesh_file(
            settings.file,
            settings.surfaces,
            settings.node_sets,
            region_names=_region_names(settings.regions),
            scale=settings.scale,
            contact_spacing_mm=settings.contact_spacing_mm,
        )
    if part == "disk":
        return mesh_disk(settings.disk, settings.disk_mesher)
    return mesh_pneunet(settings.leg, settings.leg_mesher)


def _region_names(regions: tuple[str, ...]) -> dict[int, str]:
    names: dict[int, str] = {}
    for region in regions:
        number, separator, name = region.partition("=")
        if not (separator and name and number.strip().isdigit()):
            raise ValueError(f"region {region!r} is not NUMBER=NAME, expected such as 1=cavity")
        if int(number) in names:
            raise ValueError(
                f"regions have number {int(number)} twice, as {names[int(number)]!r} and "
                f"{name.strip()!r}, expected one name for each"
            )
        names[int(number)] = name.strip()
    return names
