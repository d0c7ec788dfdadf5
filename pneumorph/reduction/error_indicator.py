"""How wrong a reduced state is, told by the full model without simulating it.

A reduced state is lifted to all nodes and put into the equations of the full model; what does not
balance there is the residual r. With K the stiffness at rest, held at the attachment, the dual
energy norm

    ||r||_* = sqrt( r^T K^-1 r )

is the energy norm of the displacement that r would cause. For a linear part at rest it is exactly
the error of a Galerkin solution, ||u - u_r||_K; for a bent one the stiffness has turned and
changed, and it is an estimate. One factorisation serves all states. The indicator is relative to
the elastic forces f in the same norm: sqrt( sum ||r||_*^2 / sum ||f||_*^2 ) over the states of a
motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.body_equations import linearly_implicit_equations
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rotation import Rotation


@dataclass(frozen=True)
class Imbalance:
    """Squares of the dual energy norm [mN mm]."""

    residual: float
    """||r||_*^2"""
    elastic: float
    """||f||_*^2 of the elastic forces."""


class ErrorIndicator:
    """Measures what reduced states of a part leave unbalanced.

    Args:
        part: The full-order part, held at its node set ``attachment``.

    Raises:
        MeshError: The part has no such nodes.
    """

    def __init__(self, part: PartModel) -> None:
        from scipy.sparse.linalg import splu

        self.part = part
        free = np.ones(part.node_count, dtype=bool)
        free[part.mesh.node_set("attachment")] = False
        self._free = np.flatnonzero(np.repeat(free, 3))
        stiffness = part.stiffness(part.rest_nodes)[self._free][:, self._free].tocsc()
        self._factor = splu(
            stiffness,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def dual_square(self, force: np.ndarray) -> float:
        """||r||_*^2 of a force on the nodes in the part's frame [mN], (node, 3)."""
        free = force.ravel()[self._free]
        return float(free @ self._factor.solve(free))

    def at_rest(
        self,
        displacement: np.ndarray,
        pressure_kPa: float,
        external_force: np.ndarray | None = None,
        rotation: Rotation = "edge",
    ) -> Imbalance:
        """Of a state that should be an equilibrium.

        Args:
            displacement: Of the nodes [mm], (node, 3).
            pressure_kPa: In the cavity [simulated kPa].
            external_force: Further force on the nodes [mN], (node, 3).
            rotation: Where the elements take their rotation from.
        """
        x = self.part.rest_nodes + displacement
        elastic = self.part.internal_force(x, rotation)
        residual = elastic + (0.0 if external_force is None else external_force)
        if pressure_kPa != 0.0:
            residual = residual + self.part.pressure_force(x, pressure_kPa)
        return Imbalance(self.dual_square(residual), self.dual_square(elastic))

    def of_step(
        self,
        x: np.ndarray,
        v: np.ndarray,
        v_new: np.ndarray,
        pressure_kPa: float,
        contact_impulse: np.ndarray,
        frame: np.ndarray,
        settings: FullOrderSettings,
    ) -> Imbalance:
        """Of one published time step: r = (A v_new - b - J^T lambda) / h of the full model.

        Args:
            x: World positions of the nodes at the start [mm], (node, 3).
            v: Their velocities at the start [mm/s], (node, 3).
            v_new: And at the end [mm/s], (node, 3).
            pressure_kPa: In the cavity [simulated kPa].
            contact_impulse: Of the contacts on the nodes, world axes [mN s], (node, 3).
            frame: Part's frame to world, (3, 3).
            settings: Time step and physics.
        """
        data, right = linearly_implicit_equations(self.part, x, v, pressure_kPa, settings)
        unbalanced = self.part.assembly.matrix(data) @ v_new.ravel() - right
        unbalanced -= contact_impulse.ravel()
        residual = unbalanced.reshape(-1, 3) / settings.time_step_s
        elastic = self.part.internal_force(x, settings.rotation)
        return Imbalance(self.dual_square(residual @ frame), self.dual_square(elastic @ frame))


def relative_imbalance(imbalances: list[Imbalance]) -> float:
    """sqrt( sum ||r||_*^2 / sum ||f||_*^2 ); infinite without any elastic force but with residual.

    Raises:
        ValueError: No state.
    """
    if not imbalances:
        raise ValueError("imbalances must be of at least one state, got none")
    residual = sum(each.residual for each in imbalances)
    elastic = sum(each.elastic for each in imbalances)
    if elastic == 0.0:
        return 0.0 if residual == 0.0 else float("inf")
    return float((residual / elastic) ** 0.5)
