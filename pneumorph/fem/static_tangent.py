"""Solves for the free unknowns of a part at rest with its whole tangent."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.cavity import Pressure
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.physics import Rotation

RAISED = (1e-3, 4e-3, 1.6e-2, 6.4e-2, 0.25)
"""By which shares of itself a tangent's diagonal is raised until the tangent is definite."""


class Tangent:
    """Solves for the free unknowns with the whole tangent of a part.

    Attributes:
        met_indefinite: Whether a tangent was not definite where it has to be.
        raises: Whether such a tangent's diagonal is raised.
    """

    met_indefinite = raises = False

    def __init__(self, part: PartModel, held: np.ndarray, rotation: Rotation) -> None:
        self._part, self._rotation = part, rotation
        free_node = np.ones(part.node_count, dtype=bool)
        free_node[held] = False
        self.free: np.ndarray = np.flatnonzero(np.repeat(free_node, 3))

    def solve(
        self, x: np.ndarray, pressure: Pressure, forces: np.ndarray, before: np.ndarray
    ) -> np.ndarray:
        """A step of Newton's method; `before` is the one that led to x, (node, 3)."""
        return self.answers(x, pressure, forces)

    def answers(self, x: np.ndarray, pressure: Pressure, forces: np.ndarray) -> np.ndarray:
        """Changes of all unknowns, (3 node, column), by forces on the free ones, (free, column)."""
        from scipy.sparse.linalg import splu

        tangent = self._part.tangent(x, pressure, self._rotation)
        change = np.zeros((tangent.shape[0], forces.shape[1]))
        change[self.free] = splu(
            tangent[self.free][:, self.free].tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        ).solve(forces)
        return change


class SymmetricTangent(Tangent):
    """The same by frontal Cholesky factors, many times as fast.

    Where the tangent is not definite, away from stable equilibria, another leads down the energy:
    Newton's method would go on to a saddle. The nearest definite matrix of the elements, without
    the pressure's, carries a part that buckles as a whole. Where a few elements snap, as at sharp
    inner edges of fine meshes, it creeps, and the tangent whose diagonal is raised until it is
    definite (Nocedal and Wright, Numerical Optimization, algorithm 3.3) needs a few steps.
    """

    def __init__(self, part: PartModel, held: np.ndarray, rotation: Rotation) -> None:
        super().__init__(part, held, rotation)
        self._pattern = FrontPattern(part.assembly, held, "tree")

    def solve(
        self, x: np.ndarray, pressure: Pressure, forces: np.ndarray, before: np.ndarray
    ) -> np.ndarray:
        """As `Tangent.solve`.

        Raises:
            numpy.linalg.LinAlgError: The held nodes leave the part free to move.
        """
        part, rotation = self._part, self._rotation
        data = part.tangent_data(x, pressure, rotation, change=before)
        diagonal = data[part.assembly.diagonal]
        for share in (0.0, *(RAISED if self.raises else ())):
            data[part.assembly.diagonal] = diagonal + share * np.abs(diagonal)
            try:
                return self._by(data, forces)
            except np.linalg.LinAlgError:
                self.met_indefinite = True
        return self._by(part.tangent_data(x, pressure, rotation, definite=True), forces)

    def answers(self, x: np.ndarray, pressure: Pressure, forces: np.ndarray) -> np.ndarray:
        """As `Tangent.answers`.

        Raises:
            numpy.linalg.LinAlgError: The tangent is not definite.
        """
        return self._by(self._part.tangent_data(x, pressure, self._rotation), forces)

    def _by(self, data: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Changes of all unknowns by the tangent of these data."""
        change = np.zeros((3 * self._part.node_count, forces.shape[1]))
        change[self.free] = forces
        factor = FrontalCholesky(self._pattern, data)
        change[self._pattern.unknowns] = factor.solve(change[self._pattern.unknowns])
        return change


def tangent_of(part: PartModel, held: np.ndarray, rotation: Rotation) -> Tangent:
    """The fastest that solves for the free unknowns of a part.

    Args:
        part: The part.
        held: Nodes that stay, rising, (n,).
        rotation: Where the elements take their rotation from.
    """
    tangent = SymmetricTangent if part.has_potential(rotation) else Tangent
    return tangent(part, held, rotation)
