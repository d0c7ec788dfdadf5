"""Mesh a part, or read a mesh of your own, and check it.

By default it makes the paper's leg or disk; every size is a flag. --file reads a mesh file of your
own (gmsh, VTK, ...): its regions are gmsh's named physical groups, or cell data `region` whose
numbers --regions names, such as --regions 1=cavity 2=sheet 3=attachment. To be reduced, a leg needs
the surfaces cavity (or several, such as cavity_left and cavity_right) and sheet and the node sets
attachment and outer_end_face. A mesh that cannot be used is refused, with the reason.

Presets: measured (10-node tetrahedra, as silicone that hardly changes its volume needs them; the
paper's leg tied to its hub over a face); paper (the published leg's linear ones).

Writes mesh.npz, which `pneumorph reduce --mesh` reads.

Example: pneumorph mesh leg --leg.tooth-height-mm 9 --out runs/tall-leg
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import tyro

from pneumorph.command.verb import Verb
from pneumorph.study.made_mesh import MEASURED_LEG, MeshSettings, PartName, make_mesh


@dataclass(frozen=True)
class MeshOptions(MeshSettings):
    """What to mesh, or which file to read."""

    part: tyro.conf.Positional[PartName] = "leg"
    """Which part to mesh."""

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """A file's own node sets say how it is tied; what has no surfaces that a leg needs, such as
        a hub, is linear, and so is the disk."""
        if content.keys().isdisjoint(("file", "surfaces", "part")):
            return {}
        if content.get("file", below["file"]) is not None:
            leg = bool(content.get("surfaces", below["surfaces"]))
            return {"face_tied": False} if leg else {"face_tied": False, "quadratic": False}
        return {"quadratic": False, "face_tied": False} if content.get("part") == "disk" else {}


PRESETS = {"measured": lambda: MeshOptions(**MEASURED_LEG), "paper": MeshOptions}
"""Ready options by name; the first where none is named."""

VERB = Verb(MeshOptions, lambda options, folder: make_mesh(options.part, options, folder), PRESETS)
