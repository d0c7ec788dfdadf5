"""Small displacements of a part with single components prescribed."""

import numpy as np
from scipy.sparse.linalg import splu

from pneumorph.fem.part_model import PartModel


def linear_solution(
    part: PartModel, fixed: np.ndarray, prescribed: np.ndarray, force: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements [mm] and reactions [mN], each (node, 3), of Hooke's law about rest.

    Args:
        part: The part.
        fixed: Unknowns 3 node + axis that are prescribed, (n,).
        prescribed: Their displacements, those of others are ignored [mm], (node, 3).
        force: Force on the nodes [mN], (node, 3); none by default.
    """
    stiffness = part.tangent(part.rest_nodes, rotation="polar").tocsc()
    load = np.zeros(3 * part.node_count) if force is None else force.ravel()
    free = np.setdiff1d(np.arange(3 * part.node_count), fixed)
    displacement = np.zeros(3 * part.node_count)
    displacement[fixed] = prescribed.ravel()[fixed]
    right = load - stiffness @ displacement
    displacement[free] = splu(stiffness[free][:, free].tocsc()).solve(right[free])
    reaction = stiffness @ displacement - load
    return displacement.reshape(-1, 3), reaction.reshape(-1, 3)


def relative_error(found: np.ndarray, exact: np.ndarray) -> float:
    """Root mean square over the nodes, relative to that of the exact displacement."""
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))
