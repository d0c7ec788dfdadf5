"""Integrals of mass over a part whose points are Y + Phi alpha in a moving frame.

They are all a stepper needs for the exact inertia of a part that floats with its hub: mass, centre
of mass, rotary inertia and their coupling with the modes, for any alpha, without visiting a node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MassIntegrals:
    """Sums over nodes of mass m, rest position Y [mm] and mode shape Phi."""

    mass: float
    """sum m [kg]"""
    first_moment: np.ndarray
    """sum m Y [kg mm], (3,)"""
    first_moment_modes: np.ndarray
    """sum m Phi, (3, mode)"""
    second_moment: np.ndarray
    """sum m Y Y^T [kg mm^2], (3, 3)"""
    second_moment_modes: np.ndarray
    """sum m Y_i Phi_j, (3, 3, mode)"""
    second_moment_mode_pairs: np.ndarray
    """sum m Phi_i^a Phi_j^b, (3, 3, mode, mode)"""


def mass_integrals(node_mass: np.ndarray, nodes: np.ndarray, modes: np.ndarray) -> MassIntegrals:
    """Integrate over the nodes.

    Args:
        node_mass: Lumped mass [kg], (node,).
        nodes: Rest positions [mm], (node, 3).
        modes: Mode shapes, (node, 3, mode).
    """
    weighted_nodes = node_mass[:, None] * nodes
    mode_count = modes.shape[2]
    weighted_modes = (node_mass[:, None, None] * modes).reshape(len(nodes), -1)
    pairs = weighted_modes.T @ modes.reshape(len(nodes), -1)
    return MassIntegrals(
        mass=float(node_mass.sum()),
        first_moment=weighted_nodes.sum(axis=0),
        first_moment_modes=weighted_modes.sum(axis=0).reshape(3, mode_count),
        second_moment=weighted_nodes.T @ nodes,
        second_moment_modes=(weighted_nodes.T @ modes.reshape(len(nodes), -1)).reshape(
            3, 3, mode_count
        ),
        second_moment_mode_pairs=pairs.reshape(3, mode_count, 3, mode_count).transpose(0, 2, 1, 3),
    )
