"""Put modes and weighted elements of a full-order part together into a ReducedPart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.fem.cavity import Cavity
from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.face_tie import ATTACHMENT, ATTACHMENT_FACE
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.outer_boundary import outer_boundary
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import enclosed_centre
from pneumorph.reduction.cavity_polynomial import cavity_polynomial
from pneumorph.reduction.index_check import POINT_COUNTS
from pneumorph.reduction.inertia import mass_integrals
from pneumorph.reduction.mixed_dilatation import (
    MixedDilatation,
    every_element,
    mixed_dilatation,
)
from pneumorph.reduction.mixed_sheet import mixed_sheet
from pneumorph.reduction.reduced_part import CAVITY_CENTRES, ReducedPart
from pneumorph.reduction.sampled_elements import SampledElements


@dataclass(frozen=True)
class Cubature:
    """Which integration points of one group are summed over, and with which weight.

    ``element`` in names means such a point: a linear element is one, a quadratic one several.
    """

    index: np.ndarray
    """Numbers of the points in their group, ascending, (sampled,)."""
    weight: np.ndarray
    """Non-negative weights, (sampled,)."""

    @classmethod
    def every(cls, element_count: int) -> Cubature:
        """Every element with weight one: the unsampled model."""
        return cls(np.arange(element_count), np.ones(element_count))

    @classmethod
    def from_weights(cls, weight: np.ndarray) -> Cubature:
        """The elements whose entry of ``weight`` (element,) is positive."""
        index = np.flatnonzero(weight > 0.0)
        return cls(index, weight[index])


def sample_elements(
    group: ElementGroup, modes: np.ndarray, cubature: Cubature | None = None
) -> SampledElements:
    """Elements of a group in modal coordinates.

    Args:
        group: Elements of one kind.
        modes: Mode shapes, (node, 3, mode).
        cubature: Which elements and weights; every element with weight one if not given.
    """
    if cubature is None:
        cubature = Cubature.every(group.element_count)
    index = cubature.index
    element_modes = modes[group.connectivity[index]]  # (element, k, 3, mode)
    gradients = group.material_gradients[index]  # (element, k, d)
    return SampledElements(
        rest=group.rest_frame[index],
        mode_gradient=np.einsum("enim,end->eidm", element_modes, gradients, optimize=True),
        measure=cubature.weight * group.measure[index],
        material=group.material,
    )


def assemble_reduced_part(
    part: PartModel,
    modes: np.ndarray,
    cubatures: tuple[Cubature, ...] | None = None,
    contact_modes: np.ndarray | None = None,
    metadata: Mapping[str, Any] | None = None,
    mount_stiffness: np.ndarray | None = None,
    pressure_fields: np.ndarray | None = None,
    stress_fields: np.ndarray | None = None,
) -> ReducedPart:
    """Build the reduced part of given modes and sampled elements.

    Args:
        part: The full-order part: tetrahedra and at most one membrane.
        modes: Mass-orthonormal mode shapes, (node, 3, mode); zero at a rigid attachment. They
            are rounded to single precision first, so a saved part equals the one in memory.
        cubatures: Sampled elements of each of `sampled_groups`; every element with unit weight if
            not given (plain Galerkin projection).
        contact_modes: Mode shapes at the mesh's collision points, (point, 3, mode); interpolated
            in the tetrahedra if not given.
        metadata: Provenance and errors to record beside the mesh digest.
        mount_stiffness: Of a soft hub against the attachment nodes [mN/mm], (3 attachment, 3
            attachment); None where it is rigid.
        pressure_fields: Of a solid with mean dilatation the pressures that its volumes are seen by,
            (element, pressure), as `pressure_fields` of `mixed_dilatation.py` makes them; every
            element's own if not given.
        stress_fields: Of a stiff membrane the stresses that it is seen by, (3 point, stretch), as
            `stress_fields` of `mixed_sheet.py` makes them; None where its points are sampled.

    Raises:
        ValueError: Shapes disagree, the part has several membranes, or cavities that its mesh does
            not name so, or in another order.
    """
    mesh, groups = part.mesh, sampled_groups(part, stress_fields)
    if cubatures is None:
        cubatures = tuple(Cubature.every(group.element_count) for group in groups)
    _check(part, modes, len(groups), len(cubatures))
    modes = modes.astype(np.float32).astype(np.float64)
    solid_cubature, *membrane_cubatures = cubatures
    solid, *membranes = (
        sample_elements(group, modes, cubature)
        for group, cubature in zip(groups, cubatures, strict=True)
    )
    membrane_cubature = membrane_cubatures[0] if membranes else Cubature.every(0)
    membrane = membranes[0] if membranes else _no_membrane(part, modes.shape[2])
    stretches: dict[str, Any] = {}
    if stress_fields is not None:
        sheet = mixed_sheet(part.element_groups[1], mesh.nodes, modes, stress_fields)
        stretches = {"stretch_1": sheet.linear, "stretch_2": sheet.quadratic}
    integrals = mass_integrals(part.node_mass, mesh.nodes, modes)
    if contact_modes is None:
        weights = interpolation_matrix(mesh, mesh.contact_points)
        contact_modes = (weights @ modes.reshape(len(modes), -1)).reshape(-1, 3, modes.shape[2])
    dilatation = _dilatation(part, modes, pressure_fields)
    series = None if part.branches is None else part.branches.series
    return ReducedPart(
        rest_nodes=np.array(mesh.nodes, dtype=np.float64),
        modes=modes,
        skin=_closed_skin(mesh).astype(np.int32),
        tetrahedron_index=solid_cubature.index.astype(np.int32),
        tetrahedron_weight=solid_cubature.weight,
        tetrahedron_rest=solid.rest,
        tetrahedron_mode_gradient=solid.mode_gradient,
        tetrahedron_measure=solid.measure,
        tetrahedron_material=part.material,
        membrane_index=membrane_cubature.index.astype(np.int32),
        membrane_weight=membrane_cubature.weight,
        membrane_rest=membrane.rest,
        membrane_mode_gradient=membrane.mode_gradient,
        membrane_measure=membrane.measure,
        membrane_material=membrane.material,
        dilatation_1=dilatation.linear,
        dilatation_2=dilatation.quadratic,
        dilatation_3=dilatation.cubic,
        **stretches,
        relaxation_weight=np.array(() if series is None else series.weights),
        relaxation_time=np.array(() if series is None else series.times_s),
        linear_stiffness=_mount(part, modes, mount_stiffness),
        **_cavity_volumes(mesh, modes),
        **vars(integrals),
        contact_points=np.array(mesh.contact_points, dtype=np.float64).reshape(-1, 3),
        contact_modes=contact_modes,
        contact_surface=mesh.contact_surfaces.names,
        contact_area_mm2=mesh.contact_surfaces.area_mm2,
        metadata={
            **(metadata or {}),
            **_attachment(mesh),
            CAVITY_CENTRES: [
                enclosed_centre(mesh.nodes, mesh.surfaces[name]).tolist()
                for name in cavity_regions(mesh)
            ],
            POINT_COUNTS: _point_counts(part),
            "mesh_digest": mesh.digest(),
        },
    )


def _check(part: PartModel, modes: np.ndarray, group_count: int, cubature_count: int) -> None:
    part.check_cavities(some=True)
    nodes = part.mesh.nodes
    if modes.ndim != 3 or modes.shape[:2] != nodes.shape:
        raise ValueError(
            f"modes must have shape (node, 3, mode) with {len(nodes)} nodes, got "
            f"{modes.shape}; they may belong to another mesh"
        )
    sheets = len(part.element_groups) - 1
    if sheets > 1:
        raise ValueError(
            f"a part to be reduced may have one membrane, got {sheets}; a reduced "
            "part has one material for its tetrahedra and one for its membrane"
        )
    if cubature_count != group_count:
        raise ValueError(
            f"cubatures must name the sampled elements of each of the {group_count} element "
            f"groups, got {cubature_count}"
        )


def _cavity_volumes(mesh: Mesh, modes: np.ndarray) -> dict[str, Any]:
    """Volume of each cavity as a polynomial of the modes, as fields of a `ReducedPart`."""
    found = [
        cavity_polynomial(mesh.nodes, Cavity.of_surface(mesh.surface_connectivity(name)), modes)
        for name in cavity_regions(mesh)
    ]
    cube = (modes.shape[2],) * 3
    return {
        "cavity_volume": np.array([each.constant for each in found]),
        "cavity_volume_1": np.array([each.linear for each in found]).reshape(-1, *cube[:1]),
        "cavity_volume_2": np.array([each.quadratic for each in found]).reshape(-1, *cube[:2]),
        "cavity_volume_3": np.array([each.cubic for each in found]).reshape(-1, *cube),
    }


def sampled_groups(part: PartModel, stress_fields: np.ndarray | None) -> tuple[ElementGroup, ...]:
    """Element groups whose points are sampled: all but a membrane that is seen by its stress."""
    groups = tuple(part.element_groups)
    return groups if stress_fields is None else groups[:1]


def _dilatation(part: PartModel, modes: np.ndarray, fields: np.ndarray | None) -> MixedDilatation:
    """The changes of volume of a solid with mean dilatation, none of another's."""
    group = part.volume_group
    if group is None:
        shapes = [(0, *(modes.shape[2],) * power) for power in (1, 2, 3)]
        return MixedDilatation(0.0, *map(np.zeros, shapes))
    if fields is None:
        fields = every_element(group)
    if len(fields) != len(group.rest_volume):
        raise ValueError(
            f"pressure_fields must have a row for each of {len(group.rest_volume)} elements, got "
            f"{fields.shape}; they may belong to another mesh"
        )
    return mixed_dilatation(group, part.mesh.nodes, modes, fields)


def _mount(part: PartModel, modes: np.ndarray, stiffness: np.ndarray | None) -> np.ndarray:
    # Stiffness of the mount projected on the modes, (mode, mode).
    mode_count = modes.shape[2]
    if stiffness is None:
        return np.zeros((mode_count, mode_count))
    attached = modes[part.mesh.node_set("attachment")].reshape(-1, mode_count)
    if stiffness.shape != (len(attached), len(attached)):
        raise ValueError(
            f"mount_stiffness must have shape ({len(attached)}, {len(attached)}), three rows for "
            f"each attachment node, got {stiffness.shape}"
        )
    projected: np.ndarray = attached.T @ stiffness @ attached
    return 0.5 * (projected + projected.T)


def _attachment(mesh: Mesh) -> dict[str, list[int]]:
    """Which nodes are tied to what carries the part: a soft mount lets its modes move them."""
    sets = [mesh.node_sets[n] for n in (ATTACHMENT, ATTACHMENT_FACE) if n in mesh.node_sets]
    return {"attachment_nodes": np.unique(np.concatenate(sets)).tolist()} if sets else {}


def _point_counts(part: PartModel) -> dict[str, int]:
    """How many points there are to sample, by which the sampled ones are numbered."""
    kinds = ("tetrahedron", "membrane")
    groups = zip(kinds, part.element_groups, strict=False)
    return {kind: int(group.element_count) for kind, group in groups}


def _no_membrane(part: PartModel, mode_count: int) -> SampledElements:
    material = part.membranes[0].material if part.membranes else Material(1.0, 0.0)
    return SampledElements(
        np.zeros((0, 3, 2)), np.zeros((0, 3, 2, mode_count)), np.zeros(0), material
    )


def _closed_skin(mesh: Mesh) -> np.ndarray:
    """The mesh's skin, or all of its outside where that is a part of it alone: what a reduced part
    encloses is told by it."""
    skin, outer = mesh.surfaces["skin"], outer_boundary(mesh)
    return skin if len(skin) == len(outer) else outer
