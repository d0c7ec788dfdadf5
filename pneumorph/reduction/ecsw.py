"""Energy-conserving sampling and weighting: few elements that stand for all of them.

At training states alpha_s each element e contributes a generalised force Phi^T f_e(alpha_s). ECSW
looks for few non-negative weights with sum_e w_e Phi^T f_e = sum_e Phi^T f_e at all states
(Farhat et al. 2014). Non-negative weights keep the part's stiffness positive semi-definite.

**Scaling.** A force error df moves the part by K^-1 df, so the rows of a state are multiplied by
L^-1 of its reduced stiffness K = L L^T: their norm is then the energy of the displacement the error
causes. Each state is divided by the size of its own force (with a floor), so gently inflated states
count as much as strongly inflated ones. The hyperreduction tolerance t bounds the relative residual
||G w - b|| <= t ||b|| of these scaled rows. The published one (0.001) is the same formula for rows
as they are: G_{(s,a),e} = Phi_a^T f_e(alpha_s), b = G 1.

**Rigid turns.** The rows also hold the moment of the internal force about the part's frame (not
zero with edge-based rotations) and, at some states, the stiffness itself between modes and
rotations: damping proportional to stiffness couples the rates of the modes and the hub's rotation.
An element's force has no resultant whatever its weight, nor has it a moment where its law is
objective, so sampling conserves linear and angular momentum.

**Stress that relaxes.** Where the solid relaxes, the rows also hold the force of its branches if
the state had been reached at once: springs that have the whole of Green's strain.

**Integration points.** What is sampled are integration points; a linear element is one, and each of
a quadratic element's has a weight of its own.

**Mirror pairs.** With symmetric and antisymmetric modes a point and its mirror image share one
column and one weight, so a mirrored motion of the sampled part is the mirrored motion, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive, Share
from pneumorph.base.progress import ProgressReport
from pneumorph.fem.element_group import ElementGroup
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.assemble import Cubature, sample_elements
from pneumorph.reduction.mirror_pairs import shared_columns
from pneumorph.reduction.mixed_dilatation import MixedDilatation
from pneumorph.reduction.mixed_sheet import MixedSheet
from pneumorph.reduction.sampled_elements import SampledElements
from pneumorph.reduction.sparse_nnls import NormalEquations, SparseSolution, sparse_nnls
from pneumorph.reduction.tolerance import Tolerance

# Rows gathered before one product with themselves: the matrix of normal equations is large.
_BLOCK_ROWS = 256
_SCALE_STATES = 24
"""States that tell scales where none has its stiffness fitted."""


@dataclass(frozen=True)
class EcswSettings(Checked):
    """Hyperreduction by ECSW: which elements are sampled."""

    hyperreduction_tolerance: Tolerance = 0.008
    """Relative residual of the scaled training forces at which no more elements are added. Smaller:
    more exact, more elements, slower steps."""
    element_limit: Count = 220
    """Largest number of sampled elements, tetrahedra and membrane triangles together, whatever the
    tolerance asks for."""
    stiffness_state_count: CountOrNone = 24
    """Number of training states whose stiffness is fitted as well as their forces; 0: forces
    only."""
    stiffness_weight: NotNegative = 0.2
    """Weight of all stiffness rows relative to all force rows."""
    force_floor: Share = 0.05
    """Force rows are scaled by their state's force, but at least by this fraction of the largest
    one."""
    equilibrium_weight: Positive = 1.0
    """Weight of the reduced leg's own free bends and blocked tips relative to the snapshots'
    states. Pressure softens the leg there, so that an error in the force displaces it more."""


@dataclass(frozen=True)
class EcswResult:
    """Sampled elements of each group and the errors of their sums."""

    cubatures: tuple[Cubature, ...]
    relative_residual: float
    """||G w - b|| / ||b|| over all scaled rows."""
    converged: bool
    """Whether the tolerance was met before ``element_limit``."""


def ecsw(
    groups: Sequence[ElementGroup],
    modes: np.ndarray,
    states: np.ndarray,
    settings: EcswSettings,
    *,
    rotation: Rotation = "edge",
    weights: np.ndarray | None = None,
    mirror_nodes: np.ndarray | None = None,
    linear_stiffness: np.ndarray | None = None,
    mixed: Sequence[MixedDilatation | MixedSheet] = (),
    relaxing: bool = False,
    progress: ProgressReport | None = None,
) -> EcswResult:
    """Choose elements and weights.

    Args:
        groups: Element groups of the part, sampled together.
        modes: Mode shapes, (node, 3, mode); symmetric or antisymmetric if ``mirror_nodes`` given.
        states: Training states, modal coordinates (state, mode).
        settings: Tolerances and limits.
        rotation: Where the elements take their rotation from.
        weights: Of the states' force rows, (state,); 1 if not given.
        mirror_nodes: Mirror image of each node, (node,), to pair elements.
        linear_stiffness: What holds the modes besides the elements, (mode, mode): the mount's.
        mixed: What the solid's volumes and a sheet cost besides, where fields see them.
        relaxing: Whether the solid, the first group, has branches.
        progress: Called with done, total and a message.

    Raises:
        ValueError: No training state, or a mirror image of an element is missing.
    """
    if len(states) == 0:
        raise ValueError("states must hold at least one training state, got none")
    training = TrainingRows.build(
        groups, modes, mirror_nodes, rotation, linear_stiffness, mixed, relaxing
    )
    limit = settings.element_limit // (1 if mirror_nodes is None else 2)
    solution = fitted_columns(training, states, settings, weights, max(limit, 1), progress)
    return EcswResult(
        cubatures=training.cubatures(solution.weight),
        relative_residual=solution.relative_residual,
        converged=solution.converged,
    )


def fitted_columns(
    training: TrainingRows,
    states: np.ndarray,
    settings: EcswSettings,
    weights: np.ndarray | None = None,
    limit: int | None = None,
    progress: ProgressReport | None = None,
) -> SparseSolution:
    """Choose columns that stand for all, each with a weight of 1.

    Args:
        training: Contributions of all columns.
        states: Training states, modal coordinates (state, mode).
        settings: Tolerance, and what rows are scaled by.
        weights: Of the states' force rows, (state,); 1 if not given.
        limit: Most columns; no limit if not given.
        progress: Called with done, total and a message.
    """
    # Evenly spread over the states, which are ordered by protocol and load: the first, at rest,
    # tells no scales.
    spread = np.linspace(0, len(states) - 1, settings.stiffness_state_count or _SCALE_STATES)
    stiffness_states = set(np.unique(spread.astype(int)).tolist())
    scales = training.scales(states[sorted(stiffness_states)], settings.force_floor)
    if settings.stiffness_state_count == 0:
        stiffness_states = set()
    stiffness_scale = (
        settings.stiffness_weight * (len(states) / max(len(stiffness_states), 1)) ** 0.5
    )

    if weights is None:
        weights = np.ones(len(states))
    problem = NormalEquations.empty(training.column_count)
    block: list[np.ndarray] = []
    for number, state in enumerate(states):
        forces, stiffness = training.rows(state, scales, with_stiffness=number in stiffness_states)
        for each in np.split(forces, [len(state) + 3]):  # of the branches the second, if any
            if len(each) > 0:
                # Forces of a part that no state stresses are zero, whatever they are divided by.
                scale = max(_size(each), scales.force_floor) or 1.0
                block.append(weights[number] * each / scale)
        if stiffness is not None:
            block.append(stiffness * (stiffness_scale / _size(stiffness)))
        if sum(map(len, block)) > _BLOCK_ROWS or number == len(states) - 1:
            rows = np.concatenate(block)
            problem.add(rows, rows.sum(axis=1))
            block = []
        if progress:
            progress(number + 1, len(states), "element rows")

    return sparse_nnls(problem, settings.hyperreduction_tolerance, limit)


def _size(rows: np.ndarray) -> float:
    # Norm of the sum over all elements, the right side of the rows.
    return float(np.linalg.norm(rows.sum(axis=1)))


@dataclass(frozen=True)
class RowScales:
    """What rows are divided by."""

    rotation: float
    """Root of the mean stiffness against rigid turns over the training states."""
    force_floor: float
    """Smallest scaled force a state is divided by."""


@dataclass(frozen=True)
class TrainingRows:
    """Contributions of every element, or mirror pair of elements, to the reduced force."""

    elements: tuple[SampledElements, ...]
    columns: sparse.csr_matrix
    """Adds up the contributions of elements that share a weight, (element, column)."""
    rotation: Rotation
    linear_stiffness: np.ndarray
    """Besides the elements', (mode, mode)."""
    mixed: Sequence[MixedDilatation | MixedSheet]
    """Besides the elements', as the state has it."""
    relaxing: bool
    """Whether the first group, the solid, has branches."""

    @classmethod
    def build(
        cls,
        groups: Sequence[ElementGroup],
        modes: np.ndarray,
        mirror_nodes: np.ndarray | None,
        rotation: Rotation,
        linear_stiffness: np.ndarray | None = None,
        mixed: Sequence[MixedDilatation | MixedSheet] = (),
        relaxing: bool = False,
    ) -> TrainingRows:
        """Prepare the elements of all groups and number their columns."""
        owner, offset = [], 0
        for group in groups:
            column = np.arange(group.element_count)
            if mirror_nodes is not None:
                column = shared_columns(group, mirror_nodes)
            owner.append(offset + column)
            offset += int(column.max(initial=-1)) + 1
        column = np.concatenate(owner)
        element_count = len(column)
        columns = sparse.csr_matrix(
            (np.ones(element_count), (np.arange(element_count), column)),
            shape=(element_count, offset),
        )
        elements = tuple(sample_elements(group, modes) for group in groups)
        if linear_stiffness is None:
            linear_stiffness = np.zeros((modes.shape[2], modes.shape[2]))
        return cls(elements, columns, rotation, linear_stiffness, mixed, relaxing)

    @property
    def column_count(self) -> int:
        """Number of weights to choose."""
        return int(self.columns.shape[1])

    def scales(self, states: np.ndarray, force_floor: float) -> RowScales:
        """Scales that make force and moment rows comparable, from some of the states."""
        turn, unscaled = [], RowScales(1.0, 1.0)
        sizes = []
        for state in states:
            mode_count = len(state)
            _, pairs = self._contributions(state)
            turns = [(fields[:, :, mode_count:], tangent) for fields, tangent in pairs]
            turn.append(sum(np.sum(d * (tangent @ d)) for d, tangent in turns) / 3.0)
            forces, _ = self.rows(state, unscaled, with_stiffness=False)
            sizes.append(_size(forces[:mode_count]))
        # A part that is never stressed gives no turning stiffness, or one that rounding makes
        # negative; any scale will do then.
        rotation = max(float(np.mean(turn)), 0.0) ** 0.5 or 1.0
        return RowScales(rotation, force_floor * max(sizes))

    def rows(
        self, state: np.ndarray, scales: RowScales, *, with_stiffness: bool
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Scaled forces and moment, and stiffness entries (pair, column).

        Forces are those of the elastic stress and the moment, (mode + 3, column), and below them of
        the branches if they had the whole strain, (mode, column), where the solid has any.
        """
        mode_count = len(state)
        forces, pairs = self._contributions(state)
        inverse = np.zeros((mode_count + 3, mode_count + 3))
        inverse[:mode_count, :mode_count] = self._inverse_factor(state, pairs)
        inverse[mode_count:, mode_count:] = np.eye(3) / scales.rotation
        force_rows = (inverse @ forces) @ self.columns
        if self.relaxing:
            scaled = inverse[:mode_count, :mode_count] @ self._relaxing_forces(state)
            force_rows = np.concatenate([force_rows, scaled @ self.columns])
        if not with_stiffness:
            return force_rows, None
        first, second = np.triu_indices(mode_count + 3)
        entries = []
        for fields, tangent in pairs:
            scaled = fields @ inverse.T
            matrices = np.swapaxes(scaled, 1, 2) @ (tangent @ scaled)
            entries.append(matrices[:, first, second].T)
        rows = np.concatenate(entries, axis=1)
        rows[first != second] *= 2**0.5  # an off-diagonal entry stands for two
        return force_rows, rows @ self.columns

    def _relaxing_forces(self, state: np.ndarray) -> np.ndarray:
        """Force of springs that have the whole strain of the solid, (mode, element)."""
        solid = self.elements[0]
        gradient = solid.gradients(state)
        strain = 0.5 * (np.swapaxes(gradient, 1, 2) @ gradient - np.eye(3))
        stress = 2.0 * solid.weighted_lame_constants[1][:, None, None] * (gradient @ strain)
        forces = np.zeros((len(state), self.columns.shape[0]))
        forces[:, : len(stress)] = -np.einsum("pia,piam->mp", stress, solid.mode_gradient)
        return forces

    def _inverse_factor(
        self, state: np.ndarray, pairs: list[tuple[np.ndarray, np.ndarray]]
    ) -> np.ndarray:
        """L^-1 of the reduced stiffness L L^T, (mode, mode)."""
        mode_count = len(state)
        stiffness = self.linear_stiffness.copy()
        for each in self.mixed:
            stiffness += each.stiffness(state)
        for fields, tangent in pairs:
            modal = fields[:, :, :mode_count]
            stiffness += modal.reshape(-1, mode_count).T @ (tangent @ modal).reshape(-1, mode_count)
        inverse: np.ndarray = np.linalg.inv(np.linalg.cholesky(stiffness))
        return inverse

    def cubatures(self, weight: np.ndarray) -> tuple[Cubature, ...]:
        """Weights of columns as weighted elements of each group."""
        each = self.columns @ weight
        ends = np.cumsum([len(elements.rest) for elements in self.elements])
        return tuple(Cubature.from_weights(part) for part in np.split(each, ends[:-1]))

    def _contributions(
        self, state: np.ndarray
    ) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        # Force on the modes and moment about the frame's origin, (mode + 3, element); and for
        # each group the gradients of modes and turns with the tangent between them.
        forces, pairs = [], []
        for elements in self.elements:
            gradient = elements.gradients(state)
            # Gradients of the fields: those of the modes, and of the unit rotations e_j x x.
            turns = np.stack([np.cross(axis, gradient, axisb=1, axisc=1) for axis in np.eye(3)], 3)
            fields = np.concatenate([elements.mode_gradient, turns], axis=3)
            fields = fields.reshape(len(fields), 3 * elements.dimension, fields.shape[3])
            stress = elements.stress(gradient, self.rotation)
            forces.append(-(stress.reshape(len(stress), 1, fields.shape[1]) @ fields)[:, 0].T)
            pairs.append((fields, elements.published_tangent(gradient, self.rotation)))
        return np.concatenate(forces, axis=1), pairs
