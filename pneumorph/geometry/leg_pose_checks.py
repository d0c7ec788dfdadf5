"""Refuse a leg's mesh that does not lie as legs do: outwards along x, its sheet below."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.attachment import OBLIQUE
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.outer_boundary import outer_boundary

_NO_WAY = 1e-6
"""Between an end and the other, relative to the longest side."""


def check_upright(mesh: Mesh) -> None:
    """Refuse a leg whose sheet is not below it.

    Raises:
        MeshError: The surface ``sheet``, if there is one, looks out of the solid more than 45
            degrees off -z, or lies within the solid and in its upper half.
    """
    if "sheet" not in mesh.surfaces:
        return
    height = mesh.nodes[:, 2]
    sheet = height[np.unique(mesh.surfaces["sheet"])].mean() - height.min()
    looks, area = _outward(mesh, mesh.surfaces["sheet"])
    size = float(np.linalg.norm(looks))
    # A sheet within the solid looks nowhere, nor does one all round it.
    told = size > 1e-6 * area > 0.0
    if (-looks[2] < OBLIQUE * size) if told else (sheet > 0.5 * np.ptp(height)):
        way = ", ".join(f"{each:.1f}" for each in looks / size + 0.0) if told else ""
        raise MeshError(
            f"the sheet lies {sheet:.1f} mm above the lowest node of {np.ptp(height):.1f} mm"
            + (f" and looks along ({way})" if told else "")
            + ", expected it at the bottom"
            + (", looking down, along (0, 0, -1) within 45 degrees" if told else "")
            + ", z being up: the leg may be upside down, or y up as in some CAD programs; turn the "
            "nodes before the file is written"
        )


def _outward(mesh: Mesh, triangles: np.ndarray) -> tuple[np.ndarray, float]:
    """The sum of the normals out of the solid of those triangles that are on its outside, however
    they look themselves, by area, and the sum of their areas [mm^2], (3,) and a number."""
    outer, size = outer_boundary(mesh), len(mesh.nodes)
    weights = np.array([size * size, size, 1])
    own = np.isin(np.sort(outer, axis=1) @ weights, np.sort(triangles, axis=1) @ weights)
    corners = mesh.nodes[outer[own]]
    normals = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals.sum(axis=0), float(np.linalg.norm(normals, axis=1).sum())


def check_outwards(mesh: Mesh) -> None:
    """Refuse a leg that points anywhere but along x.

    Raises:
        MeshError: The node sets ``attachment`` and ``outer_end_face``, where there are both, share
            nodes, or the way from one to the other has no length or is more than 45 degrees off.
    """
    none = np.zeros(0, dtype=int)
    ends = [mesh.node_sets.get(name, none) for name in ("attachment", "outer_end_face")]
    if any(len(nodes) == 0 for nodes in ends):
        return
    shared = int(np.isin(ends[0], ends[1]).sum())
    if shared:
        raise MeshError(
            f"attachment and outer_end_face share {shared} nodes, expected none: what is held does "
            "not turn; was one face put into both groups?"
        )
    held, end = (mesh.nodes[nodes].mean(axis=0) for nodes in ends)
    way = end - held
    length = float(np.linalg.norm(way))
    if length < _NO_WAY * mesh.longest_side_mm or way[0] < OBLIQUE * length:
        told = ", ".join(f"{each:.1f}" for each in way)
        raise MeshError(
            f"outer_end_face lies ({told}) mm from attachment, expected it along +x: bends are "
            "measured about y; turn the nodes before the file is written"
        )


def check_end_face(mesh: Mesh) -> None:
    """Refuse an end that is an edge or a point.

    Raises:
        MeshError: The nodes of ``outer_end_face``, if there is one, cover no triangle of the
            outside.
    """
    nodes = mesh.node_sets.get("outer_end_face")
    if nodes is not None and not np.isin(outer_boundary(mesh), nodes).all(axis=1).any():
        raise MeshError(
            f"the {len(nodes)} nodes of outer_end_face cover no triangle of the solid's outside, "
            "expected a face: the bend is how far it turns, which a line or a point does not tell; "
            "was an edge of the end put into that group?"
        )
