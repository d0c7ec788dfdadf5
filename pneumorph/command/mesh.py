"""Mesh a part, or read a mesh of your own, and check it.

By default it makes the paper's leg or disk; every size is a flag. --file reads a mesh file of your
own (gmsh, VTK, ...): its regions are gmsh's named physical groups, or cell data `region` whose
numbers --regions names, such as --regions 1=cavity 2=sheet 3=attachment. To be reduced, a leg needs
the surfaces cavity and sheet and the node sets attachment and outer_end_face. A mesh that cannot be
used is refused, with the reason.

Writes mesh.npz, which `pneumorph reduce --mesh` reads.

Example: pneumorph mesh leg --leg.tooth-height-mm 9 --leg-mesher.size-mm 3 --out runs/tall-leg
"""

from __future__ import annotations

from dataclasses import dataclass

import tyro

from pneumorph.command.verb import Verb
from pneumorph.study.made_mesh import MeshSettings, PartName, make_mesh


@dataclass(frozen=True)
class MeshOptions(MeshSettings):
    """What to mesh, or which file to read."""

    part: tyro.conf.Positional[PartName] = "leg"
    """Which part to mesh."""


VERB = Verb(MeshOptions, lambda options, folder: make_mesh(options.part, options, folder))
