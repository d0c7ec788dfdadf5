"""How far a reduced part is from the full-order part it stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse

from pneumorph.fem.bend import end_face_bend_deg, end_face_turn_deg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static_answers import UnstableError
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.modal_equilibrium import rising_modal_equilibria
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshots import SnapshotSet
from pneumorph.reduction.tip_compliance import reduced_tip_compliance, tip_compliance

LEAST_SHARE = 0.05
"""Values below this share of a curve's largest are compared as if they were as large: a hundredth
of a degree at the first pressure says nothing."""


@dataclass(frozen=True)
class ReducedBend:
    """Free bending of the reduced part beside that of the full one, held at the attachment."""

    pressure_kPa: np.ndarray
    """(step,)"""
    full_deg: np.ndarray
    """Turn of the outer end face, (step,)."""
    reduced_deg: np.ndarray
    """The same of the reduced part; NaN where it found no equilibrium, (step,)."""
    node_error_mm: np.ndarray
    """Mean distance of the nodes, (step,)."""
    alpha: np.ndarray
    """Modal coordinates of the reduced equilibria, (step, mode)."""

    @property
    def error_percent(self) -> np.ndarray:
        """Difference over the full bend, or over `LEAST_SHARE` of the largest, (step,)."""
        return _error_percent(self.reduced_deg, self.full_deg)

    @property
    def worst_percent(self) -> float:
        """Largest absolute error; infinite if an equilibrium is missing."""
        return _worst(self.error_percent)

    def table(self) -> dict[str, list[float]]:
        """Columns by name; -1 where the reduced part found no equilibrium."""
        return {
            "pressure_kPa": self.pressure_kPa.tolist(),
            "full_deg": self.full_deg.tolist(),
            "reduced_deg": _listed(self.reduced_deg),
            "node_error_mm": self.node_error_mm.tolist(),
        }


def reduced_bend(
    reduced: ReducedPart,
    mesh: Mesh,
    displacement: np.ndarray,
    pressure_kPa: np.ndarray,
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
    cavities: Sequence[str] | None = None,
) -> ReducedBend:
    """Bend a reduced part through the pressures of full-order equilibria.

    Args:
        reduced: The reduced part.
        mesh: Mesh of both.
        displacement: Full-order equilibria in order of pressure [mm], (step, node, 3).
        pressure_kPa: Their pressures, (step,).
        rotation: Where the elements take their rotation from.
        region: Node set of the outer end face.
        cavities: Surface regions that are inflated in these equilibria; None for every cavity. Of
            some of several the bend is the end face's turn about any axis: it may be sideways.
    """
    every = cavity_regions(mesh)
    inflated = np.ones(reduced.cavity_count)
    angle = end_face_bend_deg
    if cavities is not None and len(cavities) < len(every):
        inflated = np.array([float(name in cavities) for name in every])
        angle = end_face_turn_deg
    states, full, bent, distance = [], [], [], []
    each_kPa = (float(pressure) * inflated for pressure in pressure_kPa)
    found = rising_modal_equilibria(reduced, each_kPa, rotation)
    for moved, result in zip(displacement, found, strict=True):
        x = reduced.positions(result.alpha)
        full_x = mesh.nodes + moved
        full.append(angle(mesh, full_x, region))
        bent.append(angle(mesh, x, region) if result.converged else np.nan)
        distance.append(float(np.linalg.norm(x - full_x, axis=1).mean()))
        states.append(result.alpha)
    return ReducedBend(
        np.asarray(pressure_kPa, dtype=float),
        np.array(full),
        np.array(bent),
        np.array(distance),
        np.array(states).reshape(-1, reduced.mode_count),
    )


@dataclass(frozen=True)
class ReducedBlockedForce:
    """Force that keeps the tip of the reduced part down, beside that of the full one."""

    pressure_kPa: np.ndarray
    """(step,)"""
    full_mN: np.ndarray
    """(step,)"""
    reduced_mN: np.ndarray
    """NaN from the first that has no equilibrium on, (step,)."""
    alpha: np.ndarray
    """Modal coordinates of the reduced equilibria that were found, (found, mode)."""

    @property
    def worst_percent(self) -> float:
        """Largest absolute error, relative as that of a bend; infinite if an equilibrium is
        missing."""
        return _worst(_error_percent(self.reduced_mN, self.full_mN))

    def table(self) -> dict[str, list[float]]:
        """Columns by name; -1 where the reduced part found no equilibrium."""
        return {
            "pressure_kPa": self.pressure_kPa.tolist(),
            "full_mN": self.full_mN.tolist(),
            "reduced_mN": _listed(self.reduced_mN),
        }


def reduced_blocked_force(
    reduced: ReducedPart,
    mesh: Mesh,
    force_mN: np.ndarray,
    pressure_kPa: np.ndarray,
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> ReducedBlockedForce:
    """Keep the tip of a reduced part down through the pressures of full-order equilibria.

    Args:
        reduced: The reduced part.
        mesh: Mesh of both.
        force_mN: What the full part takes (`pneumorph.reduction.blocked_force`), (step,).
        pressure_kPa: Rising, (step,).
        rotation: Where the elements take their rotation from.
        region: Node set of the outer end face.
    """
    found = list(blocked_forces(reduced, mesh, pressure_kPa.tolist(), rotation, region))
    forces = np.full(len(pressure_kPa), np.nan)
    forces[: len(found)] = [each.force_mN for each in found]
    states = np.array([each.alpha for each in found]).reshape(-1, reduced.mode_count)
    return ReducedBlockedForce(pressure_kPa, force_mN, forces, states)


@dataclass(frozen=True)
class ReducedCompliance:
    """How far the tip of the reduced part gives way under small forces, beside the full one's."""

    pressure_kPa: np.ndarray
    """(step,)"""
    full_mm_per_N: np.ndarray
    """`tip_compliance`, (step, 3, 3)."""
    reduced_mm_per_N: np.ndarray
    """NaN where the reduced part found no equilibrium, (step, 3, 3)."""

    @property
    def error_percent(self) -> np.ndarray:
        """Size of the difference over that of the full compliance, by Frobenius' norm, (step,)."""
        full, reduced = self.full_mm_per_N, self.reduced_mm_per_N
        error: np.ndarray = np.linalg.norm(reduced - full, axis=(1, 2))
        return 100.0 * error / np.linalg.norm(full, axis=(1, 2))

    @property
    def worst_percent(self) -> float:
        """Largest of them; infinite if an equilibrium is missing."""
        return _worst(self.error_percent)

    def table(self) -> dict[str, list[float]]:
        """Columns by name, along each axis of the part under a force along it; -1 where the reduced
        part found no equilibrium."""
        columns = {"pressure_kPa": self.pressure_kPa.tolist()}
        for place, axis in enumerate("xyz"):
            columns[f"full_{axis}_mm_per_N"] = self.full_mm_per_N[:, place, place].tolist()
            columns[f"reduced_{axis}_mm_per_N"] = _listed(self.reduced_mm_per_N[:, place, place])
        return columns


def reduced_compliance(
    reduced: ReducedPart,
    part: PartModel,
    displacement: np.ndarray,
    bend: ReducedBend,
    rotation: Rotation = "edge",
    count: int = 4,
) -> ReducedCompliance | None:
    """Compare the tips' compliances at some equilibria of free bending, each model's own; None
    where none of them is stable.

    Args:
        reduced: The reduced part.
        part: The full-order one, with a cavity and an outer end face.
        displacement: Its equilibria in order of pressure [mm], (step, node, 3).
        bend: The reduced part's at the same pressures.
        rotation: Where the elements take their rotation from.
        count: At most so many of them, the last among them.
    """
    chosen = np.unique(np.linspace(0, len(displacement) - 1, count + 1)[1:].round().astype(int))
    inflated = np.isin(cavity_regions(part.mesh), part.cavity_names)
    steps: list[int] = []
    full, own = [], []
    for step in chosen.tolist():
        kPa = float(bend.pressure_kPa[step])
        try:
            exact = tip_compliance(part, part.rest_nodes + displacement[step], kPa, rotation)
        except UnstableError:
            continue
        answer = np.full((3, 3), np.nan)
        if not np.isnan(bend.reduced_deg[step]):
            answer = reduced_tip_compliance(
                reduced, part.mesh, bend.alpha[step], kPa * inflated, rotation
            )
        steps.append(step)
        full.append(exact)
        own.append(answer)
    if not steps:
        return None
    return ReducedCompliance(bend.pressure_kPa[steps], 1e3 * np.array(full), 1e3 * np.array(own))


def node_errors_mm(displacement: np.ndarray, modes: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Mean distance of the nodes from Phi alpha in each snapshot [mm], (snapshot,)."""
    rebuilt = (modes.reshape(-1, modes.shape[2]) @ alpha.T).T.reshape(displacement.shape)
    distance: np.ndarray = np.linalg.norm(displacement - rebuilt, axis=2).mean(axis=1)
    return distance


def nearest_states(
    displacement: np.ndarray, modes: np.ndarray, metric: sparse.csr_array
) -> np.ndarray:
    """Modal coordinates nearest to displacements (snapshot, node, 3) in the metric."""
    basis = modes.reshape(-1, modes.shape[2])
    weighted = metric @ basis
    right = displacement.reshape(len(displacement), -1) @ weighted
    return np.linalg.solve(basis.T @ weighted, right.T).T


def nearest_of_all(
    snapshots: SnapshotSet, modes: np.ndarray, metric: sparse.csr_array
) -> tuple[np.ndarray, np.ndarray]:
    """Mean distance of the nodes from the nearest modal state [mm], of every snapshot, (snapshot,),
    and the modal coordinates of these states, (snapshot, mode)."""
    errors, states = [], []
    for block in snapshots.blocks(np.arange(len(snapshots))):
        displacement = block.astype(np.float64)
        alpha = nearest_states(displacement, modes, metric)
        errors.append(node_errors_mm(displacement, modes, alpha))
        states.append(alpha)
    return np.concatenate(errors), np.concatenate(states)


def force_errors(
    sampled: ReducedPart, every: ReducedPart, states: np.ndarray, rotation: Rotation = "edge"
) -> np.ndarray:
    """Relative error of the sampled internal force at states (state, mode): (state,).

    In the norm of L^-1 with L L^T the reduced stiffness: the energy of the displacement that the
    error causes, over that which the whole force causes.
    """
    errors = []
    for state in states:
        lower = np.linalg.cholesky(every.stiffness(state, rotation))
        exact = every.internal_force(state, rotation)
        difference = sampled.internal_force(state, rotation) - exact
        size = float(np.linalg.norm(np.linalg.solve(lower, exact)))
        errors.append(float(np.linalg.norm(np.linalg.solve(lower, difference))) / max(size, 1e-300))
    return np.array(errors)


def _error_percent(reduced: np.ndarray, full: np.ndarray) -> np.ndarray:
    size = np.abs(full)
    error: np.ndarray = 100.0 * (reduced - full) / np.maximum(size, LEAST_SHARE * size.max())
    return error


def _worst(error_percent: np.ndarray) -> float:
    largest = float(np.abs(error_percent).max())
    return largest if np.isfinite(largest) else float("inf")


def _listed(values: np.ndarray) -> list[float]:
    return [float(value) if np.isfinite(value) else -1.0 for value in values]
