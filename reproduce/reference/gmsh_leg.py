"""Mesh the paper's leg with gmsh, from this package's own shape: a second mesher for the spread.

gmsh is not a dependency of pneumorph: install it beside it with ``pip install gmsh``.

Example: python reproduce/reference/gmsh_leg.py --out leg_gmsh.npz
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from robot_variant import named_leg_mesh

from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.pneunet import Box, PneuNetShape


@dataclass(frozen=True)
class GmshOptions:
    """How to mesh, and where to."""

    out: Path
    """File to write, an npz that ``pneumorph reduce --mesh`` reads too."""
    size_mm: float = 4.0
    """Size of elements at the corners of the shape [mm]."""
    seed: int = 1
    """Of gmsh's random numbers: each gives another mesh of the same quality."""


def gmsh_leg(size_mm: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes [mm], (node, 3), and positive tetrahedra, (element, 4), corners in gmsh's own order.

    Raises:
        ModuleNotFoundError: gmsh is not installed.
    """
    try:
        import gmsh
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "this mesh needs gmsh, which is not installed; pip install gmsh"
        ) from error
    shape = PneuNetShape()
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        cavity = _union(gmsh, shape.cavity_boxes())
        body = _union(gmsh, shape.solid_boxes())
        gmsh.model.occ.cut(body, cavity)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), size_mm)
        gmsh.option.setNumber("Mesh.RandomSeed", seed)
        gmsh.option.setNumber("Mesh.RandomFactor", 1e-7)
        gmsh.model.mesh.generate(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, _, connectivity = gmsh.model.mesh.getElements(3)
    finally:
        gmsh.finalize()
    place = np.zeros(int(tags.max()) + 1, dtype=int)
    place[tags] = np.arange(len(tags))
    return coordinates.reshape(-1, 3), place[connectivity[0].reshape(-1, 4)]


def _union(gmsh: Any, boxes: list[Box]) -> list[tuple[int, int]]:
    solids = [(3, gmsh.model.occ.addBox(*corner, *size)) for corner, size in boxes]
    fused, _ = gmsh.model.occ.fuse(solids[:1], solids[1:])
    result: list[tuple[int, int]] = fused
    return result


def main(options: GmshOptions) -> None:
    """Mesh, check, save and print the size."""
    mesh = named_leg_mesh(*gmsh_leg(options.size_mm, options.seed))
    check_mesh(
        mesh, ("cavity", "sheet", "skin"), ("attachment", "inner_end_face", "outer_end_face")
    )
    mesh.save(options.out)
    print(f"{options.out}: {len(mesh.nodes)} nodes, {len(mesh.tetrahedra)} tetrahedra")


if __name__ == "__main__":
    main(tyro.cli(GmshOptions, description=__doc__))
