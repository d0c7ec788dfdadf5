"""How contact points of a part give way beyond its modes: its residual flexibility.

Modes of a whole leg show little of how rubber is pressed in where it touches the floor, nor all of
what a force does to the rest of it. What K^-1 has and the modes do not,

    R = H (K^-1 - Phi (Phi^T K Phi)^-1 Phi^T) H^T,

is taken quasi-statically, as the residual flexibility of structural dynamics (MacNeal, A hybrid
method of component mode synthesis, Computers and Structures 1 (1971) 581; Rubin, Improved
component-mode representation for structural dynamic analysis, AIAA Journal 13 (1975) 995): H takes
the nodes' motion to the contact points. It is found at rest, in the attachment's frame. A leg's
tip turns by more than a right angle, so what is kept of each pair of points is the mean over the
directions, a third of the trace, which no turn changes; of the whole matrix the part that gives no
energy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static_answers import static_answers
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.reduction.modal_equilibrium import modal_tangent
from pneumorph.reduction.reduced_part import ReducedPart


def contact_flexibility(part: PartModel, reduced: ReducedPart) -> np.ndarray:
    """Residual flexibility of a part's contact points at rest, alike in all directions.

    Args:
        part: The part as finite elements, with the reduction's mesh and materials.
        reduced: The reduction.

    Returns:
        Symmetric and positive semi-definite [mm/mN], (point, point).

    Raises:
        ArtefactError: The reduction is of another part.
    """
    reduced.check_model(part)
    mesh, count = part.mesh, len(part.mesh.contact_points)
    weights = interpolation_matrix(mesh, mesh.contact_points).toarray()
    forces = np.zeros((part.node_count, 3, count, 3))
    for axis in range(3):
        forces[:, axis, :, axis] = weights.T
    moved = static_answers(
        part, part.rest_nodes, 0.0, FaceTie.of(mesh).nodes, forces.reshape(part.node_count, 3, -1)
    ).reshape(forces.shape)
    whole = np.einsum("pn,naqa->pq", weights, moved)
    rest = np.zeros(reduced.mode_count)
    tangent = modal_tangent(reduced, rest, np.zeros(reduced.cavity_count))
    modes = reduced.contact_modes
    shown = np.linalg.solve(tangent, modes.reshape(3 * count, -1).T).reshape(-1, count, 3)
    residual = (whole - np.einsum("pam,mqa->pq", modes, shown)) / 3.0
    values, vectors = np.linalg.eigh(0.5 * (residual + residual.T))
    flexibility = (vectors * np.maximum(values, 0.0)) @ vectors.T
    symmetric: np.ndarray = 0.5 * (flexibility + flexibility.T)
    return symmetric


def with_contact_flexibility(part: PartModel, reduced: ReducedPart) -> ReducedPart:
    """The reduction with the residual flexibility of its contact points; raises as
    `contact_flexibility`."""
    return replace(reduced, contact_flexibility=contact_flexibility(part, reduced))
