"""A part under pressure as an input deck of CalculiX."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from calculix_laws import MILLIPASCAL, material_card, sheet_card

from pneumorph.fem.material import Material, Membrane
from pneumorph.geometry.mesh import Mesh

FACES = {"P1": (0, 1, 2), "P2": (0, 3, 1), "P3": (1, 3, 2), "P4": (2, 3, 0)}
"""CalculiX's names of a tetrahedron's faces, by corners; pressure P pushes on the face."""


@dataclass(frozen=True)
class CalculixSettings:
    """How CalculiX seeks an equilibrium."""

    largest_correction: float = 1e-6
    """A state counts as found when the last correction of any displacement is at most this share of
    the increment's largest displacement. CalculiX leaves the turning of the pressure out of its
    tangent, so corrections shrink by a constant factor (0.58 at 10 kPa, nearer 1 above), and its
    residual is that of the load before the correction: only this test tells how near it is."""
    largest_residual: float = 1e-6
    """And when no force is out of balance by more than this share of the mean one."""
    iteration_limit: int = 1000
    """Iterations for one increment."""
    first_increment: float = 1.0
    """Share of a pressure step that is tried at once."""


def calculix_deck(
    mesh: Mesh,
    material: Material,
    pressures_kPa: Sequence[float],
    *,
    held: str = "inner_end_face",
    cavity: str = "cavity",
    membranes: Sequence[Membrane] = (),
    settings: CalculixSettings | None = None,
) -> str:
    """Text of a deck: one static step for each pressure, displacements of all nodes after each.

    Lengths are mm; stresses are mPa, see `calculix_laws.MILLIPASCAL`. Nodes and elements are
    numbered from 1 in the mesh's order.

    Args:
        mesh: The part, linear or quadratic.
        material: The solid; its law must be one of `calculix_laws`.
        pressures_kPa: Pressures, one after the other [kPa].
        held: Node set that does not move.
        cavity: Surface region under pressure.
        membranes: Sheets on surface regions that lie in planes of constant z, see `sheet_card`.
        settings: How the equilibrium is sought.

    Raises:
        ValueError: CalculiX has no such law, or a triangle of the cavity is no element's face.
    """
    settings = settings or CalculixSettings()
    order = "10" if mesh.edge_nodes is not None else "4"
    parts = ["*NODE, NSET=ALL", _rows(mesh.nodes)]
    parts += [f"*ELEMENT, TYPE=C3D{order}, ELSET=SOLID", _elements(mesh.connectivity, 1)]
    name, card = material_card("SOLID", material)
    parts += [card, f"*SOLID SECTION, ELSET=SOLID, MATERIAL={name}"]
    first = len(mesh.tetrahedra) + 1
    for number, membrane in enumerate(membranes):
        triangles = mesh.surface_connectivity(membrane.surface)
        sheet = f"SHEET{number}"
        card, thickness = sheet_card(sheet, membrane)
        parts += [
            f"*ELEMENT, TYPE=S{triangles.shape[1]}, ELSET={sheet}",
            _elements(triangles, first),
            card,
            f"*SHELL SECTION, ELSET={sheet}, MATERIAL={sheet}",
            f"{thickness:.12e}",
        ]
        first += len(triangles)
    parts += ["*NSET, NSET=HELD", _list(mesh.node_set(held) + 1), "*BOUNDARY", "HELD, 1, 3"]
    loaded = _loaded_faces(mesh, cavity)
    for face, elements in loaded.items():
        parts += [f"*ELSET, ELSET=LOADED_{face}", _list(elements + 1)]
    for pressure in pressures_kPa:
        parts += _step(pressure, list(loaded), settings)
    return "\n".join(parts) + "\n"


def _step(pressure_kPa: float, faces: list[str], settings: CalculixSettings) -> list[str]:
    residual, limit = settings.largest_residual, settings.iteration_limit
    return [
        "*STEP, NLGEOM, INC=1000",
        "*STATIC",
        f"{settings.first_increment}, 1., 1e-4, 1.",
        # In CalculiX's order: residual, correction, (two averages), residual after 9 iterations,
        # (two of parts without force), residual that would do whatever the correction.
        "*CONTROLS, PARAMETERS=FIELD",
        f"{residual}, {settings.largest_correction}, , , {residual}, , , 1e-20",
        # Iterations before divergence is looked for, twice; then the limit, and when to step less.
        "*CONTROLS, PARAMETERS=TIME INCREMENTATION",
        f"{limit}, {limit}, {limit}, {limit}, {limit}, 4",
        "*DLOAD",
        *(f"LOADED_{face}, {face}, {pressure_kPa * MILLIPASCAL:.12e}" for face in faces),
        "*NODE PRINT, NSET=ALL, FREQUENCY=1000",
        "U",
        "*END STEP",
    ]


def _loaded_faces(mesh: Mesh, region: str) -> dict[str, np.ndarray]:
    """Elements of a region's triangles by the name of the face that the triangle is."""
    wanted = np.sort(mesh.surface(region), axis=1)
    wanted_keys = {tuple(triangle) for triangle in wanted.tolist()}
    result = {}
    for face, corners in FACES.items():
        triangles = np.sort(mesh.tetrahedra[:, corners], axis=1).tolist()
        result[face] = np.flatnonzero([tuple(triangle) in wanted_keys for triangle in triangles])
    found = sum(len(elements) for elements in result.values())
    if found != len(wanted):
        raise ValueError(
            f"each of the {len(wanted)} triangles of surface {region!r} must be the face of one "
            f"tetrahedron, got {found} such faces; does the region lie inside the solid?"
        )
    return {face: elements for face, elements in result.items() if len(elements)}


def _rows(nodes: np.ndarray) -> str:
    return "\n".join(
        f"{number}, {x:.12e}, {y:.12e}, {z:.12e}"
        for number, (x, y, z) in enumerate(nodes.tolist(), start=1)
    )


def _elements(connectivity: np.ndarray, first: int) -> str:
    return "\n".join(
        f"{number}, " + ", ".join(map(str, nodes))
        for number, nodes in enumerate((connectivity + 1).tolist(), start=first)
    )


def _list(numbers: Iterable[int]) -> str:
    return "\n".join(f"{number}," for number in numbers)
