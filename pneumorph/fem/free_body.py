"""How a body that nothing holds deforms under loads: they are balanced by its own inertia."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from pneumorph.fem.assembly import matrix_of_blocks
from pneumorph.fem.element_stiffness import full_matrices, rotated_stiffness_entries
from pneumorph.fem.part_model import PartModel


def rigid_motions(points: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Displacements of points under unit translations and small turns about a centre.

    Args:
        points: Positions [mm], (point, 3).
        centre: What the turns are about [mm], (3,).

    Returns:
        Three translations [mm/mm], then three turns [mm/rad], (point, 3, 6).
    """
    motions = np.zeros((len(points), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], points - centre)
    return motions


def free_body_displacements(part: PartModel, forces: np.ndarray) -> np.ndarray:
    """Small displacements of a free body, without the rigid motion that the loads cause.

    Inertia relief: u = P K^+ P^T f, with K the stiffness at rest and P what removes rigid motions
    in the mass norm, so P^T takes from the loads what accelerates the body as a whole. Balanced
    loads need no support: six unknowns are held, which then carry nothing.

    Args:
        part: The body; its stiffness is that at rest.
        forces: Loads on the nodes [mN], (node, 3, case).

    Returns:
        Displacements [mm], (node, 3, case), whose mean by mass neither moves nor turns.

    Raises:
        ValueError: Forces of another shape, or elements whose volume is taken as a whole.
    """
    nodes, mass = part.rest_nodes, part.node_mass
    if forces.ndim != 3 or forces.shape[:2] != nodes.shape:
        raise ValueError(f"forces must have shape ({len(nodes)}, 3, case), got {forces.shape}")
    if part.volume_group is not None:
        raise ValueError("the part has mean dilatation, expected a solid without")
    rigid = rigid_motions(nodes, mass @ nodes / mass.sum()).reshape(-1, 6)
    weighted = np.repeat(mass, 3)[:, None] * rigid
    inertia = rigid.T @ weighted
    load = forces.reshape(len(rigid), -1)
    balanced = load - weighted @ np.linalg.solve(inertia, rigid.T @ load)
    free = np.setdiff1d(np.arange(len(rigid)), _six_unknowns(nodes))
    factor = splu(
        _stiffness(part)[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    moved = np.zeros_like(balanced)
    moved[free] = factor.solve(balanced[free])
    moved -= rigid @ np.linalg.solve(inertia, weighted.T @ moved)
    result: np.ndarray = moved.reshape(forces.shape)
    return result


def _stiffness(part: PartModel) -> csr_array:
    """Stiffness at rest, by rows (3 node, 3 node) [mN/mm]; no pattern is kept for later."""
    blocks = [
        (
            group.connectivity,
            full_matrices(rotated_stiffness_entries(group, part.rest_nodes, "polar")),
        )
        for group in part.element_groups
    ]
    return matrix_of_blocks(part.node_count, blocks).tocsr()


def _six_unknowns(nodes: np.ndarray) -> np.ndarray:
    """Unknowns that hold a body without strain: all of one node, two of a second, one of a third.

    The second is far from the first and held across the line between them, the third is far from
    that line and held out of the plane of the three.
    """
    first = 0
    reach = nodes - nodes[first]
    second = int(np.argmax(np.linalg.norm(reach, axis=1)))
    normals = np.cross(reach[second], reach)
    third = int(np.argmax(np.linalg.norm(normals, axis=1)))
    along = int(np.argmax(np.abs(reach[second])))
    across = [axis for axis in range(3) if axis != along]
    # Turning about the line moves the third node along the normal; of the two axes across the
    # line, and of the line's own, the one with the largest share resists it.
    out = int(np.argmax(np.abs(normals[third])))
    return np.array(
        [*(3 * first + axis for axis in range(3)), *(3 * second + axis for axis in across),
         3 * third + out]
    )  # fmt: skip
