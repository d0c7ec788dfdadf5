"""Which cells of a mesh file are in which region: its groups, element sets and numbers, as meshio
gives them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from pneumorph.geometry.mesh import MeshError

_DIMENSION_OF = {"vertex": 0, "line": 1, "triangle": 2}
"""Of the cells that make regions."""

GMSH_FIELD = "gmsh:physical"
"""What meshio calls the numbers of gmsh's physical groups."""

REGION_FIELD = "region"
"""Name of the cell data that numbers the regions in formats without physical groups."""


def regions_of(
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


def check_one_volume(read: Any) -> None:
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
