"""Full-order part and snapshots in, reduced part and its error report out."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sparse

from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import MeshError
from pneumorph.reduction.assemble import assemble_reduced_part, sampled_groups
from pneumorph.reduction.blocked_force import even_load
from pneumorph.reduction.ecsw import ecsw
from pneumorph.reduction.errors import (
    ReducedBend,
    ReducedBlockedForce,
    force_errors,
    node_errors_mm,
    reduced_bend,
    reduced_blocked_force,
    reduced_compliance,
)
from pneumorph.reduction.learned_fields import (
    Progress,
    WeightedChange,
    evenly,
    learned_modes,
    learned_pressures,
    learned_stresses,
    pod_metric,
    split_snapshots,
    weighted_changes,
)
from pneumorph.reduction.mixed_sheet import scaled_strain
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_range import snapshot_range
from pneumorph.reduction.snapshots import BEND, SnapshotSet
from pneumorph.reduction.tip_answers import TipAnswers, tip_answers

ANSWERED_BENDS = 7
"""Free bends, beside rest, at which the tip's answers to small forces are found."""


@dataclass(frozen=True)
class ReductionReport:
    """Measured errors and costs of a reduction; errors in percent or millimetres."""

    mode_count: int
    symmetric_mode_count: int
    projection_error: float
    """Relative, in the POD's norm; the mode tolerance bounds it unless the mode limit cuts."""
    tetrahedron_count: int
    """Sampled integration points of the solid; a linear element has one."""
    membrane_count: int
    """The same of the membrane."""
    pressure_count: int
    """Pressures that the volumes of a nearly incompressible part are seen by."""
    stress_count: int
    """Fields of stress that a stiff membrane is seen by."""
    sampling_residual: float
    """||G w - b|| / ||b|| of the element selection."""
    sampling_converged: bool
    training_node_error_mm: float
    """Mean over snapshots and nodes of the distance to the nearest modal state."""
    heldout_node_error_mm: float
    """The same for snapshots not used."""
    heldout_worst_node_error_mm: float
    """Mean over nodes in the worst snapshot not used."""
    heldout_force_error_percent: float
    """Root mean square over snapshots not used of the sampled force's relative error."""
    bend_error_percent: float | None
    """Largest error of the bend against the full model over the pressures of `bend`, and of each
    cavity alone; none of a part without cavity."""
    bend_error_unsampled_percent: float | None
    """The same with every element: the part of the modes alone."""
    bend: dict[str, list[float]]
    """Pressure [kPa], bend of the full and the reduced part [degrees], mean node error [mm]."""
    bend_of_cavities: dict[str, dict[str, list[float]]] = field(default_factory=dict, kw_only=True)
    """The same by the cavity that is inflated alone, where there are several; the bend is the end
    face's turn about any axis."""
    blocked_error_percent: float | None
    """Largest error of the force that keeps the tip down, over the pressures of `blocked`; None
    where no snapshot has a blocked tip."""
    blocked_error_unsampled_percent: float | None
    """The same with every element."""
    blocked: dict[str, list[float]]
    """Pressure [kPa], force of the full and the reduced part [mN]."""
    compliance_error_percent: float | None
    """Largest error of the tip's compliance under small forces over the pressures of `compliance`,
    by Frobenius' norm; none of a part without cavity or outer end face, or on a soft mount."""
    compliance: dict[str, list[float]]
    """Pressure [kPa], the tip's way along each axis under a force along it [mm/N], of the full and
    the reduced part."""
    snapshot_count: int
    stage_seconds: dict[str, float]
    """Wall time of each stage [s]."""
    peak_memory_mb: float
    """Largest resident memory of the process so far [MB]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-serialisable content."""
        return asdict(self)


def reduce_part(
    part: PartModel,
    snapshots: SnapshotSet,
    settings: ReductionSettings | None = None,
    progress: Progress | None = None,
    *,
    report_pressure_kPa: float = 350.0,
    mount_stiffness: np.ndarray | None = None,
) -> tuple[ReducedPart, ReductionReport]:
    """Reduce a part: one that is held at its attachment, or one that moves freely.

    The modes live in the frame that the snapshots were brought into: that of the hub the part is
    mounted on, or for a free part, such as a disk, that of its own rigid motion (`free_part.py`).

    Args:
        part: The full-order part.
        snapshots: States of it, read in blocks, so that files of any length fit; of a part with a
            cavity among them free-bending equilibria (source ``bend``) in order of pressure.
        settings: Tolerances and limits.
        progress: Called with done, total and a message.
        report_pressure_kPa: The bend error is measured up to this pressure.
        mount_stiffness: Of a soft hub against the attachment nodes [mN/mm], (3 attachment, 3
            attachment), see `mount_stiffness.py`; None holds them.

    Raises:
        ValueError: The part has several membranes, or the snapshots belong to another mesh or hold
            no free bending, or the settings ask for what the part has not.
        MeshError: The part has no outer end face whose answers modes could learn.
    """
    settings = settings or ReductionSettings()
    clock = _Clock(progress)
    digest = part.mesh.digest()
    if snapshots.metadata.get("mesh_digest") != digest:
        raise ValueError(
            f"snapshots must be of the part's mesh {digest[:12]}, got the mesh "
            f"{str(snapshots.metadata.get('mesh_digest'))[:12]}; collect them again"
        )
    bend = snapshots.of("bend")
    if part.cavities and len(bend) == 0:
        raise ValueError(
            "snapshots must hold free-bending equilibria (source 'bend'); without them a basis "
            "can be 30 % too stiff in free air"
        )
    _check_options(part, settings, mount_stiffness)
    training, heldout = split_snapshots(snapshots, settings)
    mirror_nodes = part.mesh.mirror_nodes if settings.symmetric else None

    clock.start("metric")
    metric = pod_metric(part, snapshots, training, settings, mount_stiffness)
    shown = bend[snapshots.pressure_kPa[bend] <= report_pressure_kPa]
    directions = _directions(part, snapshots, shown)
    answers = None
    if settings.answer_share > 0.0:
        clock.start("answers to forces")
        answers = _answers(part, snapshots, directions, settings)

    clock.start("modes")
    basis = learned_modes(
        part, snapshots, training, answers, metric, mirror_nodes, settings, progress
    )

    def changes() -> Iterator[WeightedChange]:
        return weighted_changes(part, snapshots, training, answers, metric, settings)

    pressures = learned_pressures(part, changes(), settings)
    stresses = learned_stresses(part, changes(), settings)
    every = assemble_reduced_part(
        part,
        basis.modes,
        mount_stiffness=mount_stiffness,
        pressure_fields=pressures,
        stress_fields=stresses,
    )

    clock.start("bend of the modes")

    def bending(reduced: ReducedPart) -> dict[str, ReducedBend]:
        return {
            source: reduced_bend(
                reduced,
                part.mesh,
                snapshots.states(numbers),
                snapshots.pressure_kPa[numbers],
                settings.rotation,
                cavities=cavities,
            )
            for source, (numbers, cavities) in directions.items()
        }

    ideal = bending(every)
    clock.start("blocked force of the modes")
    ideal_blocked = _blocked(every, part, snapshots, settings)

    clock.start("sampled elements")
    trained = evenly(training, settings.training_state_limit)
    alpha = _nearest_states(snapshots.states(trained), every.modes, metric)
    own = np.zeros((0, every.mode_count))
    if settings.bend_share > 0.0:
        found = [each.alpha[~np.isnan(each.reduced_deg)] for each in ideal.values()]
        own = np.concatenate([own, *found])
    if ideal_blocked and settings.blocked_share > 0.0:
        own = np.concatenate([own, ideal_blocked.alpha])
    weights = np.repeat([1.0, settings.ecsw.equilibrium_weight], [len(alpha), len(own)])
    chosen = ecsw(
        sampled_groups(part, stresses),
        every.modes,
        np.concatenate([alpha, own]),
        settings.ecsw,
        rotation=settings.rotation,
        weights=weights,
        mirror_nodes=mirror_nodes,
        linear_stiffness=every.linear_stiffness,
        mixed=(every.dilatation, every.sheet),
        relaxing=part.branches is not None,
        progress=progress,
    )

    clock.start("errors")
    sampled = assemble_reduced_part(
        part,
        basis.modes,
        chosen.cubatures,
        every.contact_modes,
        mount_stiffness=mount_stiffness,
        pressure_fields=pressures,
        stress_fields=stresses,
    )
    curves = bending(sampled)
    compliance = None
    # A soft mount gives way besides.
    if BEND in curves and mount_stiffness is None and _has_end_face(part):
        bent = snapshots.states(directions[BEND][0])
        compliance = reduced_compliance(sampled, part, bent, curves[BEND], settings.rotation)
    blocked = _blocked(sampled, part, snapshots, settings)
    node_error, reached = _nearest_of_all(snapshots, every.modes, metric)
    sampled = replace(
        sampled,
        snapshot_range=snapshot_range(reached, None if mirror_nodes is None else basis.parity),
    )
    measured = heldout if len(heldout) else training
    tried = _nearest_states(snapshots.states(evenly(measured, 100)), every.modes, metric)
    force_error = force_errors(sampled, every, tried, settings.rotation)
    clock.stop()
    report = ReductionReport(
        mode_count=sampled.mode_count,
        symmetric_mode_count=int((basis.parity > 0).sum()),
        projection_error=basis.projection_error,
        tetrahedron_count=len(sampled.tetrahedron_index),
        membrane_count=len(sampled.membrane_index),
        pressure_count=len(sampled.dilatation_1),
        stress_count=len(sampled.stretch_1),
        sampling_residual=chosen.relative_residual,
        sampling_converged=chosen.converged,
        training_node_error_mm=float(node_error[training].mean()),
        heldout_node_error_mm=float(node_error[measured].mean()),
        heldout_worst_node_error_mm=float(node_error[measured].max()),
        heldout_force_error_percent=float(100.0 * np.sqrt(np.mean(force_error**2))),
        bend_error_percent=_worst(curves),
        bend_error_unsampled_percent=_worst(ideal),
        bend=curves[BEND].table() if BEND in curves else {},
        bend_of_cavities={
            name.removeprefix(f"{BEND} of "): curve.table()
            for name, curve in curves.items()
            if name != BEND
        },
        blocked_error_percent=blocked.worst_percent if blocked else None,
        blocked_error_unsampled_percent=ideal_blocked.worst_percent if ideal_blocked else None,
        blocked=blocked.table() if blocked else {},
        compliance_error_percent=compliance.worst_percent if compliance else None,
        compliance=compliance.table() if compliance else {},
        snapshot_count=len(snapshots),
        stage_seconds=clock.seconds,
        peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    )
    sampled.metadata.update(
        settings=settings_to_dict(settings),
        report=report.to_dict(),
        snapshots={"sources": snapshots.sources, "details": snapshots.metadata.get("details")},
    )
    return sampled, report


def _check_options(
    part: PartModel, settings: ReductionSettings, mount_stiffness: np.ndarray | None
) -> None:
    """Refuse, before anything is computed, what the part cannot be reduced with."""
    if settings.stress_limit > 0 and part.membranes:
        scaled_strain(part.element_groups[1], part.rest_nodes)
    if settings.answer_share > 0.0:
        if mount_stiffness is not None or not part.cavities:
            kind = "on a soft mount" if mount_stiffness is not None else "without a cavity"
            raise ValueError(
                f"answer_share is {settings.answer_share}, expected 0 of a part {kind}: how its "
                "tip answers forces is found with the attachment held, at free bends"
            )
        even_load(part.mesh, "outer_end_face")


def _has_end_face(part: PartModel) -> bool:
    """Whether its outer end is a face that forces can be spread over."""
    try:
        even_load(part.mesh, "outer_end_face")
    except MeshError:
        return False
    return True


def _directions(
    part: PartModel, snapshots: SnapshotSet, bend: np.ndarray
) -> dict[str, tuple[np.ndarray, Sequence[str]]]:
    """Numbers of free bends by source, and which cavities are inflated in them; none of a part
    without cavities."""
    found: dict[str, tuple[np.ndarray, Sequence[str]]] = {}
    for place, source in enumerate(snapshots.sources if part.cavities else ()):
        alone = [name for name in part.cavity_names if source == f"{BEND} of {name}"]
        name = source if alone else BEND
        before, _ = found.get(name, (bend[:0], ()))
        numbers = np.concatenate([before, bend[snapshots.source[bend] == place]])
        if len(numbers):
            found[name] = (numbers, alone or part.cavity_names)
    return found


def _answers(
    part: PartModel,
    snapshots: SnapshotSet,
    directions: Mapping[str, tuple[np.ndarray, Sequence[str]]],
    settings: ReductionSettings,
) -> TipAnswers:
    """How the tip answers forces at rest and at some of the free bends in every direction."""
    states, pressures = [np.zeros((1, *part.rest_nodes.shape))], [np.zeros((1, len(part.cavities)))]
    for numbers, cavities in directions.values():
        few = evenly(numbers, ANSWERED_BENDS)
        inflated = np.isin(part.cavity_names, cavities)
        states.append(snapshots.states(few))
        pressures.append(snapshots.pressure_kPa[few, None] * inflated)
    return tip_answers(part, np.concatenate(states), np.concatenate(pressures), settings.rotation)


def _worst(curves: Mapping[str, ReducedBend]) -> float | None:
    return max((curve.worst_percent for curve in curves.values()), default=None)


def _nearest_states(
    displacement: np.ndarray, modes: np.ndarray, metric: sparse.csr_array
) -> np.ndarray:
    """Modal coordinates nearest to displacements (snapshot, node, 3) in the metric."""
    basis = modes.reshape(-1, modes.shape[2])
    weighted = metric @ basis
    right = displacement.reshape(len(displacement), -1) @ weighted
    return np.linalg.solve(basis.T @ weighted, right.T).T


def _nearest_of_all(
    snapshots: SnapshotSet, modes: np.ndarray, metric: sparse.csr_array
) -> tuple[np.ndarray, np.ndarray]:
    """Mean distance of the nodes from the nearest modal state [mm], of every snapshot, (snapshot,),
    and the modal coordinates of these states, (snapshot, mode)."""
    errors, states = [], []
    for block in snapshots.blocks(np.arange(len(snapshots))):
        displacement = block.astype(np.float64)
        alpha = _nearest_states(displacement, modes, metric)
        errors.append(node_errors_mm(displacement, modes, alpha))
        states.append(alpha)
    return np.concatenate(errors), np.concatenate(states)


def _blocked(
    reduced: ReducedPart, part: PartModel, snapshots: SnapshotSet, settings: ReductionSettings
) -> ReducedBlockedForce | None:
    """Blocked force beside that of the snapshots; None where none has a blocked tip."""
    there = snapshots.of("blocked")
    if len(there) == 0:
        return None
    details = snapshots.metadata["details"][snapshots.sources.index("blocked")]
    return reduced_blocked_force(
        reduced,
        part.mesh,
        np.array(details["force_mN"]),
        snapshots.pressure_kPa[there],
        settings.rotation,
        details["face"],
    )


class _Clock:
    """Wall time of named stages."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress
        self._name, self._since = "", 0.0

    def start(self, name: str) -> None:
        self.stop()
        self._name, self._since = name, time.perf_counter()
        if self._progress:
            self._progress(0, 1, name)

    def stop(self) -> None:
        if self._name:
            self.seconds[self._name] = time.perf_counter() - self._since
        self._name = ""
