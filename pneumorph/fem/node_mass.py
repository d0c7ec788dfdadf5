"""How the mass of a part is shared among its nodes."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.material import MassLumping
from pneumorph.geometry.mesh import Mesh


def node_mass(mesh: Mesh, mass_kg: float, lumping: MassLumping) -> np.ndarray:
    """Share a mass among nodes [kg], (node,).

    Args:
        mesh: The part.
        mass_kg: Total mass [kg].
        lumping: ``even`` or ``volume``.

    Raises:
        ValueError: No such lumping.
    """
    count = len(mesh.nodes)
    if lumping == "even":
        return np.full(count, mass_kg / count)
    if lumping != "volume":
        raise ValueError(f'mass_lumping must be "even" or "volume", got {lumping!r}')
    # Proportional to the diagonal of the consistent mass matrix, element by element: 1/10 for
    # linear tetrahedra; 6/420 at corners and 32/420 at midside nodes of straight quadratic ones.
    share = np.array([1 / 4] * 4 if mesh.edge_nodes is None else [3 / 108] * 4 + [16 / 108] * 6)
    mass = np.bincount(
        mesh.connectivity.ravel(), np.outer(mesh.volumes, share).ravel(), minlength=count
    )
    result: np.ndarray = mass * (mass_kg / mass.sum())
    return result


def given_node_mass(masses: np.ndarray, mesh: Mesh, mass_kg: float) -> np.ndarray:
    """Masses of the nodes that are given one by one [kg], (node,).

    Raises:
        ValueError: They are not one positive mass for each node, or do not add up to the part's.
    """
    count = len(mesh.nodes)
    if masses.shape != (count,) or not masses.min() > 0.0:
        raise ValueError(
            f"mass_lumping has shape {masses.shape} and a least mass of {masses.min():g} kg, "
            f"expected one positive mass for each of {count} nodes"
        )
    if not np.isclose(masses.sum(), mass_kg, rtol=1e-9, atol=0.0):
        raise ValueError(
            f"mass_lumping adds up to {masses.sum():g} kg, expected mass_kg, {mass_kg:g}"
        )
    return masses
