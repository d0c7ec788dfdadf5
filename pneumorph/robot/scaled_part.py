"""The same part of a stiffer or heavier material: exact, without a new reduction."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.robot import Hub, Robot

REDUCED_SO = "reduced_so"
"""Name in a part's metadata of whether its factors (``scaled``, ``size_factor``) were in the finite
elements already that it was reduced from."""


def scaled_part(
    part: ReducedPart,
    modulus_factor: float = 1.0,
    mass_factor: float = 1.0,
    damping_factor: float = 1.0,
) -> ReducedPart:
    """Scale all moduli, all masses and all that relaxes of a part.

    Elastic forces are linear in the moduli. The stepper takes modes to be orthonormal in mass, so a
    heavier part has modes Phi / sqrt(m) and coordinates sqrt(m) alpha: the same motions, written in
    other units. The mount's stiffness is the hub's: it stays as it is.

    Args:
        part: The reduced part.
        modulus_factor: New Young's moduli (of solid and membrane) over the old.
        mass_factor: New mass over the old.
        damping_factor: Stiffness of each branch that relaxes over the relaxed one, new over old.

    Raises:
        ValueError: A factor is not positive and finite.
    """
    factors = {
        "modulus_factor": modulus_factor,
        "mass_factor": mass_factor,
        "damping_factor": damping_factor,
    }
    for name, value in factors.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be positive and finite, got {value}")
    if damping_factor == 1.0:
        del factors["damping_factor"]  # as parts that were scaled before there was such
    before = part.metadata.get("scaled", {})
    factors = {name: before.get(name, 1.0) * factors.get(name, 1.0) for name in before | factors}
    root = math.sqrt(mass_factor)
    series = None if part.relaxation is None else part.relaxation.scaled(damping_factor)
    weights = part.relaxation_weight if series is None else np.array(series.weights)
    return replace(
        part,
        modes=part.modes / root,
        contact_modes=part.contact_modes / root,
        contact_flexibility=part.contact_flexibility / modulus_factor,
        tetrahedron_mode_gradient=part.tetrahedron_mode_gradient / root,
        membrane_mode_gradient=part.membrane_mode_gradient / root,
        tetrahedron_material=part.tetrahedron_material.stiffer(modulus_factor),
        membrane_material=part.membrane_material.stiffer(modulus_factor),
        relaxation_weight=weights,
        dilatation_1=part.dilatation_1 / root,
        dilatation_2=part.dilatation_2 / root**2,
        dilatation_3=part.dilatation_3 / root**3,
        stretch_1=part.stretch_1 / root,
        stretch_2=part.stretch_2 / root**2,
        wall_axis_modes=part.wall_axis_modes / root,
        wall_pair_modes=part.wall_pair_modes / root,
        wall_pair_stiffness=modulus_factor * part.wall_pair_stiffness,
        linear_stiffness=part.linear_stiffness / mass_factor,
        cavity_volume_1=part.cavity_volume_1 / root,
        cavity_volume_2=part.cavity_volume_2 / root**2,
        cavity_volume_3=part.cavity_volume_3 / root**3,
        mass=part.mass * mass_factor,
        first_moment=part.first_moment * mass_factor,
        first_moment_modes=part.first_moment_modes * root,
        second_moment=part.second_moment * mass_factor,
        second_moment_modes=part.second_moment_modes * root,
        snapshot_range=part.snapshot_range / root,
        # sum (m m_i) (Phi / sqrt m)(Phi / sqrt m) is what it was.
        metadata={
            **part.metadata,
            "scaled": factors,
        },
    )


def factors_between(part: ReducedPart, own: ReducedPart) -> tuple[float, float, float, float]:
    """What makes a reduction of the same leg as large, stiff, heavy and damped as another one, in
    relation to what they were reduced from: factors on size, modulus, mass and damping.

    Args:
        part: Another reduction of the leg, as its file has it.
        own: The one that a robot has, perhaps weighed, resized or calibrated since.
    """
    ours, theirs = (
        {"size_factor": each.metadata.get("size_factor", 1.0)} | each.metadata.get("scaled", {})
        for each in (own, part)
    )
    size, modulus, damping = (
        float(ours.get(name, 1.0) / theirs.get(name, 1.0))
        for name in ("size_factor", "modulus_factor", "damping_factor")
    )
    return size, modulus, own.mass / (part.mass * size**3), damping


def factors_reduced_in(own: ReducedPart) -> dict[str, Any]:
    """What another reduction says of itself, in its metadata, that is made from finite elements as
    they are now: its factors on modulus, damping and size; nothing where there are none.

    What it weighs is a number of the part itself.

    Args:
        own: The reduced part that stands for them now.
    """
    scaled = {
        name: factor
        for name, factor in own.metadata.get("scaled", {}).items()
        if name != "mass_factor" and factor != 1.0
    }
    size = own.metadata.get("size_factor", 1.0)
    found: dict[str, Any] = {"scaled": scaled} if scaled else {}
    if size != 1.0:
        found["size_factor"] = size
    return {**found, REDUCED_SO: True} if found else {}


def as_made_first(part: ReducedPart, mesh: Mesh | None = None) -> ReducedPart:
    """A part that was reduced from finite elements of a calibrated or resized leg
    (`factors_reduced_in`) as a reduction of the leg before, for a robot to calibrate and resize it
    as it asks for; any other part as it is. It keeps what it weighs for its volume.

    Args:
        part: The reduced part, as its file has it.
        mesh: That of the leg before; a part of it says so again.
    """
    if not part.metadata.get(REDUCED_SO, False):
        return part
    scaled, size = part.metadata.get("scaled", {}), part.metadata.get("size_factor", 1.0)
    first = scaled_part(
        part,
        modulus_factor=1.0 / scaled.get("modulus_factor", 1.0),
        damping_factor=1.0 / scaled.get("damping_factor", 1.0),
    )
    said = (REDUCED_SO, "scaled", "size_factor")
    metadata = {name: value for name, value in part.metadata.items() if name not in said}
    if size != 1.0:
        first = resized_part(first, 1.0 / size)
        if mesh is not None and metadata.get("mesh_digest") == mesh.scaled(size).digest():
            metadata["mesh_digest"] = mesh.digest()
            first = replace(first, rest_nodes=np.array(mesh.nodes))  # without rounding
    return replace(first, metadata=metadata)


def made_alike(part: ReducedPart, own: ReducedPart) -> ReducedPart:
    """Another reduction of a leg as large, stiff, heavy and damped as a given one; arguments as of
    `factors_between`."""
    return with_factors(part, *factors_between(part, own))


def with_factors(part: ReducedPart, size: float, *factors: float) -> ReducedPart:
    """A part of another size and of other modulus, mass and damping, by the factors that
    `factors_between` gives; the same where all are 1."""
    part = part if size == 1.0 else resized_part(part, size)
    return part if factors == (1.0, 1.0, 1.0) else scaled_part(part, *factors)


def scaled_hub(hub: Hub, mass_factor: float) -> Hub:
    """The same hub of another mass."""
    return replace(
        hub,
        mass=hub.mass * mass_factor,
        first_moment=hub.first_moment * mass_factor,
        second_moment=hub.second_moment * mass_factor,
    )


def scaled_robot(robot: Robot, modulus_factor: float = 1.0, mass_factor: float = 1.0) -> Robot:
    """The same robot of other material; a part mounted many times is scaled once."""
    parts = {
        id(mount.part): scaled_part(mount.part, modulus_factor, mass_factor)
        for mount in robot.mounts
    }
    return replace(
        robot,
        hub=scaled_hub(robot.hub, mass_factor),
        mounts=tuple(replace(mount, part=parts[id(mount.part)]) for mount in robot.mounts),
    )
