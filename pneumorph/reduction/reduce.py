"""Full-order part and snapshots in, reduced part and its error report out."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
import scipy.sparse as sparse

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive, Share
from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.ecsw import EcswSettings, ecsw
from pneumorph.reduction.errors import (
    ReducedBend,
    ReducedBlockedForce,
    force_errors,
    node_errors_mm,
    reduced_bend,
    reduced_blocked_force,
)
from pneumorph.reduction.incremental_pod import IncrementalPod
from pneumorph.reduction.mirror_pairs import mirror_elements
from pneumorph.reduction.mixed_dilatation import pressure_fields
from pneumorph.reduction.pod import Pod, joint_pod, leading_fields
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshot_range import snapshot_range
from pneumorph.reduction.snapshots import BEND, SnapshotSet

Progress = Callable[[int, int, str], None]

# Share of the mode tolerance that decomposing block by block may cost.
_STREAMING_SHARE = 0.1


@dataclass(frozen=True)
class ReductionSettings(Checked):
    """How a part is reduced."""

    norm: Literal["energy", "mass"] = "energy"
    """Inner product of the POD: the mean stiffness over the snapshots, or the mass."""
    mode_tolerance: Positive = 0.0032
    """Relative projection error of the snapshots at which to stop adding modes."""
    mode_limit: Count = 24
    """At most so many modes, whatever the tolerance asks for."""
    pressure_tolerance: Positive = 0.01
    """Of a nearly incompressible part: relative error of the snapshots' changes of volume at which
    to stop adding pressures."""
    pressure_limit: Count = 8
    """At most so many pressures, whatever the tolerance asks for."""
    symmetric: bool = True
    """Make modes symmetric or antisymmetric, and weights of mirrored elements equal, where the mesh
    has a mirror plane."""
    equal_snapshots: bool = True
    """Let every snapshot of a kind count alike. Otherwise each counts by its energy, so that those
    of the largest pressures count almost alone."""
    bend_share: Share = 0.3
    """Share of the free-bending equilibria in the weight of all snapshots."""
    load_share: Share = 0.2
    """Share of the loaded equilibria."""
    blocked_share: Share = 0.0
    """Share of the equilibria with a blocked tip; what remains is that of the robots' walks."""
    curve_tolerance: NotNegative = 0.0
    """Relative projection error at which the modes hold free bends and blocked tips, before any is
    spent on other snapshots; 0: by their shares alone."""
    rotation: Rotation = "edge"
    """Where elements take their rotation from while sampled elements are trained."""
    training_state_limit: Count = 240
    """At most so many snapshots train the sampled elements."""
    holdout_every: CountOrNone = 6
    """One snapshot in so many is kept out of the training, to measure errors on; free bending and
    blocked tips never are. 0: none."""
    ecsw: EcswSettings = field(default_factory=EcswSettings)
    """Choice of elements."""

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.bend_share + self.load_share + self.blocked_share
        if given > 1.0 + 1e-9:  # rounding
            raise ValueError(
                f"bend_share, load_share and blocked_share must add up to at most 1, got {given:g};"
                " what they leave is the share of the walks"
            )


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
            no free bending.
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
    training, heldout = _split(snapshots, settings)
    mirror_nodes = part.mesh.mirror_nodes if settings.symmetric else None

    clock.start("metric")
    metric = _metric(part, snapshots, training, settings, mount_stiffness)
    clock.start("modes")
    basis = _basis(part, snapshots, training, metric, mirror_nodes, settings, progress)
    pressures = _pressures(part, snapshots, training, metric, settings)
    every = assemble_reduced_part(
        part, basis.modes, mount_stiffness=mount_stiffness, pressure_fields=pressures
    )

    clock.start("bend of the modes")
    shown = bend[snapshots.pressure_kPa[bend] <= report_pressure_kPa]
    directions = _directions(part, snapshots, shown)

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
    trained = _evenly(training, settings.training_state_limit)
    alpha = _nearest_states(snapshots.states(trained), every.modes, metric)
    own = np.zeros((0, every.mode_count))
    if settings.bend_share > 0.0:
        found = [each.alpha[~np.isnan(each.reduced_deg)] for each in ideal.values()]
        own = np.concatenate([own, *found])
    if ideal_blocked and settings.blocked_share > 0.0:
        own = np.concatenate([own, ideal_blocked.alpha])
    weights = np.repeat([1.0, settings.ecsw.equilibrium_weight], [len(alpha), len(own)])
    chosen = ecsw(
        part.element_groups,
        every.modes,
        np.concatenate([alpha, own]),
        settings.ecsw,
        rotation=settings.rotation,
        weights=weights,
        mirror_nodes=mirror_nodes,
        linear_stiffness=every.linear_stiffness,
        dilatation=every.dilatation,
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
    )
    curves = bending(sampled)
    blocked = _blocked(sampled, part, snapshots, settings)
    node_error, reached = _nearest_of_all(snapshots, every.modes, metric)
    sampled = replace(
        sampled,
        snapshot_range=snapshot_range(reached, None if mirror_nodes is None else basis.parity),
    )
    measured = heldout if len(heldout) else training
    tried = _nearest_states(snapshots.states(_evenly(measured, 100)), every.modes, metric)
    force_error = force_errors(sampled, every, tried, settings.rotation)
    clock.stop()
    report = ReductionReport(
        mode_count=sampled.mode_count,
        symmetric_mode_count=int((basis.parity > 0).sum()),
        projection_error=basis.projection_error,
        tetrahedron_count=len(sampled.tetrahedron_index),
        membrane_count=len(sampled.membrane_index),
        pressure_count=len(sampled.dilatation_1),
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


def _worst(curves: Mapping[str, ReducedBend]) -> float | None:
    return max((curve.worst_percent for curve in curves.values()), default=None)


def _kinds(
    snapshots: SnapshotSet, settings: ReductionSettings
) -> tuple[tuple[np.ndarray, float], ...]:
    """Numbers of the free-bending, the blocked, the loaded and the walking snapshots, and their
    shares."""
    bend, load, blocked = (snapshots.of(name) for name in ("bend", "load", "blocked"))
    walk = np.setdiff1d(np.arange(len(snapshots)), np.concatenate([bend, load, blocked]))
    walk_share = 1.0 - settings.bend_share - settings.load_share - settings.blocked_share
    return (
        (bend, settings.bend_share),
        (blocked, settings.blocked_share),
        (load, settings.load_share),
        (walk, max(walk_share, 0.0)),
    )


def _split(snapshots: SnapshotSet, settings: ReductionSettings) -> tuple[np.ndarray, np.ndarray]:
    """Training and held-out snapshots; free bending and blocked tips are never held out, nor is
    what has no share.

    Raises:
        ValueError: Nothing is left to learn from.
    """
    *curves, load, walk = _kinds(snapshots, settings)
    others = np.sort(np.concatenate([n if share > 0.0 else n[:0] for n, share in (load, walk)]))
    every = settings.holdout_every
    heldout = others[every - 1 :: every] if every > 0 else others[:0]
    training = np.setdiff1d(others, heldout)
    for numbers, share in curves:
        if share > 0.0:
            training = np.union1d(numbers, training)
    if len(training) == 0:
        raise ValueError(
            "snapshots must hold some that have a share of the weight, got none; look at "
            "bend_share, load_share and blocked_share"
        )
    return training, heldout


def _metric(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    settings: ReductionSettings,
    mount_stiffness: np.ndarray | None,
) -> sparse.csr_array:
    """Mean rotated stiffness over snapshots: a snapshot's error costs about its energy in it."""
    if settings.norm == "mass":
        return sparse.csr_array(sparse.diags(np.repeat(part.node_mass, 3)))
    moved = snapshots.states(_evenly(training, 48))
    total = part.stiffness(part.rest_nodes, settings.rotation)
    for displacement in moved:
        total = total + part.stiffness(part.rest_nodes + displacement, settings.rotation)
    mean = sparse.csr_array(total / (len(moved) + 1))
    if mount_stiffness is None:
        return mean
    rows = (3 * part.mesh.node_set("attachment")[:, None] + np.arange(3)).ravel()
    first, second = np.meshgrid(rows, rows, indexing="ij")
    mount = sparse.coo_array(
        (mount_stiffness.ravel(), (first.ravel(), second.ravel())), shape=mean.shape
    )
    return sparse.csr_array(mean + mount)


def _basis(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    metric: sparse.csr_array,
    mirror_nodes: np.ndarray | None,
    settings: ReductionSettings,
    progress: Progress | None,
) -> Pod:
    """Modes of the training snapshots, each kind of them with its share of the weight."""
    parts, curves, done = [], [], 0
    for place, (kind, share) in enumerate(_kinds(snapshots, settings)):
        numbers = np.intersect1d(kind, training)
        if len(numbers) == 0:
            continue
        is_curve = place < 2 and settings.curve_tolerance > 0.0
        finest = settings.curve_tolerance if is_curve else settings.mode_tolerance
        gathered = IncrementalPod(metric, _STREAMING_SHARE * finest, mirror_nodes)
        fields_of = snapshots.blocks if settings.equal_snapshots else snapshots.factors
        for fields in fields_of(numbers):
            gathered.add(_of_unit_energy(fields, metric) if settings.equal_snapshots else fields)
            done += len(fields)
            if progress:
                progress(min(done, len(training)), len(training), "modes")
        if gathered.square > 0.0:
            parts.append(((share / gathered.square) ** 0.5, gathered))
            curves += [gathered] if is_curve else []
    if not parts:
        raise ValueError("snapshots must move, but all that train the modes are zero")
    return joint_pod(
        parts,
        part.node_mass,
        metric,
        tolerance=settings.mode_tolerance,
        mode_limit=settings.mode_limit,
        first=leading_fields(curves, metric, settings.curve_tolerance) if curves else None,
    )


def _pressures(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    metric: sparse.csr_array,
    settings: ReductionSettings,
) -> np.ndarray | None:
    """Fields of pressure of the training snapshots; None of a part whose points have their own."""
    group = part.volume_group
    if group is None:
        return None
    rows = []
    for kind, share in _kinds(snapshots, settings):
        numbers = np.intersect1d(kind, training)
        for block in snapshots.blocks(numbers):
            swelling = [group.volumes(part.rest_nodes + u) / group.rest_volume - 1.0 for u in block]
            scale = np.full(len(block), (share / len(numbers)) ** 0.5)
            if settings.equal_snapshots:
                square, moved = _moved(block, metric)
                scale = np.where(moved, scale / np.sqrt(np.where(moved, square, 1.0)), 0.0)
            rows.append(np.array(swelling) * scale[:, None])
    mirror = None
    if settings.symmetric and part.mesh.mirror_nodes is not None:
        mirror = mirror_elements(group, part.mesh.mirror_nodes)
    return pressure_fields(
        group, np.concatenate(rows), settings.pressure_tolerance, settings.pressure_limit, mirror
    )


def _moved(displacement: np.ndarray, metric: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Squares of snapshots (snapshot, node, 3) in the metric, and which are not at rest."""
    flat = displacement.reshape(len(displacement), -1).astype(np.float64)
    square = np.einsum("sj,sj->s", flat, (metric @ flat.T).T)
    return square, square > 1e-12 * square.max(initial=0.0)


def _of_unit_energy(displacement: np.ndarray, metric: sparse.csr_array) -> np.ndarray:
    """Snapshots (snapshot, node, 3) scaled to the same norm in the metric; none where at rest."""
    square, moved = _moved(displacement, metric)
    return displacement[moved] / np.sqrt(square[moved])[:, None, None]


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


def _evenly(numbers: np.ndarray, limit: int) -> np.ndarray:
    if len(numbers) <= limit:
        return numbers
    return numbers[np.linspace(0, len(numbers) - 1, limit).astype(int)]


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
