"""A mesh of tetrahedra with named regions."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.base.notebook import ShownInNotebooks
from pneumorph.geometry.contact_surfaces import ContactSurfaces, surfaces_at
from pneumorph.geometry.region_names import (
    NODE_SETS,
    cavity_regions,
    current_name,
    first_name,
    with_current_names,
)
from pneumorph.geometry.surface import boundary_triangles, surface_area

LINEAR_VERSION, QUADRATIC_VERSION = 1, 2
"""Format versions of meshes without and with midside nodes."""

TETRAHEDRON_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
"""Ends of the edges that carry nodes 4 to 9 of a quadratic tetrahedron."""
TRIANGLE_EDGES = TETRAHEDRON_EDGES[:3]
"""Ends of the edges that carry nodes 3 to 5 of a quadratic triangle."""


class MeshError(ValueError):
    """A mesh cannot be computed with; the message says why."""


@dataclass(frozen=True, eq=False)
class Mesh(ShownInNotebooks):
    """Nodes, tetrahedra and named regions of a part, in the part's own frame.

    Args:
        nodes: Positions [mm], (node, 3).
        tetrahedra: Node indices, (element, 4); positive volume.
        surfaces: Triangles by region name, (triangle, 3). ``cavity`` is closed with its normals out
            of the cavity, into the solid; ``sheet`` is a membrane; ``skin`` is the outer boundary
            with its normals outward. A region ``paper`` of an earlier version becomes ``sheet``.
        node_sets: Node indices by region name, (n,).
        contact_points: Where the part can touch the ground [mm], (point, 3).
        mirror_nodes: Index of each node's image under y -> -y, (node,); None without symmetry.
        edge_nodes: Midside nodes of quadratic tetrahedra on their edges 01 12 20 03 13 23,
            (element, 6); None for linear ones.

    Raises:
        MeshError: An array has a wrong shape, or an index points outside the mesh.
    """

    nodes: Float[np.ndarray, "node 3"]
    tetrahedra: Int[np.ndarray, "element 4"]
    surfaces: Mapping[str, Int[np.ndarray, "_ 3"]] = field(default_factory=dict)
    node_sets: Mapping[str, Int[np.ndarray, " _"]] = field(default_factory=dict)
    contact_points: Float[np.ndarray, "point 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    mirror_nodes: Int[np.ndarray, " node"] | None = None
    edge_nodes: Int[np.ndarray, "element 6"] | None = None

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("nodes", _array("nodes", self.nodes, (None, 3), np.float64))
        put("contact_points", _array("contact_points", self.contact_points, (None, 3), np.float64))
        if not np.all(np.isfinite(self.nodes)):
            node = int(np.flatnonzero(~np.isfinite(self.nodes).all(axis=1))[0])
            raise MeshError(f"nodes must be finite, got {self.nodes[node]} for node {node}")
        count = len(self.nodes)
        put("tetrahedra", _indices("tetrahedra", self.tetrahedra, (None, 4), count))
        for name, kind, shape in (
            ("surfaces", "surface", (None, 3)),
            ("node_sets", "node set", (None,)),
        ):
            regions = with_current_names(getattr(self, name)).items()
            put(name, {k: _indices(f"{kind} {k!r}", v, shape, count) for k, v in regions})
        for name, whole in (("mirror_nodes", (count,)), ("edge_nodes", (len(self.tetrahedra), 6))):
            if getattr(self, name) is not None:
                put(name, _indices(name, getattr(self, name), whole, count))

    def __repr__(self) -> str:
        order = "linear" if self.edge_nodes is None else "quadratic"
        size = np.ptp(self.nodes, axis=0) if len(self.nodes) else np.zeros(3)
        regions = ", ".join(dict.fromkeys([*self.surfaces, *self.node_sets])) or "none"
        return (
            f"Mesh({len(self.nodes)} nodes, {len(self.tetrahedra)} {order} tetrahedra, "
            f"{size[0]:.3g} x {size[1]:.3g} x {size[2]:.3g} mm, regions {regions})"
        )

    @property
    def connectivity(self) -> np.ndarray:
        """All nodes of each tetrahedron, corners first, (element, 4 or 10)."""
        if self.edge_nodes is None:
            return self.tetrahedra
        return np.hstack([self.tetrahedra, self.edge_nodes])

    def surface_connectivity(self, name: str) -> np.ndarray:
        """All nodes of a region's triangles, midside nodes on the edges 01 12 20, (n, 3 or 6).

        Raises:
            MeshError: No such region, or one of its edges belongs to no tetrahedron.
        """
        triangles = self.surface(name)
        if self.edge_nodes is None:
            return triangles
        keys, middles = self._edges
        wanted = edge_keys(triangles, TRIANGLE_EDGES, len(self.nodes))
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        if not np.array_equal(keys[place], wanted):
            raise MeshError(
                f"surface {name!r} has an edge that belongs to no tetrahedron; was it meshed apart "
                "from the solid?"
            )
        return np.hstack([triangles, middles[place]])

    @cached_property
    def _edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Keys of all edges, ascending, and the nodes in their middle."""
        assert self.edge_nodes is not None
        keys, first = np.unique(
            edge_keys(self.tetrahedra, TETRAHEDRON_EDGES, len(self.nodes)), return_index=True
        )
        return keys, self.edge_nodes.ravel()[first]

    def surface(self, name: str) -> np.ndarray:
        """Triangles of a region, (triangle, 3).

        Raises:
            MeshError: No such region.
        """
        return _region("surface region", self.surfaces, name)

    def node_set(self, name: str) -> np.ndarray:
        """Nodes of a region, (n,).

        Raises:
            MeshError: No such region.
        """
        return _region("node set", self.node_sets, name)

    @cached_property
    def contact_surfaces(self) -> ContactSurfaces:
        """Which of the surface regions, cavities aside, each contact point lies on."""
        within = (*cavity_regions(self), *NODE_SETS)
        outer = {k: v for k, v in self.surfaces.items() if k not in within}
        outer = outer or {"": boundary_triangles(self.tetrahedra)}
        return surfaces_at(self.nodes, outer, self.contact_points)

    @property
    def longest_side_mm(self) -> float:
        """The longest side of the box around it along the axes [mm]."""
        return float(np.ptp(self.nodes, axis=0).max())

    @property
    def skin_area_mm2(self) -> float:
        """Area of the region ``skin``, or else of all of the boundary [mm^2]."""
        skin = self.surfaces.get("skin")
        return surface_area(
            self.nodes, boundary_triangles(self.tetrahedra) if skin is None else skin
        )

    def node_areas(self, nodes: np.ndarray) -> np.ndarray:
        """Area of a part of the skin that each node stands for [mm^2], (node,): the integral of its
        shape function, of quadratic faces a third at each midside and nothing at the corners.

        Args:
            nodes: Numbers of the nodes that the part's triangles lie between.

        Raises:
            MeshError: The mesh has no region ``skin``.
        """
        there = np.isin(np.arange(len(self.nodes)), nodes)
        skin = self.surface_connectivity("skin")
        face = skin[np.all(there[skin], axis=1)]
        a, b, c = (self.nodes[face[:, corner]] for corner in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        takers = face if face.shape[1] == 3 else face[:, 3:]
        areas: np.ndarray = np.bincount(
            takers.ravel(), np.repeat(area / 3.0, 3), minlength=len(self.nodes)
        )
        return areas

    @cached_property
    def volumes(self) -> np.ndarray:
        """Signed volume of each tetrahedron [mm^3], (element,)."""
        first = self.nodes[self.tetrahedra[:, 0]]
        a, b, c = (self.nodes[self.tetrahedra[:, corner]] - first for corner in (1, 2, 3))
        volumes: np.ndarray = np.einsum("ei,ei->e", np.cross(a, b), c) / 6.0
        return volumes

    def scaled(self, factor: float) -> Mesh:
        """The same mesh of another size; its frame's origin stays.

        Args:
            factor: New lengths over the old, positive.
        """
        return replace(self, nodes=factor * self.nodes, contact_points=factor * self.contact_points)

    def digest(self) -> str:
        """SHA-256 of everything in the mesh, in hexadecimal; names what was made from it."""
        digest = hashlib.sha256()
        for name, array in self._arrays(first_name).items():
            digest.update(f"{name}{array.shape}{array.dtype}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def save(self, path: Path | str, metadata: Mapping[str, Any] | None = None) -> Path:
        """Write the mesh as an artefact; `metadata` may hold the shape that made it."""
        return save_artefact(
            path,
            "Mesh",
            LINEAR_VERSION if self.edge_nodes is None else QUADRATIC_VERSION,
            self._arrays(),
            {**(metadata or {}), "digest": self.digest()},
        )

    @classmethod
    def load(cls, path: Path | str) -> Mesh:
        """Read what `save` wrote.

        Raises:
            ArtefactError: The file is truncated, of another kind or of another format version, or
                a mesher's.
        """
        try:
            arrays, _ = load_artefact(path, "Mesh", LINEAR_VERSION, QUADRATIC_VERSION)
        except ArtefactError as error:
            if Path(path).suffix.lower() in (".npz", ""):
                raise
            raise ArtefactError(
                f"{error}; a mesher's file becomes one by: pneumorph mesh --file {path}"
            ) from error

        def named(prefix: str) -> dict[str, np.ndarray]:
            return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}

        with reading(path, "Mesh"):
            return cls(
                nodes=arrays["nodes"],
                tetrahedra=arrays["tetrahedra"],
                surfaces=named("surface:"),
                node_sets=named("node_set:"),
                contact_points=arrays["contact_points"],
                mirror_nodes=arrays.get("mirror_nodes"),
                edge_nodes=arrays.get("edge_nodes"),
            )

    def _arrays(self, called: Callable[[str], str] = str) -> dict[str, np.ndarray]:
        """Everything by name; regions as `called` renames them, in that order."""
        arrays = {"nodes": self.nodes, "tetrahedra": self.tetrahedra}
        for kind, regions in (("surface", self.surfaces), ("node_set", self.node_sets)):
            for name in sorted(regions, key=called):
                arrays[f"{kind}:{called(name)}"] = regions[name]
        arrays["contact_points"] = self.contact_points
        if self.mirror_nodes is not None:
            arrays["mirror_nodes"] = self.mirror_nodes
        if self.edge_nodes is not None:
            arrays["edge_nodes"] = self.edge_nodes
        return arrays


def edge_keys(cells: np.ndarray, edges: Sequence[tuple[int, int]], node_count: int) -> np.ndarray:
    """One number for each edge of each cell, whichever end comes first, (cell, edge).

    Args:
        cells: Node indices, (cell, corner).
        edges: Ends of the edges among the corners.
        node_count: Number of nodes.
    """
    first, second = np.array(edges).T
    ends = np.sort(np.stack([cells[:, first], cells[:, second]]).astype(np.int64), axis=0)
    keys: np.ndarray = ends[0] * node_count + ends[1]
    return keys


def _region(kind: str, regions: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    name = current_name(name)
    if name not in regions:
        known = ", ".join(sorted(regions)) or "none"
        raise MeshError(f"unknown {kind} {name!r}; the mesh has: {known}")
    return regions[name]


def _array(name: str, value: Any, shape: tuple[int | None, ...], dtype: type) -> np.ndarray:
    array: np.ndarray = np.array(value, dtype=dtype)
    matches = array.ndim == len(shape) and all(
        wanted is None or wanted == got for wanted, got in zip(shape, array.shape, strict=True)
    )
    if not matches:
        expected = ", ".join("n" if wanted is None else str(wanted) for wanted in shape)
        raise MeshError(f"{name} must have shape ({expected}), got {array.shape}")
    return array


def _indices(name: str, value: Any, shape: tuple[int | None, ...], count: int) -> np.ndarray:
    array = _array(name, value, shape, np.int32)
    if array.size and (array.min() < 0 or array.max() >= count):
        raise MeshError(
            f"{name} must hold node indices 0 .. {count - 1}, got {array.min()} .. {array.max()}; "
            "gmsh counts from 1"
        )
    return array
