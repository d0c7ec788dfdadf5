"""Energy-conserving sampling and weighting: few elements that stand for all of them.

At training states alpha_s each element e contributes a generalised force Phi^T f_e(alpha_s). ECSW
looks for few non-negative weights with sum_e w_e Phi^T f_e = sum_e Phi^T f_e at all states
(Farhat et al. 2014). Non-negative weights keep the part's stiffness positive semi-definite.

**Scaling.** A force error df moves the part by K^-1 df, so the rows of a state are multiplied by
L^-1 of its reduced stiffness K = L L^T: their norm is then the energy of the displacement the error
causes. Each state is divided by the size of its own force (with a floor), so gently inflated states
count as much as strongly inflated ones. The hyperreduction tolerance t bounds the relative residual
||G w - b|| <= t ||b|| of these scaled rows.

**Rigid turns.** The rows also hold the moment of the internal force about the part's frame (not
zero with edge-based rotations) and, at some states, the stiffness itself between modes and
rotations: damping proportional to stiffness couples the rates of the modes and the hub's rotation.

**Mirror pairs.** With symmetric and antisymmetric modes an element and its mirror image share one
column and one weight, so a mirrored motion of the sampled part is the mirrored motion, exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sparse

from pneumorph.fem.rotation import Rotation
from pneumorph.reduction.assemble import Cubature, sample_elements
from pneumorph.reduction.full_part import ElementGroup
from pneumorph.reduction.sampled_elements import (
    SampledElements,
    rotated_stress,
    strain_factors,
)
from pneumorph.reduction.sparse_nnls import NormalEquations, sparse_nnls

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class EcswSettings:
    """How the sampled elements are chosen."""

    hyperreduction_tolerance: float = 0.001
    """Relative residual of the scaled force rows at which no more elements are added."""
    element_limit: int = 240
    """At most so many sampled elements, tetrahedra and membrane triangles together."""
    stiffness_state_count: int = 24
    """Number of training states at which the stiffness is trained too."""
    stiffness_weight: float = 0.2
    """Weight of all stiffness rows against all force rows."""
    force_floor: float = 0.05
    """Smallest force a state is divided by, as a fraction of the largest."""


@dataclass(frozen=True)
class EcswResult:
    """Sampled elements of each group and the errors of their sums."""

    cubatures: tuple[Cubature, ...]
    relative_residual: float
    """||G w - b|| / ||b|| over all scaled rows."""
    converged: bool
    """Whether the tolerance was met before `element_limit`."""
    force_error: np.ndarray
    """Relative error of the scaled generalised force at each training state, (state,)."""


def ecsw(
    groups: Sequence[ElementGroup],
    modes: np.ndarray,
    states: np.ndarray,
    settings: EcswSettings,
    *,
    rotation: Rotation = "edge",
    mirror_nodes: np.ndarray | None = None,
    progress: Progress | None = None,
) -> EcswResult:
    """Choose elements and weights.

    Args:
        groups: Element groups of the part, sampled together.
        modes: Mode shapes, (node, 3, mode); symmetric or antisymmetric if ``mirror_nodes`` given.
        states: Training states, modal coordinates (state, mode).
        settings: Tolerances and limits.
        rotation: Where the elements take their rotation from.
        mirror_nodes: Mirror image of each node, (node,), to pair elements.
        progress: Called with done, total and a message.

    Raises:
        ValueError: No training state, or a mirror image of an element is missing.
    """
    if len(states) == 0:
        raise ValueError("states must hold at least one training state, got none")
    training = TrainingRows.build(groups, modes, mirror_nodes, rotation)
    scales = training.scales(states, settings)
    # Evenly spread over the states, which are ordered by protocol and load.
    stiff = set(
        np.unique(np.linspace(0, len(states) - 1, settings.stiffness_state_count).astype(int))
        if settings.stiffness_state_count > 0
        else []
    )
    problem = NormalEquations.empty(training.column_count)
    stiffness_scale = settings.stiffness_weight * np.sqrt(len(states) / max(len(stiff), 1))
    for number, state in enumerate(states):
        rows = training.force_rows(state, scales)
        rows /= max(float(np.linalg.norm(rows.sum(axis=1))), scales.force_floor)
        problem.add(rows, rows.sum(axis=1))
        if number in stiff:
            rows = training.stiffness_rows(state, scales)
            rows *= stiffness_scale / np.linalg.norm(rows.sum(axis=1))
            problem.add(rows, rows.sum(axis=1))
        if progress:
            progress(number + 1, len(states), "element rows")

    column_limit = settings.element_limit
    if mirror_nodes is not None:
        column_limit = max(1, column_limit // 2)
    solution = sparse_nnls(problem, settings.hyperreduction_tolerance, column_limit)
    force_error = np.empty(len(states))
    for number, state in enumerate(states):
        rows = training.force_rows(state, scales)
        total = rows.sum(axis=1)
        error = np.linalg.norm(rows @ solution.weight - total)
        force_error[number] = error / max(float(np.linalg.norm(total)), scales.force_floor)
    return EcswResult(
        cubatures=training.cubatures(solution.weight),
        relative_residual=solution.relative_residual,
        converged=solution.converged,
        force_error=force_error,
    )


@dataclass(frozen=True)
class RowScales:
    """What rows are divided by."""

    rotation: float
    """Root of the mean stiffness against rigid turns over the training states."""
    force_floor: float


@dataclass(frozen=True)
class TrainingRows:
    """Contributions of every element, or mirror pair of elements, to the reduced force."""

    elements: tuple[SampledElements, ...]
    columns: sparse.csr_matrix
    """Adds up the contributions of elements that share a weight, (element, column)."""
    rotation: Rotation

    @classmethod
    def build(
        cls,
        groups: Sequence[ElementGroup],
        modes: np.ndarray,
        mirror_nodes: np.ndarray | None,
        rotation: Rotation,
    ) -> TrainingRows:
        owner, offset = [], 0
        for group in groups:
            column = np.arange(len(group.connectivity))
            if mirror_nodes is not None:
                column = shared_columns(group.connectivity, mirror_nodes)
            owner.append(offset + column)
            offset += int(column.max(initial=-1)) + 1
        column = np.concatenate(owner)
        element_count = len(column)
        columns = sparse.csr_matrix(
            (np.ones(element_count), (np.arange(element_count), column)),
            shape=(element_count, offset),
        )
        elements = tuple(sample_elements(group, modes) for group in groups)
        return cls(elements, columns, rotation)

    @property
    def column_count(self) -> int:
        return int(self.columns.shape[1])

    def scales(self, states: np.ndarray, settings: EcswSettings) -> RowScales:
        """Scales that make force and moment rows of all states comparable."""
        turn, sizes = [], []
        mode_count = states.shape[1]
        for state in states:
            factor = np.concatenate(list(self._stiffness_factors(state)))
            flat = factor.reshape(-1, mode_count + 3)
            turn.append(np.square(flat[:, mode_count:]).sum() / 3.0)
            scaled = self._whiten(flat[:, :mode_count], self._forces(state)[:mode_count])
            sizes.append(np.linalg.norm(scaled.sum(axis=1)))
        # A part that is never stressed gives no turning stiffness; any scale will do then.
        rotation = float(np.sqrt(np.mean(turn))) or 1.0
        return RowScales(rotation, settings.force_floor * float(np.max(sizes)) or 1.0)

    def force_rows(self, state: np.ndarray, scales: RowScales) -> np.ndarray:
        """Scaled generalised force and moment of each column, (mode + 3, column)."""
        forces = self._forces(state)
        mode_count = len(state)
        factor = np.concatenate(list(self._stiffness_factors(state)))
        flat = factor.reshape(-1, mode_count + 3)[:, :mode_count]
        forces[:mode_count] = self._whiten(flat, forces[:mode_count])
        forces[mode_count:] /= scales.rotation
        return forces @ self.columns

    def stiffness_rows(self, state: np.ndarray, scales: RowScales) -> np.ndarray:
        """Scaled stiffness between modes and turns of each column, (pair, column)."""
        mode_count = len(state)
        factors = np.concatenate([f for f in self._padded_factors(state)])
        flat = factors[:, :, :mode_count].reshape(-1, mode_count)
        lower = np.linalg.cholesky(flat.T @ flat)
        whitened = np.empty_like(factors)
        whitened[:, :, :mode_count] = scipy.linalg.solve_triangular(
            lower, flat.T, lower=True
        ).T.reshape(*factors.shape[:2], mode_count)
        whitened[:, :, mode_count:] = factors[:, :, mode_count:] / scales.rotation
        first, second = np.triu_indices(mode_count + 3)
        rows = np.einsum("esp,esp->pe", whitened[:, :, first], whitened[:, :, second])
        rows[first != second] *= 2**0.5  # an off-diagonal entry stands for two
        return rows @ self.columns

    def cubatures(self, weight: np.ndarray) -> tuple[Cubature, ...]:
        """Weights of columns as weighted elements of each group."""
        each = self.columns @ weight
        ends = np.cumsum([len(elements.rest) for elements in self.elements])
        return tuple(Cubature.from_weights(part) for part in np.split(each, ends[:-1]))

    def _forces(self, state: np.ndarray) -> np.ndarray:
        # Force on the modes and moment about the frame's origin, (mode + 3, element).
        result = []
        for elements in self.elements:
            gradient = elements.gradients(state)
            stress = rotated_stress(
                gradient, elements.weighted_lambda, elements.weighted_mu, self.rotation
            )
            directions = self._directions(elements, gradient)
            result.append(-np.einsum("eid,eidm->me", stress, directions, optimize=True))
        return np.concatenate(result, axis=1)

    def _stiffness_factors(self, state: np.ndarray) -> list[np.ndarray]:
        factors = []
        for elements in self.elements:
            gradient = elements.gradients(state)
            factor = strain_factors(
                gradient,
                self._directions(elements, gradient),
                elements.weighted_lambda,
                elements.weighted_mu,
                self.rotation,
            )
            factors.append(factor.reshape(-1, factor.shape[2]))
        return factors

    def _padded_factors(self, state: np.ndarray) -> list[np.ndarray]:
        # Membranes have fewer strain components; zeros make all groups alike.
        width = max(1 + elements.rest.shape[2] ** 2 for elements in self.elements)
        padded = []
        for elements, flat in zip(self.elements, self._stiffness_factors(state), strict=True):
            factor = flat.reshape(len(elements.rest), -1, flat.shape[1])
            gap = width - factor.shape[1]
            padded.append(np.pad(factor, ((0, 0), (0, gap), (0, 0))))
        return padded

    @staticmethod
    def _directions(elements: SampledElements, gradient: np.ndarray) -> np.ndarray:
        # Gradients of the mode fields and of the three unit rotations e_j x x.
        turns = np.stack(
            [np.cross(axis, gradient, axisa=0, axisb=1, axisc=1) for axis in np.eye(3)], axis=3
        )
        return np.concatenate([elements.mode_gradient, turns], axis=3)

    @staticmethod
    def _whiten(factor: np.ndarray, forces: np.ndarray) -> np.ndarray:
        lower = np.linalg.cholesky(factor.T @ factor)
        return scipy.linalg.solve_triangular(lower, forces, lower=True)


def shared_columns(connectivity: np.ndarray, mirror_nodes: np.ndarray) -> np.ndarray:
    """Number the mirror pairs of elements: elements with equal numbers share one weight.

    Args:
        connectivity: Nodes of each element, (element, k).
        mirror_nodes: Mirror image of each node, (node,).

    Raises:
        ValueError: The mirror image of an element is not in the mesh.
    """
    own = np.sort(connectivity, axis=1)
    image = np.sort(mirror_nodes[connectivity], axis=1)
    position = {tuple(nodes): number for number, nodes in enumerate(own)}
    partner = np.array([position.get(tuple(nodes), -1) for nodes in image])
    if np.any(partner < 0):
        lonely = int(np.flatnonzero(partner < 0)[0])
        raise ValueError(
            f"mirror_nodes must map elements onto elements, but the image of element {lonely} "
            "is not in the mesh; the mesh is not symmetric under y -> -y"
        )
    _, column = np.unique(np.minimum(partner, np.arange(len(partner))), return_inverse=True)
    return column
