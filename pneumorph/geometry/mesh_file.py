"""Read a user's own mesh: gmsh, VTK and whatever else meshio reads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.optional_package import optional_package
from pneumorph.geometry.abaqus_file import check_abaqus_file
from pneumorph.geometry.file_regions import check_one_volume, regions_of
from pneumorph.geometry.leg_pose_checks import check_end_face, check_outwards, check_upright
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mirror_image import with_mirror_nodes
from pneumorph.geometry.outer_boundary import outer_boundary
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.spread_points import spread_points
from pneumorph.geometry.surface import connected_pieces, enclosed_volume

LEAST_EXTENT_MM, LARGEST_EXTENT_MM = 1.0, 10_000.0
"""Between which the longest side of a part's mesh is taken to be in mm."""

_HIGHER_ORDER = {"triangle6", "triangle10", "triangle15", "tetra10", "tetra20", "tetra35"}
"""Triangles and tetrahedra with nodes on their edges, as meshio calls them."""


def read_mesh_file(
    path: Path | str,
    surfaces: Iterable[str] = ("cavity", "sheet"),
    node_sets: Iterable[str] = ("attachment",),
    *,
    region_names: dict[int, str] | None = None,
    scale: float = 1.0,
    contact_spacing_mm: float = 10.0,
) -> Mesh:
    """Read nodes, tetrahedra and regions.

    Regions are gmsh's physical groups by name, and element sets and node sets of an Abaqus file; in
    other formats, integer cell data ``region`` with `region_names` saying what a number means.
    Triangles of a region make a surface of that name, and all nodes of a region's points, lines or
    triangles, or of a node set, a node set of that name; a triangle that a region has more than
    once counts once. Nodes that no tetrahedron uses are dropped; a cavity whose normals all leave
    the solid is turned round, since mesh generators orient a boundary that way. Where no region is
    called ``skin``, it is the boundary without the cavities, which are all regions whose names
    begin with ``cavity``; contact points are nodes of the skin, spread evenly. A mesh that is its
    own mirror image about y = 0 gets ``mirror_nodes``, contact points in mirrored pairs, and
    corners of elements in the order of images.

    Args:
        path: The file.
        surfaces: Surface regions that must be there.
        node_sets: Node sets that must be there.
        region_names: Name of each region number that has none in the file.
        scale: Length of the file's unit [mm], 1000 for metres.
        contact_spacing_mm: Distance between contact points [mm].

    Raises:
        FileNotFoundError: No such file.
        ModuleNotFoundError: meshio is not installed.
        MeshError: The file cannot be read, or the mesh is faulty, of several volumes, lacks a
            region or is of no plausible size.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"mesh file {path} does not exist")
    meshio = optional_package("meshio", "reading a mesh file needs meshio", "meshing")
    surfaces, node_sets = list(surfaces), list(node_sets)
    if path.suffix.lower() == ".inp":
        check_abaqus_file(path, [*surfaces, *node_sets])
    try:
        read = meshio.read(path)
    except (OSError, ModuleNotFoundError):
        raise
    except (Exception, SystemExit) as error:  # each of its readers has its own, and some exit
        told = "" if isinstance(error, SystemExit) else str(error)
        told = told or "it is damaged, or of another kind than its name says"
        hint = ""
        if "gmsh:physical" in str(error):
            hint = (
                " Some elements seem to be in no physical group: give each volume and surface "
                "one, or have gmsh save grouped elements alone (Mesh.SaveAll = 0)"
            )
        raise MeshError(f"{path} cannot be read as a mesh: {told}{hint}") from error

    try:
        mesh = _with_cavities_inward(_mesh_of(read, region_names or {}, scale))
        check_mesh(mesh, surfaces, node_sets)
        mesh = with_mirror_nodes(_with_skin(mesh))
        mesh = _with_contact_points(mesh, contact_spacing_mm)
        check_mesh(mesh)  # now with its contact points
        check_upright(mesh)
        check_outwards(mesh)
        check_end_face(mesh)
    except MeshError as error:
        bare = "the mesh has: none" in str(error)
        way = "; a hub needs none of a leg's regions: --surfaces --node-sets" if bare else ""
        raise MeshError(f"mesh file {path}: {error}{way}") from error
    return mesh


def _mesh_of(read: Any, region_names: dict[int, str], scale: float) -> Mesh:
    """What was read, in mm and without the nodes that no tetrahedron uses.

    Raises:
        MeshError: It has no tetrahedra, or those of several volumes, or is of no plausible size.
    """
    tetrahedra = [block.data for block in read.cells if block.type == "tetra"]
    others = sorted({block.type for block in read.cells if block.dim == 3} - {"tetra"})
    if tetrahedra and others:
        raise MeshError(
            f"it holds {' and '.join(others)} cells beside linear tetrahedra, expected tetrahedra "
            "alone: the others would be left out of the solid"
        )
    if not tetrahedra:
        kinds = {block.type for block in read.cells}
        advice = []
        if kinds & _HIGHER_ORDER:
            advice.append(
                "save linear (first-order) elements (Mesh.ElementOrder = 1 in gmsh), to which "
                "--quadratic adds midside nodes"
            )
        if not others and kinds & {"triangle", *_HIGHER_ORDER}:
            advice.append(
                "fill the surface with a mesher (netgen, gmsh), or if it is filled, give the "
                "volume a physical group too, without which gmsh does not save it"
            )
        told = ", ".join(sorted(kinds)) or "none"
        raise MeshError(
            f"it holds no linear tetrahedra; its cells are: {told}"
            + (": " if advice else "")
            + "; ".join(advice)
        )
    check_one_volume(read)
    cells = np.concatenate(tetrahedra)
    triangles, sets = regions_of(read, region_names)
    used, compact = np.unique(cells, return_inverse=True)
    number = np.full(len(read.points), -1)
    number[used] = np.arange(len(used))
    for name, corners in triangles.items():
        if np.any(number[corners] < 0):
            raise MeshError(f"surface {name!r} has nodes that no tetrahedron uses")
    mesh = Mesh(
        nodes=np.asarray(read.points[used], dtype=float) * scale,
        tetrahedra=compact.reshape(cells.shape),
        surfaces={name: number[corners] for name, corners in triangles.items()},
        node_sets={name: np.unique(number[n][number[n] >= 0]) for name, n in sets.items()},
    )
    _check_extent(mesh, scale)
    return mesh


def _check_extent(mesh: Mesh, scale: float) -> None:
    """Refuse a mesh that is of no size that a robot's part has.

    Raises:
        MeshError: Its longest side is not between a millimetre and ten metres.
    """
    extent = mesh.longest_side_mm
    if not LEAST_EXTENT_MM <= extent <= LARGEST_EXTENT_MM:
        raise MeshError(
            f"it is {extent:g} mm long with a scale of {scale:g}, expected "
            f"{LEAST_EXTENT_MM:g} to {LARGEST_EXTENT_MM:g} mm: its unit may be another than mm; "
            "a scale of 1000 is that of metres, 25.4 of inches"
        )


def _with_cavities_inward(mesh: Mesh) -> Mesh:
    """Turn cavities round whose normals all leave the solid."""
    turned = {
        name: mesh.surfaces[name][:, ::-1]
        for name in cavity_regions(mesh)
        if enclosed_volume(mesh.nodes, mesh.surfaces[name]) < 0.0
    }
    return replace(mesh, surfaces={**mesh.surfaces, **turned}) if turned else mesh


def _with_skin(mesh: Mesh) -> Mesh:
    """Name the boundary without the cavities, unless the file did; its triangles look outwards,
    however they are given.

    Raises:
        MeshError: A triangle of the file's is none of that boundary.
    """
    outer = outer_boundary(mesh)
    if cavity_regions(mesh):
        _check_no_hole(mesh, outer)
    if "skin" in mesh.surfaces:
        outwards = {tuple(sorted(each)): each for each in outer.tolist()}
        own = [tuple(sorted(each)) for each in mesh.surfaces["skin"].tolist()]
        strange = sum(each not in outwards for each in own)
        if strange:
            raise MeshError(
                f"{strange} of {len(own)} triangles of the surface 'skin' are not on the outside "
                "of the solid, expected those alone that may touch the floor: cavities and the "
                "inside have none"
            )
        turned = [
            each if _same_way(each, outwards[tuple(sorted(each))]) else each[::-1]
            for each in mesh.surfaces["skin"].tolist()
        ]
        outer = np.array(turned)
    return replace(mesh, surfaces={**mesh.surfaces, "skin": outer})


def _check_no_hole(mesh: Mesh, outer: np.ndarray) -> None:
    """Refuse a solid with a closed hole that is no cavity: nothing would inflate it, and its wall
    would be skin.

    Raises:
        MeshError: It has one.
    """
    of_triangle = connected_pieces(outer, len(mesh.nodes))[outer[:, 0]]
    for each in np.unique(of_triangle):
        volume = enclosed_volume(mesh.nodes, outer[of_triangle == each])
        if volume < 0.0:
            known = ", ".join(cavity_regions(mesh))
            raise MeshError(
                f"the solid has a closed hole of {-volume:.4g} mm^3 that is in no cavity (they "
                f"are: {known}), expected each in a region whose name begins with cavity, such as "
                "cavity_left, or filled"
            )


def _same_way(first: list[int], second: list[int]) -> bool:
    """Whether two triangles of the same nodes look the same way."""
    return first in (second, second[1:] + second[:1], second[2:] + second[:2])


def _with_contact_points(mesh: Mesh, spacing_mm: float) -> Mesh:
    nodes = np.unique(mesh.surfaces["skin"])
    images = None
    if mesh.mirror_nodes is not None:
        images = np.searchsorted(nodes, mesh.mirror_nodes[nodes])
    outer = mesh.nodes[nodes]
    try:
        chosen = spread_points(outer, spacing_mm, flat=True, images=images)
        return replace(mesh, contact_points=outer[chosen])
    except ValueError as error:
        raise MeshError(f"the surface 'skin' has no contact points: {error}") from error
