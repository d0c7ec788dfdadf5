"""The same part in another size: exact, without a new reduction."""

from __future__ import annotations

import math
from dataclasses import replace

from pneumorph.reduction.reduced_part import ReducedPart


def resized_part(part: ReducedPart, size_factor: float) -> ReducedPart:
    """Scale all lengths of a part, the thickness of its sheets among them.

    With s times the lengths, deformation gradients are the same at s times the displacements, so
    stresses, and the pressure that bends it so, are the same. Material of the same density weighs
    s^3 as much; the stepper takes modes to be orthonormal in mass, so modes are Phi s^(-3/2) and
    coordinates s^(5/2) alpha. The mount's stiffness is that of a hub of s times the size: s times.

    Args:
        part: The reduced part.
        size_factor: s, new lengths over old.

    Raises:
        ValueError: The factor is not positive and finite.
    """
    if not (math.isfinite(size_factor) and size_factor > 0.0):
        raise ValueError(f"size_factor must be positive and finite, got {size_factor}")
    size, volume = size_factor, size_factor**3
    root = math.sqrt(volume)  # of the mass
    unit = size * root  # of a coordinate
    return replace(
        part,
        rest_nodes=size * part.rest_nodes,
        modes=part.modes / root,
        contact_points=size * part.contact_points,
        contact_modes=part.contact_modes / root,
        contact_area_mm2=size**2 * part.contact_area_mm2,
        contact_flexibility=part.contact_flexibility / size,
        tetrahedron_mode_gradient=part.tetrahedron_mode_gradient / unit,
        tetrahedron_measure=volume * part.tetrahedron_measure,
        membrane_mode_gradient=part.membrane_mode_gradient / unit,
        membrane_measure=volume * part.membrane_measure,
        # They are integrals over elements, divided by the square roots of their volumes.
        dilatation_1=root * part.dilatation_1 / unit,
        dilatation_2=root * part.dilatation_2 / unit**2,
        dilatation_3=root * part.dilatation_3 / unit**3,
        stretch_1=root * part.stretch_1 / unit,
        stretch_2=root * part.stretch_2 / unit**2,
        wall_axis=size * part.wall_axis,
        wall_axis_modes=part.wall_axis_modes / root,
        wall_pair=size * part.wall_pair,
        wall_pair_modes=part.wall_pair_modes / root,
        wall_pair_stiffness=size * part.wall_pair_stiffness,
        linear_stiffness=size * part.linear_stiffness / volume,
        cavity_volume=volume * part.cavity_volume,
        cavity_volume_1=volume * part.cavity_volume_1 / unit,
        cavity_volume_2=volume * part.cavity_volume_2 / unit**2,
        cavity_volume_3=volume * part.cavity_volume_3 / unit**3,
        mass=volume * part.mass,
        first_moment=volume * size * part.first_moment,
        first_moment_modes=root * part.first_moment_modes,
        second_moment=volume * size**2 * part.second_moment,
        second_moment_modes=unit * part.second_moment_modes,
        snapshot_range=part.snapshot_range / unit,
        metadata={
            **part.metadata,
            "size_factor": size_factor * part.metadata.get("size_factor", 1.0),
        },
    )
