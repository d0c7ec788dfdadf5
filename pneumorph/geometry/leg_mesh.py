"""The mesh of a leg, read from its file with the regions that a leg must have."""

from __future__ import annotations

from pathlib import Path

from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.region_names import cavity_regions


def load_leg_mesh(path: Path | str) -> Mesh:
    """Read the mesh of a leg.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: The file is truncated, of another kind or of another format version.
        MeshError: It has no cavity, no sheet or nothing to attach it by; names the file.
    """
    mesh = Mesh.load(path)
    try:
        mesh.surface("sheet")
        mesh.node_set("attachment")
        if not cavity_regions(mesh):
            mesh.surface("cavity")
    except MeshError as error:
        raise MeshError(
            f"mesh file {path} is not of a leg: {error}; a leg needs the surfaces 'cavity' and "
            "'sheet' and the node set 'attachment'"
        ) from error
    return mesh
