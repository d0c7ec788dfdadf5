"""The disk that carries the legs: a truncated cone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Positive
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mirror import mirror_half
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import (
    MesherSettings,
    box,
    meshing,
    open_cascade,
    tetrahedralise,
)
from pneumorph.geometry.surface import boundary_triangles

DISK_SIZE_MM = 16.0
"""Element size that gives about the 86 nodes of the paper's disk [mm]."""


@dataclass(frozen=True)
class DiskShape(Checked):
    """Shape of the disk: a truncated cone about the robot's vertical axis [mm]."""

    bottom_radius_mm: Positive = 50.0
    """Radius of the lower face [mm]."""
    top_radius_mm: Positive = 54.5
    """Radius of the upper face [mm]."""
    height_mm: Positive = 18.0
    """Height of the disk [mm]."""
    bottom_mm: float = RadialMounting().hub_bottom_mm
    """Height of the lower face in the robot's frame [mm]."""

    @property
    def top_centre_mm(self) -> tuple[float, float, float]:
        """Centre of the upper face in the robot's frame [mm]."""
        return (0.0, 0.0, self.bottom_mm + self.height_mm)

    def volume_mm3(self) -> float:
        """Volume of the truncated cone, pi h / 3 (r1^2 + r1 r2 + r2^2)."""
        low, high = self.bottom_radius_mm, self.top_radius_mm
        return float(np.pi * self.height_mm / 3.0 * (low * low + low * high + high * high))


def mesh_disk(shape: DiskShape | None = None, settings: MesherSettings | None = None) -> Mesh:
    """Mesh the disk, exactly symmetric in y, coarsely by default as in the paper.

    Regions: surface ``skin``; node sets ``top`` and ``bottom``.

    Args:
        shape: Sizes; those of the paper by default.
        settings: How finely to mesh.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        MeshError: The mesh that came out is faulty.
    """
    shape = shape or DiskShape()
    settings = settings or MesherSettings(size_mm=DISK_SIZE_MM)
    occ = open_cascade()
    axis = occ.Axes(occ.Pnt(0, 0, shape.bottom_mm), occ.Z)
    bottom, top, high = shape.bottom_radius_mm, shape.top_radius_mm, shape.height_mm
    reach = 2.0 * max(bottom, top)
    with meshing("disk"):
        # A cone of equal radii is none to the modeller; the last number is the angle.
        equal = abs(top - bottom) < 1e-6 * high
        cone = (
            occ.Cylinder(axis, bottom, high)
            if equal
            else occ.Cone(axis, bottom, top, high, 2.0 * np.pi)
        )
        half_space = box(
            (-reach, 0.0, shape.bottom_mm - reach), (2.0 * reach, reach, high + 2.0 * reach)
        )
        half = tetrahedralise(cone * half_space, settings)
    whole = mirror_half(*half)
    boundary = boundary_triangles(whole.tetrahedra)
    height = whole.nodes[:, 2] - shape.bottom_mm
    mesh = Mesh(
        nodes=whole.nodes,
        tetrahedra=whole.tetrahedra,
        surfaces={"skin": boundary},
        node_sets={
            "top": np.flatnonzero(np.abs(height - shape.height_mm) < 1e-6),
            "bottom": np.flatnonzero(np.abs(height) < 1e-6),
        },
        mirror_nodes=whole.mirror_nodes,
    )
    check_mesh(mesh, ("skin",), ("top",))
    return mesh
