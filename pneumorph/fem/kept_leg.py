"""A leg's share of a Newton iteration with the factor of an earlier trial.

With A the matrix of some earlier trial and r the residual at the last one v, the next trial is

    v_f - A_ff^-1 (r_f + A_fa (v_a' - v_a) - H_f^T lambda),

v_a' of the attachment and lambda the impulses of the contacts, which the hub and the contact law
decide. The law is asked of the velocities at the end, H v', which A has no part in. So where the
iteration converges r is balanced and the law holds, whatever A is; A decides how fast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.fem.frontal_cholesky import FrontalCholesky
from pneumorph.fem.mounted_leg import MountedLeg


class KeptLeg:
    """The factor of a leg's matrix, and columns of its attachment and contacts through it.

    Args:
        leg: The leg.
        data: A in the pattern of the part's assembly [kg], (entry,).

    Raises:
        numpy.linalg.LinAlgError: A is not positive definite.
    """

    def __init__(self, leg: MountedLeg, data: np.ndarray) -> None:
        self._leg = leg
        self._pattern = leg.pattern("tree")
        self.factor = FrontalCholesky(self._pattern, data)
        coupling, own = leg.attachment_blocks(self._pattern, data)
        half, gram = self.factor.half_solve(coupling)
        self._half = [half]
        self.attachment_matrix: np.ndarray = own - gram
        """A_aa - A_af A_ff^-1 A_fa, (3 attachment, 3 attachment)."""
        self._gram: np.ndarray = gram  # of all columns: attachment, then points as they came
        self._points = np.empty(0, dtype=int)
        self._at_attachment = np.empty((0, len(own)))

    @property
    def points(self) -> np.ndarray:
        """Contact points whose columns are there, (point,)."""
        return self._points

    def add_points(self, points: np.ndarray) -> None:
        """Take in contact points that are not there yet, world axes.

        Args:
            points: Their numbers, (point,).
        """
        new = np.setdiff1d(points, self._points)
        if len(new) == 0:
            return
        first = self._leg.first_block("tree")
        new = new[np.argsort(first[new], kind="stable")]
        columns = np.zeros((len(self._pattern.unknowns), 3 * len(new)))
        axes = np.tile(np.eye(3), (len(new), 1, 1))
        at_attachment = self._leg.fill_contacts(self._pattern, columns, new, axes)
        half, own = self.factor.half_solve(columns, np.repeat(first[new], 3))
        across = np.concatenate([each.T @ half for each in self._half])
        self._gram = np.block([[self._gram, across], [across.T, own]])
        self._half.append(half)
        self._points = np.concatenate([self._points, new])
        self._at_attachment = np.concatenate([self._at_attachment, at_attachment])

    def condense(
        self, velocity: np.ndarray, residual: np.ndarray, active: np.ndarray, frames: np.ndarray
    ) -> KeptShare:
        """The leg's share of the next iteration.

        Args:
            velocity: v of the last trial [mm/s], (node, 3).
            residual: r there, without contacts [mN s], (3 node,).
            active: Contact points that take part, all of them taken in, (contact,).
            frames: Their normal, tangent, tangent, as rows, (contact, 3, 3).
        """
        leg, attached = self._leg, velocity[self._leg.attachment].ravel()
        half = self.factor.half_solve_only(residual[self._pattern.unknowns])
        products = np.concatenate([each.T @ half for each in self._half])
        count = len(attached)
        order = np.argsort(self._points)
        chosen = order[np.searchsorted(self._points, active, sorter=order)]
        rows = (3 * chosen[:, None] + np.arange(3)).ravel()

        def framed(columns: np.ndarray) -> np.ndarray:
            blocks = columns.reshape(len(active), 3, columns.shape[1])
            return np.einsum("pra,pac->prc", frames, blocks).reshape(columns.shape)

        coupling = self._gram[count + rows, :count]  # H_f A_ff^-1 A_fa
        free = velocity.copy()
        free[leg.tie.nodes] = 0.0
        moving = (leg.contact_weights[active] @ free).ravel()
        moving += coupling @ attached - products[count + rows]
        return KeptShare(
            kept=self,
            velocity=velocity,
            half_residual=half,
            rows=rows,
            frames=frames,
            attachment_matrix=self.attachment_matrix,
            attachment_right=self.attachment_matrix @ attached
            - leg.at_attachment(residual)
            + products[:count],
            contact_attachment=framed(self._at_attachment[rows] - coupling),
            delassus=framed(framed(self._gram[np.ix_(count + rows, count + rows)]).T),
            contact_right=framed(moving[:, None])[:, 0],
        )

    def moved(self, share: KeptShare, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Velocities of all nodes of the next trial [mm/s], (node, 3).

        Args:
            share: What `condense` returned.
            attached: Velocities of the attachment nodes [mm/s], (3 attachment,).
            impulse: Of the contacts [mN s], (3 contact,).
        """
        leg, velocity = self._leg, share.velocity.copy()
        change = velocity[leg.attachment].ravel() - attached
        pushes = np.zeros(3 * len(self._points))
        along = np.einsum("pra,pr->pa", share.frames, impulse.reshape(-1, 3))
        pushes[share.rows] = along.ravel()
        half = self._half[0] @ change - share.half_residual
        first = 0
        for columns in self._half[1:]:
            half += columns @ pushes[first : first + columns.shape[1]]
            first += columns.shape[1]
        flat = velocity.reshape(-1)
        flat[self._pattern.unknowns] += self.factor.half_solve_transposed(half[:, None])[:, 0]
        flat[leg.tied_unknowns] = leg.tied_values(attached)
        return velocity


@dataclass(frozen=True, eq=False)
class KeptShare:
    """A leg's share of an iteration, as `pneumorph.fem.mounted_leg.CondensedLeg` has it."""

    kept: KeptLeg
    velocity: np.ndarray
    """v of the last trial [mm/s], (node, 3)."""
    half_residual: np.ndarray
    """L^-1 r_f, (free,)."""
    rows: np.ndarray
    """Columns of the contacts among all that were taken in, (3 contact,)."""
    frames: np.ndarray
    """Normal, tangent, tangent of the contacts, (contact, 3, 3)."""
    attachment_matrix: np.ndarray
    """A_aa - A_af A_ff^-1 A_fa, (3 attachment, 3 attachment)."""
    attachment_right: np.ndarray
    """b_a - A_af A_ff^-1 b_f with b = A v - r, (3 attachment,)."""
    contact_attachment: np.ndarray
    """H_a - H_f A_ff^-1 A_fa, (3 contact, 3 attachment)."""
    delassus: np.ndarray
    """H_f A_ff^-1 H_f^T, (3 contact, 3 contact)."""
    contact_right: np.ndarray
    """H_f A_ff^-1 b_f [mm/s], (3 contact,)."""

    def node_velocities(self, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """As `KeptLeg.moved`."""
        return self.kept.moved(self, attached, impulse)
