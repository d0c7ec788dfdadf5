"""A leg's share of a Newton iteration with the factor of an earlier trial, turned to the last one.

With A the matrix of some earlier trial, R the turn about each node since then
(`pneumorph.fem.node_turns`) and r the residual at the last trial v, contact impulses lambda of that
trial taken off, the next trial is

    v_f - B r_f - (B A_fa) (v_a' - v_a) + B H_f^T (lambda' - lambda),   B = R A_ff^-1 R^T,

v_a' of the attachment and lambda' the impulses of the contacts, which the hub and the contact law
decide. What A, R and their single precision are worth decides how fast changes become small, and
nothing else: they only ever multiply changes. Columns of the attachment and of contacts turn as
wholes, by the turn about the attachment and about the point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.frontal_cholesky import FrontalCholesky
from pneumorph.fem.mounted_leg import MountedLeg
from pneumorph.fem.node_turns import rotations


class KeptLeg:
    """The factor of a leg's matrix, and columns of its attachment and contacts through it.

    Args:
        leg: The leg.
        data: A in the pattern of the part's assembly [kg], (entry,).
        x: Where the nodes are at that trial [mm], (node, 3).
        weight: Times the leg's own mass that was added to A to make it definite.

    Raises:
        numpy.linalg.LinAlgError: A is not positive definite, or a tetrahedron is flat.
    """

    def __init__(
        self, leg: MountedLeg, data: np.ndarray, x: np.ndarray, weight: float = 0.0
    ) -> None:
        self._leg = leg
        self.weight = weight
        self._pattern = leg.pattern("tree")
        self._reference = leg.part.turns.reference(x)
        self._factor = FrontalCholesky(self._pattern, data, "single")
        coupling, own = leg.attachment_blocks(self._pattern, data)
        half, gram = self._factor.half_solve(coupling)
        self._half = [half]
        self._attachment_matrix: np.ndarray = own - gram
        self._gram: np.ndarray = gram.astype(float)  # attachment, then points as they came
        self._points = np.empty(0, dtype=int)
        self._at_attachment = np.empty((0, len(own)))
        self.turn_to(x)

    def turn_to(self, x: np.ndarray) -> None:
        """Turn the matrix to where the nodes are.

        Args:
            x: Their positions [mm], (node, 3).
        """
        leg = self._leg
        sines = leg.part.turns.since(self._reference, x)
        squares = leg.part.node_mass @ np.sum(sines**2, axis=1)
        self.turn = float(np.sqrt(squares / leg.part.mass_kg))
        """Root mean square, by mass, of the turns about the nodes [radian, their sines]."""
        self._turns = rotations(sines)
        self._turns_of_points = rotations(leg.contact_weights @ sines)
        together = rotations(sines[leg.attachment].mean(axis=0)[None])
        self._turns_of_attachment = np.repeat(together, len(leg.attachment), axis=0)

    def add_points(self, points: np.ndarray) -> None:
        """Take in contact points that are not there yet.

        Args:
            points: Their numbers, (point,).
        """
        new = np.setdiff1d(points, self._points)
        if len(new) == 0:
            return
        first = self._leg.first_block("tree")
        new = new[np.argsort(first[new], kind="stable")]
        columns = np.zeros((len(self._pattern.unknowns), 3 * len(new)), dtype=self._factor.real)
        axes = np.tile(np.eye(3), (len(new), 1, 1))
        at_attachment = self._leg.fill_contacts(self._pattern, columns, new, axes)
        half, own = self._factor.half_solve(columns, np.repeat(first[new], 3))
        across = np.concatenate([each.T @ half for each in self._half])
        self._gram = np.block([[self._gram, across], [across.T, own]])
        self._half.append(half)
        self._points = np.concatenate([self._points, new])
        self._at_attachment = np.concatenate([self._at_attachment, at_attachment])

    def condense(
        self,
        velocity: np.ndarray,
        residual: np.ndarray,
        active: np.ndarray,
        frames: np.ndarray,
        impulses: np.ndarray,
    ) -> KeptShare:
        """The leg's share of the next iteration.

        Args:
            velocity: v of the last trial [mm/s], (node, 3).
            residual: r there, without contacts [mN s], (3 node,).
            active: Contact points that take part, all of them taken in, (contact,).
            frames: Their normal, tangent, tangent, as rows, (contact, 3, 3).
            impulses: lambda of the last trial along those [mN s], (contact, 3).
        """
        leg, attached = self._leg, velocity[self._leg.attachment].ravel()
        pushed = np.einsum("pra,pr->pa", frames, impulses)
        left = residual.reshape(-1, 3) - leg.contact_weights[active].T @ pushed
        turned_back = np.einsum("nji,nj->ni", self._turns, left).ravel()
        half = self._factor.half_solve_one(turned_back[self._pattern.unknowns])
        products = np.concatenate([each.T @ half for each in self._half]).astype(float)
        count, before = len(attached), impulses.ravel()
        order = np.argsort(self._points)
        chosen = order[np.searchsorted(self._points, active, sorter=order)]
        rows = (3 * chosen[:, None] + np.arange(3)).ravel()
        of_attachment, of_points = self._turns_of_attachment, frames @ self._turns_of_points[active]
        matrix = _turned(_turned(self._attachment_matrix, of_attachment).T, of_attachment)
        coupling = _turned(self._gram[count + rows, :count], of_points)  # H_f B A_fa
        coupling = _turned(coupling.T, of_attachment).T
        contact_attachment = _turned(self._at_attachment[rows], frames) - coupling
        delassus = self._gram[np.ix_(count + rows, count + rows)]
        delassus = _turned(_turned(delassus, of_points).T, of_points)
        free = velocity.copy()
        free[leg.tie.nodes] = 0.0
        moving = np.einsum("pra,pa->pr", frames, leg.contact_weights[active] @ free).ravel()
        moving -= _turned(products[count + rows][:, None], of_points)[:, 0]
        right = matrix @ attached - leg.at_attachment(left.ravel())
        right += _turned(products[:count][:, None], of_attachment)[:, 0]
        return KeptShare(
            kept=self,
            velocity=velocity,
            half_residual=half,
            rows=rows,
            frames=of_points,
            impulses=before,
            attachment_matrix=matrix,
            attachment_right=right - contact_attachment.T @ before,
            contact_attachment=contact_attachment,
            delassus=delassus,
            contact_right=moving + coupling @ attached - delassus @ before,
        )

    def moved(self, share: KeptShare, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Velocities of all nodes of the next trial [mm/s], (node, 3).

        Args:
            share: What `condense` returned, after the same turn.
            attached: Velocities of the attachment nodes [mm/s], (3 attachment,).
            impulse: Of the contacts [mN s], (3 contact,).
        """
        leg, velocity = self._leg, share.velocity.copy()
        change = velocity[leg.attachment] - attached.reshape(-1, 3)
        change = np.einsum("nji,nj->ni", self._turns_of_attachment, change).ravel()
        pushes = np.zeros(3 * len(self._points))
        more = (impulse - share.impulses).reshape(-1, 3)
        pushes[share.rows] = np.einsum("pra,pr->pa", share.frames, more).ravel()
        half = self._half[0] @ change.astype(self._factor.real) - share.half_residual
        first = 0
        for columns in self._half[1:]:
            half += columns @ pushes[first : first + columns.shape[1]].astype(self._factor.real)
            first += columns.shape[1]
        moves = np.zeros(velocity.size)
        moves[self._pattern.unknowns] = self._factor.half_solve_transposed_one(half)
        velocity += np.einsum("nij,nj->ni", self._turns, moves.reshape(-1, 3))
        velocity.reshape(-1)[leg.tied_unknowns] = leg.tied_values(attached)
        return velocity


def _turned(columns: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Rows, three to a point, by the turn of each point, (3 point, column)."""
    blocks = columns.reshape(len(turns), 3, columns.shape[1])
    return np.matmul(turns, blocks).reshape(columns.shape)


@dataclass(frozen=True, eq=False)
class KeptShare:
    """A leg's share of an iteration, as `pneumorph.fem.mounted_leg.CondensedLeg` has it."""

    kept: KeptLeg
    velocity: np.ndarray
    """v of the last trial [mm/s], (node, 3)."""
    half_residual: np.ndarray
    """L^-1 R^T r_f, (free,)."""
    rows: np.ndarray
    """Columns of the contacts among all that were taken in, (3 contact,)."""
    frames: np.ndarray
    """Normal, tangent, tangent of the contacts, turned back, (contact, 3, 3)."""
    impulses: np.ndarray
    """lambda [mN s], (3 contact,)."""
    attachment_matrix: np.ndarray
    """R A_aa R^T - A_af B A_fa, (3 attachment, 3 attachment)."""
    attachment_right: np.ndarray
    """b_a - A_af B b_f with b = A v - r - H^T lambda, (3 attachment,)."""
    contact_attachment: np.ndarray
    """H_a - H_f B A_fa, (3 contact, 3 attachment)."""
    delassus: np.ndarray
    """H_f B H_f^T, (3 contact, 3 contact)."""
    contact_right: np.ndarray
    """H_f B b_f [mm/s], (3 contact,)."""

    def node_velocities(self, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """As `KeptLeg.moved`."""
        return self.kept.moved(self, attached, impulse)
