"""How a held part swings: Newmark's method with average acceleration, which damps nothing itself.

    M a + f(x) = load,   x' = x + h v + h^2/4 (a + a'),   v' = v + h/2 (a + a').

Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. ASCE 85 (1959) 67. Of
second order; a vibration of angular frequency w is slowed by a share of (w h)^2 / 12 and keeps its
amplitude, where implicit Euler adds a damping ratio of w h / 2 (Hughes, The Finite Element Method,
section 9.1). For bench tests of materials and parts; robots step by implicit Euler.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.maxwell_group import ViscousState
from pneumorph.fem.part_model import PartModel

_TOLERANCE = 1e-6
"""Unbalanced force over the largest that acts at which a step counts as found."""
_ITERATION_LIMIT = 30


@dataclass(frozen=True, eq=False)
class HeldState:
    """A held part at the end of a step."""

    time_s: float
    """Time [s]."""
    positions: np.ndarray
    """Node positions [mm], (node, 3)."""
    velocities: np.ndarray
    """Node velocities [mm/s], (node, 3)."""
    viscous: ViscousState
    """What its branches remember."""


def held_motion(
    part: PartModel,
    held_nodes: np.ndarray,
    load: np.ndarray,
    step_s: float,
    added_mass: np.ndarray | None = None,
) -> Iterator[HeldState]:
    """Let a part go from rest under a load that stays; yields its states for as long as asked.

    Args:
        part: The part; its solid relaxes.
        held_nodes: Nodes that do not move, (n,).
        load: Force on the nodes, weight included [mN], (node, 3).
        step_s: h [s].
        added_mass: Mass fixed to the nodes [kg], (node,).

    Raises:
        ValueError: The part does not relax.
        ArithmeticError: Newton's method found no balance.
    """
    if part.branches is None:
        raise ValueError("part has no relaxation, expected a Prony series of its solid")
    branches = part.branches
    pattern = FrontPattern(part.assembly, np.asarray(held_nodes))
    mass = part.node_mass if added_mass is None else part.node_mass + added_mass
    inertia = 4.0 / step_s**2 * mass[:, None]
    x = part.rest_nodes.copy()
    v, viscous, time = np.zeros_like(x), branches.relaxed(x), 0.0
    a = np.zeros_like(x)
    a.reshape(-1)[pattern.unknowns] = (load / mass[:, None]).reshape(-1)[pattern.unknowns]
    while True:
        new = x.copy()  # as if it stood still: stiff parts swing far less than they drift freely
        standing = x + step_s * v + 0.25 * step_s**2 * a
        change = np.zeros_like(x)
        for _ in range(_ITERATION_LIMIT):
            state = branches.advanced(viscous, new, step_s)
            elastic = part.internal_force(new, "polar") + part.relaxing_force(state, new)
            acting = np.abs(elastic).max() + np.abs(load).max()
            residual = (elastic + load - inertia * (new - standing)).reshape(-1)[pattern.unknowns]
            if np.abs(residual).max() < _TOLERANCE * acting:
                break
            data = part.tangent_data(new, change=change)
            data += part.assembly.symmetric_data([branches.tangent_entries(state, new, step_s)])
            data[part.assembly.diagonal] += np.repeat(inertia, 3)
            move = FrontalCholesky(pattern, data).solve(residual[:, None])[:, 0]
            change = np.zeros_like(x)
            change.reshape(-1)[pattern.unknowns] = move
            new = new + change
        else:
            raise ArithmeticError(
                f"Newton's method left {np.abs(residual).max():.3g} mN unbalanced at "
                f"{time + step_s:g} s after {_ITERATION_LIMIT} iterations"
            )
        new_a = 4.0 / step_s**2 * (new - standing)
        v = v + 0.5 * step_s * (a + new_a)
        x, a, viscous, time = new, new_a, state, time + step_s
        yield HeldState(time, x, v, viscous)
