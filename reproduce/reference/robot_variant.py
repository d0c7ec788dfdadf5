"""Meshes that are as legitimate as those that ship, for the spread that meshing alone causes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from reference_case import PUBLISHED, ReferenceCase, case_physics

from pneumorph.catalogue.leg_kinds import leg_kind, paper_leg_mesh
from pneumorph.catalogue.paper_robot import disk_rim_points, paper_disk_mesh, paper_hub
from pneumorph.fem.full_order_settings import FrictionSolver, FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.corner_order import EVEN_ORDERS, largest_face_first
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import MesherSettings, box, tetrahedralise
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.surface import boundary_triangles

TRACKED_POINT_MM = (0.63, -1.87, 44.92)
"""Mean of the three nodes that the reference follows, on the disk's top face at rest [mm]."""


@dataclass(frozen=True)
class RobotVariant:
    """Which of several equally good discretisations of one robot to take."""

    leg: Literal["shipped", "whole", "file"] = "shipped"
    """Mesh of a leg: `shipped` (one half and its mirror image), `whole` (netgen on the whole leg:
    left and right differ), or `file`."""
    file: Path | None = None
    """Mesh of the leg to read, an npz of this package such as gmsh_leg.py writes."""
    size_mm: float = 4.0
    """Largest edge of a `whole` leg's elements [mm]."""
    grading: float = 0.3
    """Growth of a `whole` leg's elements away from small features."""
    corners: Literal["kept", "largest", "random"] = "kept"
    """Which corner of a tetrahedron comes first, where edge-based rotations are taken from: as the
    mesh has it, at its largest face, or at random."""
    seed: int = 0
    """Of the random corners."""
    mirrored: bool = False
    """Take the leg's mirror image; left and right of a mesh without symmetry then change places."""
    rim_corner_count: int = 0
    """Corners of the disk's lower rim that can touch the floor, the first straight ahead; 0 for the
    shipped disk's own. The reference's disk is a polygon of 16."""

    friction_solver: FrictionSolver = "newton"
    """`gauss_seidel`: 250 sweeps wherever they end, as the reference made them."""

    def robot(self, case: ReferenceCase) -> FullRobot:
        """The full-order robot of a case, elastic disk and published damping."""
        numerics = FullOrderSettings(
            integrator=PUBLISHED.full.integrator,
            friction_solver=self.friction_solver,
            contact_sweeps=PUBLISHED.full.contact_sweeps,
        )
        if self.friction_solver == "gauss_seidel":
            numerics = replace(numerics, contact_sweeps=250, contact_tolerance_mm_per_s=1e-8)
        part, disk = self.leg_part(), paper_hub(PUBLISHED.masses).full("soft")
        assert isinstance(disk, SoftHub)
        rim = disk_rim_points(paper_disk_mesh())
        if self.rim_corner_count:
            rim = _polygon(self.rim_corner_count)
        mounting = RadialMounting()
        return FullRobot(
            SoftHub(disk.part, rim),
            [
                (part, mounting.pose(location), regulator - 1)
                for location, regulator in case.design.legs
            ],
            case_physics(case),
            tracked_point=np.array(TRACKED_POINT_MM),
            numerics=numerics,
        )

    def leg_part(self) -> PartModel:
        """Finite elements of the leg.

        Raises:
            ValueError: A file is asked for and not named.
        """
        if self.leg == "file":
            if self.file is None:
                raise ValueError("leg is 'file', expected a file: name it with --variant.file")
            mesh = Mesh.load(self.file)
        elif self.leg == "whole":
            mesh = whole_leg_mesh(MesherSettings(self.size_mm, self.grading))
        else:
            mesh = paper_leg_mesh()
        return leg_model(self._reordered(mesh), leg_kind(PUBLISHED.leg).materials)

    def _reordered(self, mesh: Mesh) -> Mesh:
        nodes, tetrahedra = mesh.nodes, mesh.tetrahedra
        if self.corners == "kept" and not self.mirrored:
            return mesh
        if self.corners == "largest":
            tetrahedra = largest_face_first(nodes, tetrahedra)
        elif self.corners == "random":
            choice = np.random.default_rng(self.seed).integers(12, size=len(tetrahedra))
            tetrahedra = np.take_along_axis(tetrahedra, EVEN_ORDERS[choice], axis=1)
        if self.mirrored:  # two corners change places, as the orientation does
            nodes, tetrahedra = nodes * [1.0, -1.0, 1.0], tetrahedra[:, [1, 0, 2, 3]]
        return named_leg_mesh(nodes, tetrahedra)


def whole_leg_mesh(settings: MesherSettings) -> Mesh:
    """The paper's leg meshed at once by netgen, without a plane of symmetry."""
    shape = PneuNetShape()
    first, *others = (box(*each) for each in shape.solid_boxes())
    solid = first
    for other in others:
        solid = solid + other
    for corner, size in shape.cavity_boxes():
        solid = solid - box(corner, size)
    return named_leg_mesh(*tetrahedralise(solid, settings))


def named_leg_mesh(nodes: np.ndarray, tetrahedra: np.ndarray) -> Mesh:
    """Name the regions of a mesh of the paper's leg by where its faces lie."""
    shape = PneuNetShape()
    boundary = boundary_triangles(tetrahedra)
    centres = nodes[boundary].mean(axis=1)
    half_length, _, _ = np.array(shape.base_plate_mm) / 2.0
    in_cavity = np.zeros(len(boundary), dtype=bool)
    for corner, size in shape.cavity_boxes():
        low, high = np.array(corner) - 1e-6, np.add(corner, size) + 1e-6
        in_cavity |= np.all((centres >= low) & (centres <= high), axis=1)
    skin = boundary[~in_cavity]
    tooth = np.array(shape.tooth_base_mm) / 2.0
    corners = [(-tooth[0], y, z) for y in (tooth[1], -tooth[1]) for z in (4.0, shape.height_mm)]
    distance = np.linalg.norm(nodes[:, None] - np.array(corners), axis=2)
    return Mesh(
        nodes=nodes,
        tetrahedra=tetrahedra,
        surfaces={
            "cavity": boundary[in_cavity][:, ::-1],
            "sheet": skin[np.all(np.abs(nodes[skin][:, :, 2]) < 1e-6, axis=1)],
            "skin": skin,
        },
        node_sets={
            "attachment": np.argmin(distance, axis=0),
            "inner_end_face": np.flatnonzero(np.abs(nodes[:, 0] + half_length) < 1e-6),
            "outer_end_face": np.flatnonzero(np.abs(nodes[:, 0] - half_length) < 1e-6),
        },
        contact_points=shape.contact_points_mm(),
    )


def _polygon(corner_count: int) -> np.ndarray:
    """Corners of the disk's lower rim, and as many of the upper one [mm], (point, 3)."""
    disk = DiskShape()
    angle = 2.0 * np.pi * np.arange(corner_count) / corner_count
    rings = (
        (disk.bottom_radius_mm, disk.bottom_mm),
        (disk.top_radius_mm, disk.bottom_mm + disk.height_mm),
    )
    return np.concatenate(
        [
            np.stack([r * np.cos(angle), r * np.sin(angle), np.full(corner_count, z)], axis=1)
            for r, z in rings
        ]
    )
