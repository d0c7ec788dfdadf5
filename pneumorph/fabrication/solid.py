"""Solids of OpenCASCADE as files and as closed triangle surfaces."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pneumorph.geometry.netgen_mesher import open_cascade
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.surface import enclosed_volume


class FabricationError(ValueError):
    """A solid cannot be made as it is; the message says why."""


@dataclass(frozen=True, eq=False)
class ClosedSurface:
    """Triangles that enclose a solid, normals outward.

    Attributes:
        nodes: Positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3).

    Raises:
        FabricationError: The surface is open, or inside out.
    """

    nodes: np.ndarray
    triangles: np.ndarray

    def __post_init__(self) -> None:
        edges = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        size = len(self.nodes)
        there, back = edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0]
        unique, counts = np.unique(there, return_counts=True)
        # Each directed edge once, and its opposite once: closed, with one side everywhere.
        if np.any(counts != 1) or not np.array_equal(unique, np.unique(back)):
            raise FabricationError(
                f"the surface of {len(self.triangles)} triangles is not watertight; the solid may "
                "touch itself along an edge"
            )
        if self.volume_mm3 <= 0.0:
            raise FabricationError("the surface is inside out: it encloses a negative volume")

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume [mm^3]."""
        return enclosed_volume(self.nodes, self.triangles)


def surface_of(solid: Any, size_mm: float = 8.0) -> ClosedSurface:
    """Triangulate a solid's surface by netgen; triangles of neighbouring faces share their nodes.

    Args:
        solid: OpenCASCADE solid.
        size_mm: Largest edge [mm].

    Raises:
        FabricationError: The surface is not closed.
    """
    from netgen.meshing import MeshingStep

    geometry = open_cascade().OCCGeometry(solid)
    mesh = geometry.GenerateMesh(maxh=size_mm, perfstepsend=MeshingStep.MESHSURFACE)
    nodes = np.array(mesh.Coordinates(), dtype=float)
    triangles = np.array(mesh.Elements2D().NumPy()["nodes"][:, :3], dtype=np.int64) - 1
    used, renumbered = np.unique(triangles, return_inverse=True)
    triangles = renumbered.reshape(triangles.shape)
    if enclosed_volume(nodes[used], triangles) < 0.0:
        triangles = triangles[:, ::-1]
    return ClosedSurface(nodes[used], triangles)


def single_solid(name: str, shape: Any) -> Any:
    """Return a shape that is one connected solid.

    Raises:
        FabricationError: It is none or several.
    """
    count = len(shape.solids)
    if count != 1:
        raise FabricationError(f"{name} consists of {count} solids, expected 1; sizes do not fit")
    return shape.solids[0]


def write_step(path: Path, solid: Any) -> Path:
    """Write a solid as STEP, under a temporary name first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".step")
    os.close(handle)
    try:
        solid.WriteStep(temporary)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return path


def posed(shape: Any, pose: Pose) -> Any:
    """A shape of a part's frame where a pose puts it."""
    occ = open_cascade()
    turn = Rotation.from_matrix(pose.rotation).as_rotvec(degrees=True)
    angle, origin = float(np.linalg.norm(turn)), occ.Pnt(0, 0, 0)
    if angle > 0.0:
        axis = occ.Dir(*map(float, turn / angle))
        shape = shape.Rotate(occ.Axis(origin, axis), angle)
    return shape.Move(occ.Vec(*map(float, pose.translation)))
