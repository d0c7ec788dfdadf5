"""Read a user's own mesh: gmsh, VTK and whatever else meshio reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.optional_package import optional_package
from pneumorph.geometry.abaqus_file import check_abaqus_file
from pneumorph.geometry.attachment import OBLIQUE
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mirror_image import with_mirror_nodes
from pneumorph.geometry.outer_boundary import outer_boundary
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.spread_points import spread_points
from pneumorph.geometry.surface import connected_pieces, enclosed_volume

LEAST_EXTENT_MM, LARGEST_EXTENT_MM = 1.0, 10_000.0
"""Between which the longest side of a part's mesh is taken to be in mm."""

_NO_WAY = 1e-6
"""Between an end and the other, relative to the longest side."""

_DIMENSION_OF = {"vertex": 0, "line": 1, "triangle": 2}
"""Of the cells that make regions."""

_HIGHER_ORDER = {"triangle6", "triangle10", "triangle15", "tetra10", "tetra20", "tetra35"}
"""Triangles and tetrahedra with nodes on their edges, as meshio calls them."""

GMSH_FIELD = "gmsh:physical"
"""What meshio calls the numbers of gmsh's physical groups."""

REGION_FIELD = "region"
"""Name of the cell data that numbers the regions in formats without physical groups."""


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
    own mirror image about y = 0 gets ``mirror_nodes``, and contact points in mirrored pairs.

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
        _check_upright(mesh)
        _check_outwards(mesh)
        _check_end_face(mesh)
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
    _check_one_volume(read)
    cells = np.concatenate(tetrahedra)
    triangles, sets = _regions(read, region_names)
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


def _regions(
    read: Any, region_names: dict[int, str]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Triangles by region, and nodes by region, in the file's own numbering."""
    _check_numbers(read, region_names)
    triangles: dict[str, list[np.ndarray]] = {}
    nodes = {name: [np.asarray(own, dtype=int)] for name, own in read.point_sets.items()}
    for name, kind, members in _members(read, region_names):
        nodes.setdefault(name, []).append(members.ravel())
        if kind == "triangle":
            triangles.setdefault(name, []).append(members)
    return (
        {name: _each_once(np.concatenate(parts)) for name, parts in triangles.items()},
        {name: np.unique(np.concatenate(parts)) for name, parts in nodes.items()},
    )


def _each_once(triangles: np.ndarray) -> np.ndarray:
    """Triangles without those that were there before, whichever way they look, (triangle, 3)."""
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    once: np.ndarray = triangles[np.sort(first)]
    return once


def _check_one_volume(read: Any) -> None:
    """Refuse tetrahedra of several volumes, which may be of several materials. In gmsh's files
    physical groups count, of which 0 is none; its elementary entities may be several. Tetrahedra in
    no group beside those that are in one are a volume of their own.

    Raises:
        MeshError: There is more than one, and none of them holds all tetrahedra.
    """
    names, numbers, sets = _group_names(read), _region_numbers(read), _element_sets(read)
    gmsh = _tag_field(read) == GMSH_FIELD
    held: dict[str, int] = {}
    total = 0
    for place, block in enumerate(read.cells):
        if block.type != "tetra":
            continue
        total += len(block.data)
        here = {}
        for name, own in sets.items():
            here[repr(name)] = np.isin(np.arange(len(block.data)), own[place])
        for tag in np.unique(numbers[place]) if place < len(numbers) else ():
            called = names.get((int(tag), 3))
            if called not in sets and not (gmsh and tag == 0):
                here[str(int(tag)) if called is None else repr(called)] = numbers[place] == tag
        here["in none"] = ~np.any([np.zeros(len(block.data), dtype=bool), *here.values()], axis=0)
        for name, inside in here.items():
            held[name] = held.get(name, 0) + int(inside.sum())
    held = {name: count for name, count in held.items() if count}
    if len(held) > 1 and max(held.values()) < total:
        told = ", ".join(f"{name}: {count}" for name, count in sorted(held.items()))
        kind = "physical volume" if gmsh else "element set" if sets else "region"
        raise MeshError(
            f"its {total} tetrahedra are in {len(held)} {kind}s ({told}), expected one: a part has "
            f"one solid material; put all that is of it into one {kind}, and delete what is not, "
            "such as the air in a cavity, before meshing"
        )


def _check_numbers(read: Any, region_names: dict[int, str]) -> None:
    """Refuse to name a region that is not there, or that has a name.

    Raises:
        MeshError: No element has that number, or all that have it are in groups that the file
            itself calls otherwise.
    """
    names = _group_names(read)
    called: dict[int, set[str | None]] = {}
    for block, own in zip(read.cells, _region_numbers(read), strict=False):
        dimension = _DIMENSION_OF.get(block.type, block.dim)
        for tag in np.unique(own).tolist():
            called.setdefault(tag, set()).add(names.get((tag, dimension)))
    for number, name in region_names.items():
        if number not in called:
            known = ", ".join(map(str, sorted(called))) or "none"
            raise MeshError(
                f"no element is in region {number}, which is to be called {name!r}, expected one "
                f"of the file's: {known}"
            )
        own_names = called[number]
        if None not in own_names and name not in own_names:
            told = " and ".join(sorted(repr(each) for each in own_names))
            raise MeshError(
                f"region {number} is to be called {name!r}, and the file calls it {told}, expected "
                "a name only where the file has none; rename the group in the mesher"
            )


def _group_names(read: Any) -> dict[tuple[int, int], str]:
    """Names that the file gives to region numbers, by number and dimension."""
    return {(int(tag), int(dimension)): name for name, (tag, dimension) in read.field_data.items()}


def _tag_field(read: Any) -> str:
    """What the cell data that numbers the regions is called."""
    return GMSH_FIELD if GMSH_FIELD in read.cell_data else REGION_FIELD


def _region_numbers(read: Any) -> list[np.ndarray]:
    """Of each cell of each block, (cell,); empty where the file numbers none.

    Raises:
        MeshError: One is no whole number.
    """
    field = _tag_field(read)
    numbers = []
    for block, given in zip(read.cells, read.cell_data.get(field, ()), strict=False):
        own = np.asarray(given)
        with np.errstate(invalid="ignore"):
            whole = own.astype(np.int64)
        if own.size != len(block.data) or np.any(whole != own):
            strange = own[whole != own]
            told = f"of shape {own.shape}" if own.size != len(block.data) else f"{strange[0]:g}"
            raise MeshError(
                f"cell data {field!r} of its {block.type} cells are {told}, expected one whole "
                "number for each cell, that of its region"
            )
        numbers.append(whole.ravel())
    return numbers


def _element_sets(read: Any) -> dict[str, list[np.ndarray]]:
    """Named groups of gmsh's newer formats, in which an element may be in several, and element sets
    of Abaqus: which cells of each block are in them."""
    sets = {}
    for name, own in read.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        # A set that stands before other elements has nothing of those.
        parts = [*own, *[None] * (len(read.cells) - len(own))]
        sets[name] = [np.asarray([] if part is None else part, dtype=int) for part in parts]
    return sets


def _members(read: Any, region_names: dict[int, str]) -> Iterator[tuple[str, str, np.ndarray]]:
    """Regions' names with a kind of cell and its members' nodes."""
    names, groups = _group_names(read), _element_sets(read)
    for name, own in groups.items():
        for block, chosen in zip(read.cells, own, strict=True):
            if block.type in _DIMENSION_OF and len(chosen):
                yield name, block.type, block.data[chosen]
    for block, tags in zip(read.cells, _region_numbers(read), strict=False):
        if block.type not in _DIMENSION_OF:
            continue
        for tag in np.unique(tags).tolist():
            called = names.get((tag, _DIMENSION_OF[block.type])) or region_names.get(tag)
            if called is not None and (called not in groups or tag in region_names):
                yield called, block.type, block.data[tags == tag]


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


def _check_upright(mesh: Mesh) -> None:
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


def _check_outwards(mesh: Mesh) -> None:
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


def _check_end_face(mesh: Mesh) -> None:
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
