"""How a loaded part at rest answers small further forces."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.cavity import Pressure
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static_tangent import tangent_of
from pneumorph.physics.physics import Rotation


class UnstableError(ArithmeticError):
    """A state under load is no stable equilibrium."""


def static_answers(
    part: PartModel,
    x: np.ndarray,
    pressure_kPa: Pressure,
    held_nodes: np.ndarray,
    forces_mN: np.ndarray,
    rotation: Rotation = "edge",
) -> np.ndarray:
    """How the nodes move under small further forces, with the whole tangent at an equilibrium.

    Args:
        part: The part.
        x: The equilibrium [mm], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [kPa].
        held_nodes: Nodes that stay, (n,).
        forces_mN: Forces on the nodes, (node, 3, force).
        rotation: Where the elements take their rotation from.

    Returns:
        Displacements [mm], (node, 3, force).

    Raises:
        UnstableError: The equilibrium is not stable; small forces say nothing of where it goes.
    """
    solver = tangent_of(part, np.unique(np.asarray(held_nodes)), rotation)
    flat = forces_mN.reshape(x.size, -1)[solver.free]
    try:
        return solver.answers(x, pressure_kPa, flat).reshape(forces_mN.shape)
    except np.linalg.LinAlgError as error:
        raise UnstableError(
            f"the state at {pressure_kPa} kPa is no stable equilibrium, expected one for its "
            "answers to small forces; the part may buckle"
        ) from error
