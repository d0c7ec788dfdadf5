"""Compliance of a part's tip: how far it gives way under small forces, while it is inflated.

    C_ij = d(mean displacement of the outer end face along i) / d(force along j),

with forces even over the face, the attachment held, at an equilibrium of free bending. A basis may
follow every pressure and still resist forces that its snapshots had none of: in linear modes a
stiff sheet and a nearly incompressible solid lock. What a leg does under the weight of a robot is
decided here, so a reduction is measured by it.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.cavity import Pressure
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.blocked_force import even_load
from pneumorph.reduction.modal_equilibrium import modal_tangent
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.tip_answers import answers_at


def tip_compliance(
    part: PartModel,
    x: np.ndarray,
    pressure_kPa: Pressure,
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> np.ndarray:
    """Of finite elements [mm/mN], (3, 3).

    Args:
        part: The part.
        x: Equilibrium of free bending [mm], (node, 3).
        pressure_kPa: Its pressure [kPa], or that of each cavity.
        rotation: Where elements take their rotation from.
        region: Node set of the outer end face.

    Raises:
        MeshError: No face of the mesh's skin lies in the region.
        UnstableError: The equilibrium is not stable.
    """
    moved = answers_at(part, x, pressure_kPa, rotation, region)
    compliance: np.ndarray = np.einsum("n,nik->ik", even_load(part.mesh, region), moved)
    return compliance


def reduced_tip_compliance(
    part: ReducedPart,
    mesh: Mesh,
    alpha: np.ndarray,
    pressure_kPa: np.ndarray,
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> np.ndarray:
    """The same of a reduced part at its own equilibrium [mm/mN], (3, 3).

    Args:
        part: The reduced part.
        mesh: Its mesh.
        alpha: Modal coordinates of the equilibrium, (mode,).
        pressure_kPa: Pressure of each cavity, (cavity,).
        rotation: Where elements take their rotation from.
        region: Node set of the outer end face.

    Raises:
        MeshError: No face of the mesh's skin lies in the region.
    """
    tip = np.einsum("n,nim->im", even_load(mesh, region), part.modes)
    tangent = modal_tangent(part, alpha, pressure_kPa, rotation)
    compliance: np.ndarray = tip @ np.linalg.solve(tangent, tip.T)
    return compliance
