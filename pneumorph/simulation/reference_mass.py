"""Mass of one body of a reduced robot in NumPy: matrix, weight and products of velocities.

Numbers in brackets are equations of docs/physics.md. Everything is about the hub's origin and along
the hub's axes; unknowns of a body are the hub's velocity, its turning rate and the modal rates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pneumorph.robot.robot import Hub, Mount

PERMUTATION: np.ndarray = np.cross(np.eye(3)[:, None], np.eye(3)[None])
"""Levi-Civita's symbol, (e_i x e_j)_k."""


@dataclass(frozen=True, eq=False)
class MassMoments:
    """Sums over the nodes y of a body with modes Phi: all that its motion asks of its mass."""

    mass: float
    """sum m [kg]."""
    first: Float[np.ndarray, " 3"]
    """sum m y [kg mm]."""
    second: Float[np.ndarray, "3 3"]
    """sum m y y^T [kg mm^2]."""
    modes: Float[np.ndarray, "3 mode"]
    """sum m Phi_a."""
    arms: Float[np.ndarray, "3 3 mode"]
    """sum m y_i Phi_ja."""
    pairs: Float[np.ndarray, "3 3 mode mode"]
    """sum m Phi_ia Phi_jb."""


def hub_moments(hub: Hub) -> MassMoments:
    """Moments of the hub, a body without modes."""
    none = np.zeros((3, 3, 0))
    return MassMoments(
        hub.mass, hub.first_moment, hub.second_moment, none[0], none, none[..., None][..., :0]
    )


def mount_moments(mount: Mount, alpha: Float[np.ndarray, " mode"]) -> MassMoments:
    """Moments of a mounted part at modal coordinates, with y = R (Y + Phi alpha) + t of (11).

    Args:
        mount: The part and its pose.
        alpha: Modal coordinates.
    """
    part, turn, place = mount.part, mount.pose.rotation, mount.pose.translation
    fixed, pairs = part.second_moment_modes, part.second_moment_mode_pairs
    # In the part's own frame, with its deflection ...
    first = part.first_moment + part.first_moment_modes @ alpha
    change = fixed @ alpha
    second = part.second_moment + change + change.T + pairs @ alpha @ alpha
    arms = fixed + np.einsum("ijba,b->ija", pairs, alpha)
    # ... and in the hub's.
    first, modes = turn @ first, turn @ part.first_moment_modes
    carried = np.outer(first, place)
    second = turn @ second @ turn.T + carried + carried.T + part.mass * np.outer(place, place)
    arms = np.einsum("ik,jl,kla->ija", turn, turn, arms) + place[:, None, None] * modes[None]
    pairs = np.einsum("ik,jl,klab->ijab", turn, turn, pairs)
    return MassMoments(part.mass, first + part.mass * place, second, modes, arms, pairs)


def mass_matrix(body: MassMoments) -> Float[np.ndarray, "unknown unknown"]:
    """M of (19) [kg, mm]; modes are orthonormal in mass."""
    first = cross_matrix(body.first)
    turning = np.trace(body.second) * np.eye(3) - body.second
    rigid = np.block([[body.mass * np.eye(3), -first], [first, turning]])
    levers = np.einsum("ijl,ija->la", PERMUTATION, body.arms)  # sum m y x Phi
    coupling = np.concatenate([body.modes, levers])
    return np.block([[rigid, coupling], [coupling.T, np.eye(coupling.shape[1])]])


def weight(body: MassMoments, gravity: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " unknown"]:
    """Generalised weight (20) [mN, mm].

    Args:
        body: The body.
        gravity: Along the hub's axes [mm/s^2].
    """
    return np.concatenate(
        [body.mass * gravity, np.cross(body.first, gravity), body.modes.T @ gravity]
    )


def velocity_products(
    body: MassMoments, turning: Float[np.ndarray, " 3"], rates: Float[np.ndarray, " mode"]
) -> Float[np.ndarray, " 6+mode"]:
    """Coriolis and centrifugal forces (21) [mN, mm].

    Args:
        body: The body.
        turning: Turning rate of the hub [rad/s].
        rates: Modal rates.
    """
    turn = cross_matrix(turning)
    circling = turn @ turn
    swing = body.arms @ rates  # sum m y (Phi rate)^T
    force = circling @ body.first + 2.0 * turn @ (body.modes @ rates)
    moment = np.einsum("ijl,ij->l", PERMUTATION, body.second @ circling.T + 2.0 * swing @ turn.T)
    modal = np.einsum("ij,jia->a", circling, body.arms)
    modal = modal + 2.0 * np.einsum("ij,ijab,b->a", turn, body.pairs, rates)
    return -np.concatenate([force, moment, modal])


def cross_matrix(vector: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """[v]x, with [v]x w = v x w."""
    return np.cross(vector, np.eye(3)).T
