"""A leg tied to a hub, and its share of one implicit step, condensed to hub and contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import csr_array

from pneumorph.base.stage_clock import StageClock
from pneumorph.fem.cavity import Pressure
from pneumorph.fem.frontal_cholesky import Along, FrontalCholesky, FrontPattern
from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.pose import Pose


@dataclass(frozen=True, eq=False)
class CondensedLeg:
    """One step's equations of a leg with its free nodes eliminated.

    With b the right side, subscripts f free, a attachment, and H the velocities of the contact
    points, the Gram matrix of L^-1 [A_fa, b_f, H_f^T] holds all that the hub and the contacts need.
    """

    leg: MountedLeg
    factor: FrontalCholesky
    half: np.ndarray
    """L^-1 [A_fa, b_f, H_f^T], (free, 3 attachment + 1 + 3 contact), the columns of the contacts in
    the order that the elimination meets them."""
    met: np.ndarray
    """Row of the contacts, as the hub numbers them, of each of those columns, (3 contact,)."""
    attachment_matrix: np.ndarray
    """A_aa - A_af A_ff^-1 A_fa, (3 attachment, 3 attachment)."""
    attachment_right: np.ndarray
    """b_a - A_af A_ff^-1 b_f, (3 attachment,)."""
    contact_attachment: np.ndarray
    """H_a - H_f A_ff^-1 A_fa, (3 contact, 3 attachment)."""
    delassus: np.ndarray
    """H_f A_ff^-1 H_f^T, (3 contact, 3 contact)."""
    contact_right: np.ndarray
    """H_f A_ff^-1 b_f [mm/s], (3 contact,)."""

    def free_velocity(self, attachment_velocity: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Velocity of the free unknowns, in the order of the factors [mm/s], (free,).

        Args:
            attachment_velocity: Of the attachment nodes [mm/s], (3 attachment,).
            impulse: Of the contacts [mN s], (3 contact,).
        """
        right = self.half @ np.concatenate([-attachment_velocity, [1.0], impulse[self.met]])
        return self.factor.half_solve_transposed(right[:, None])[:, 0]

    def node_velocities(self, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Velocities of all nodes [mm/s], (node, 3); arguments as of `free_velocity`."""
        return self.leg.full_velocity(self.free_velocity(attached, impulse), attached)


class LegShare(Protocol):
    """What the hub and the contacts need of a leg: `CondensedLeg` or one of a kept factor."""

    @property
    def attachment_matrix(self) -> np.ndarray:
        """A_aa - A_af A_ff^-1 A_fa, (3 attachment, 3 attachment)."""

    @property
    def attachment_right(self) -> np.ndarray:
        """b_a - A_af A_ff^-1 b_f, (3 attachment,)."""

    @property
    def contact_attachment(self) -> np.ndarray:
        """H_a - H_f A_ff^-1 A_fa, (3 contact, 3 attachment)."""

    @property
    def delassus(self) -> np.ndarray:
        """H_f A_ff^-1 H_f^T, (3 contact, 3 contact)."""

    @property
    def contact_right(self) -> np.ndarray:
        """H_f A_ff^-1 b_f [mm/s], (3 contact,)."""

    def node_velocities(self, attached: np.ndarray, impulse: np.ndarray) -> np.ndarray:
        """Velocities of all nodes [mm/s], (node, 3).

        Args:
            attached: Of the attachment nodes [mm/s], (3 attachment,).
            impulse: Of the contacts [mN s], (3 contact,).
        """


class MountedLeg:
    """A part at its pose, tied to the hub by its attachment nodes, or by the face they span.

    Args:
        part: The leg in its own frame.
        pose: Where it sits in the robot's frame.
        regulator: Number of the regulator that feeds its cavities, counted from 0; or one for each
            of them.

    Raises:
        MeshError: The part's mesh has no node set ``attachment``.
        ValueError: A regulator is negative, or there are neither one nor as many as cavities.
    """

    def __init__(self, part: PartModel, pose: Pose, regulator: int | Sequence[int]) -> None:
        numbers = tuple(regulator) if isinstance(regulator, Sequence) else (regulator,)
        if min(numbers) < 0:
            raise ValueError(f"regulator must not be negative, got {regulator}; counted from 0")
        if len(numbers) not in (1, len(part.cavities)):
            raise ValueError(
                f"a part of {len(part.cavities)} cavities has {len(numbers)} regulators, expected "
                "one, or one for each cavity"
            )
        self.part, self.pose = part, pose
        self.regulators: tuple[int, ...] = numbers
        """One for all cavities, or one for each."""
        self.tie = FaceTie.of(part.mesh)
        """Nodes tied to the hub."""
        self.attachment: np.ndarray = part.mesh.node_set("attachment").astype(int)
        """Those of them that the others follow, (attachment,)."""
        self.attachment_in_hub: np.ndarray = pose.apply(part.rest_nodes[self.attachment])
        """Their places in the hub's frame [mm], (attachment, 3)."""
        self.contact_weights = interpolation_matrix(part.mesh, part.mesh.contact_points)
        """Contact points as sums of nodes, (point, node)."""
        self.tied_unknowns: np.ndarray = self.tie.unknowns
        """Unknowns of the tied nodes, (3 tied,)."""
        attached = np.eye(3 * len(self.attachment))
        spread = self.tie.spread(attached.reshape(len(self.attachment), 3, -1))
        self._spread = csr_array(spread.reshape(-1, len(attached)))  # to the tied unknowns
        self._first_blocks: dict[Along, np.ndarray] = {}

    def pressure_of(self, pressure_kPa: np.ndarray) -> Pressure:
        """Pressure of its cavities, one for all or (cavity,), of the regulators', (regulator,)."""
        if len(self.regulators) == 1:
            return float(pressure_kPa[self.regulators[0]])
        each: np.ndarray = pressure_kPa[list(self.regulators)]
        return each

    @property
    def contact_count(self) -> int:
        """Number of contact points, active or not."""
        return self.contact_weights.shape[0]

    def pattern(self, along: Along = "sweep") -> FrontPattern:
        """The order of elimination, found once for all mounts of the part."""
        return _shared_pattern(self.part, along)

    def first_block(self, along: Along = "sweep") -> np.ndarray:
        """Block of the elimination that meets each contact point first, (point,)."""
        if along not in self._first_blocks:
            pattern = self.pattern(along)
            place = pattern.place[3 * self.contact_weights.indices]
            block = np.where(place >= 0, pattern.block[place], pattern.block_count)
            starts = self.contact_weights.indptr[:-1]
            first = np.minimum.reduceat(block, starts) if len(block) else block
            self._first_blocks[along] = first
        return self._first_blocks[along]

    def initial_positions(self) -> np.ndarray:
        """Nodes in the robot's frame at rest [mm], (node, 3)."""
        return self.pose.apply(self.part.rest_nodes)

    def condense(
        self,
        data: np.ndarray,
        right: np.ndarray,
        active: np.ndarray,
        frames: np.ndarray,
        clock: StageClock,
    ) -> CondensedLeg:
        """Eliminate the free nodes from one step's equations.

        Args:
            data: A in the pattern of the part's assembly [kg], (entry,).
            right: b [mN s], (3 node,).
            active: Contact points that take part, (contact,).
            frames: Their normal, tangent, tangent, as rows, (contact, 3, 3).
            clock: Told the time of ``factorisation`` and ``elimination``.

        Raises:
            numpy.linalg.LinAlgError: A is not positive definite.
        """
        pattern, first_block = self.pattern(), self.first_block()
        factor = clock.timed("factorisation", FrontalCholesky)(pattern, data)
        count = 3 * len(self.attachment)
        order = np.argsort(first_block[active], kind="stable")
        met = (3 * order[:, None] + np.arange(3)).ravel()
        columns = np.zeros((len(pattern.unknowns), count + 1 + 3 * len(active)))
        coupling, own = self.attachment_blocks(pattern, data)
        columns[:, :count] = coupling
        columns[:, count] = right[pattern.unknowns]
        at_attachment = np.empty((3 * len(active), count))
        at_attachment[met] = self.fill_contacts(
            pattern, columns[:, count + 1 :], active[order], frames[order]
        )
        first = np.zeros(count + 1, dtype=int)
        first = np.concatenate([first, np.repeat(first_block[active[order]], 3)])

        half, gram_as_met = clock.timed("elimination", factor.half_solve)(columns, first)
        numbers = np.concatenate([np.arange(count + 1), count + 1 + met])
        gram = np.empty_like(gram_as_met)
        gram[np.ix_(numbers, numbers)] = gram_as_met
        a, c = slice(0, count), slice(count + 1, None)
        return CondensedLeg(
            leg=self,
            factor=factor,
            half=half,
            met=met,
            attachment_matrix=own - gram[a, a],
            attachment_right=self.at_attachment(right) - gram[a, count],
            contact_attachment=at_attachment - gram[c, a],
            delassus=gram[c, c],
            contact_right=gram[c, count],
        )

    def full_velocity(self, free: np.ndarray, attachment_velocity: np.ndarray) -> np.ndarray:
        """Velocities of all nodes [mm/s], (node, 3), from those free and those attached."""
        velocity = np.empty(3 * self.part.node_count)
        velocity[self.pattern().unknowns] = free
        velocity[self.tied_unknowns] = self.tied_values(attachment_velocity)
        return velocity.reshape(-1, 3)

    def tied_values(self, attached: np.ndarray) -> np.ndarray:
        """Values of the tied unknowns, (3 tied,), from those of the attachment, (3 attachment,)."""
        return self.tie.spread(attached.reshape(-1, 3)).ravel()

    def at_attachment(self, of_nodes: np.ndarray) -> np.ndarray:
        """Loads on the tied nodes as the attachment feels them, (3 attachment,).

        Args:
            of_nodes: Of all nodes, (3 node,).
        """
        return self.tie.gathered(of_nodes[self.tied_unknowns].reshape(-1, 3)).ravel()

    def _from_tied(self, columns: np.ndarray) -> np.ndarray:
        """Columns of the attachment's unknowns from those of the tied, (row, 3 tied)."""
        if len(self.tie.weights) == 0:
            return columns
        by_node = columns.reshape(len(columns), len(self.tie.nodes), 3).transpose(1, 2, 0)
        gathered = self.tie.gathered(by_node)  # (attachment, 3, row)
        return gathered.reshape(3 * len(self.attachment), len(columns)).T

    def attachment_blocks(
        self, pattern: FrontPattern, data: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Columns of the attachment: rows of the free unknowns, rows of the attachment itself.

        Args:
            pattern: The order of the free unknowns.
            data: A in the pattern of the part's assembly [kg], (entry,).

        Returns:
            A_fa, (free, 3 attachment), and A_aa, (3 attachment, 3 attachment).
        """
        tied = self.part.assembly.matrix(data)[:, self.tied_unknowns]
        columns = (tied @ self._spread).toarray()
        own = self._spread.T @ columns[self.tied_unknowns]
        return columns[pattern.unknowns], own

    def add_stiffness(self, data: np.ndarray, point: int, stiffness: np.ndarray) -> None:
        """Add that of a contact point, (3, 3), to a matrix in the assembly's pattern, in place.

        Args:
            data: The matrix, (entry,).
            point: The contact point's number.
            stiffness: What its motion meets, in the matrix's units, (3, 3).
        """
        weights, assembly = self.contact_weights[[point]].tocoo(), self.part.assembly
        axes = np.arange(3)
        for node, weight in zip(weights.col, weights.data, strict=True):
            for other, share in zip(weights.col, weights.data, strict=True):
                for axis in axes:
                    begin, end = assembly.indptr[3 * node + axis : 3 * node + axis + 2]
                    place = np.searchsorted(assembly.indices[begin:end], 3 * other + axes)
                    data[begin + place] += weight * share * stiffness[axis]

    def fill_contacts(
        self, pattern: FrontPattern, columns: np.ndarray, active: np.ndarray, frames: np.ndarray
    ) -> np.ndarray:
        """Write H_f^T of contact points into columns of zeros.

        Args:
            pattern: The order of the free unknowns.
            columns: Where to, (free, 3 contact).
            active: The points, (contact,).
            frames: Their normal, tangent, tangent, as rows, (contact, 3, 3).

        Returns:
            H_a, (3 contact, 3 attachment).
        """
        weights = self.contact_weights[active].tocoo()
        attached = np.full(self.part.node_count, -1)
        attached[self.tie.nodes] = np.arange(len(self.tie.nodes))
        at_attachment = np.zeros((3 * len(active), 3 * len(self.tie.nodes)))
        for row, axis in np.ndindex(3, 3):
            place = pattern.place[3 * weights.col + axis]
            values = weights.data * frames[weights.row, row, axis]
            free = place >= 0
            columns[place[free], 3 * weights.row[free] + row] = values[free]
            tied = ~free
            at_attachment[3 * weights.row[tied] + row, 3 * attached[weights.col[tied]] + axis] = (
                values[tied]
            )
        return self._from_tied(at_attachment)


def _shared_pattern(part: PartModel, along: Along) -> FrontPattern:
    """The order of elimination of a part, found once for all its mounts."""
    patterns = _PATTERNS.setdefault(part, {})
    if along not in patterns:
        patterns[along] = FrontPattern(part.assembly, FaceTie.of(part.mesh).nodes, along)
    return patterns[along]


_PATTERNS: WeakKeyDictionary[PartModel, dict[Along, FrontPattern]] = WeakKeyDictionary()
