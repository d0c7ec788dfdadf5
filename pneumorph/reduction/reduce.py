"""Full-order part and snapshots in, reduced part and its error report out."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.sparse as sparse

from pneumorph.base.progress import ProgressReport
from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import assemble_reduced_part, sampled_groups
from pneumorph.reduction.blocked_force import even_load
from pneumorph.reduction.chamber_growth import fitted_growth
from pneumorph.reduction.contact_flexibility import with_contact_flexibility
from pneumorph.reduction.ecsw import EcswResult, ecsw
from pneumorph.reduction.errors import (
    ReducedBend,
    ReducedBlockedForce,
    force_errors,
    nearest_of_all,
    nearest_states,
)
from pneumorph.reduction.learned_fields import (
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
from pneumorph.reduction.pod import Pod
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_report import ReductionReport, StageTimes
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_curves import SnapshotCurves
from pneumorph.reduction.snapshot_range import snapshot_range
from pneumorph.reduction.snapshots import BEND, SnapshotSet

USUAL_REPORT_KPA = 350.0
"""Up to this simulated pressure the bend's error is measured where nothing else is asked for."""


def reduce_part(
    part: PartModel,
    snapshots: SnapshotSet,
    settings: ReductionSettings | None = None,
    progress: ProgressReport | None = None,
    *,
    report_pressure_kPa: float = USUAL_REPORT_KPA,
    mount_stiffness: np.ndarray | None = None,
) -> tuple[ReducedPart, ReductionReport]:
    """Reduce a part: one that is held at its attachment, or one that moves freely.

    The modes live in the frame that the snapshots were brought into: that of the hub the part is
    mounted on, or for a free part, such as a disk, that of its own rigid motion (Buckens' frame).

    Args:
        part: The full-order part.
        snapshots: States of it, read in blocks, so that files of any length fit; of a part with a
            cavity among them free-bending equilibria (source ``bend``) in order of pressure.
        settings: Tolerances and limits.
        progress: Called with done, total and a message.
        report_pressure_kPa: The bend error is measured up to this simulated pressure [kPa].
        mount_stiffness: Of a soft hub against the attachment nodes [mN/mm], (3 attachment, 3
            attachment), see `mount_stiffness.py`; None holds them.

    Raises:
        ValueError: The part has several membranes, or the snapshots belong to another mesh or hold
            no free bending, or the settings ask for what the part has not.
        MeshError: The part has no outer end face whose answers modes could learn.
    """
    settings = settings or ReductionSettings()
    _check(part, snapshots, settings, mount_stiffness)
    asked = _Asked(
        part,
        snapshots,
        settings,
        mount_stiffness,
        SnapshotCurves(part, snapshots, settings.rotation, report_pressure_kPa),
        *split_snapshots(snapshots, settings),
        StageTimes(progress),
        progress,
    )
    projected = _projected(asked)
    sampled, report = _measured(asked, projected, _chosen(asked, projected))
    sampled.metadata.update(
        settings=settings_to_dict(settings),
        report=report.to_dict(),
        snapshots={"sources": snapshots.sources, "details": snapshots.metadata.get("details")},
    )
    return sampled, report


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is reduced and from what; training and heldout are numbers of snapshots."""

    part: PartModel
    snapshots: SnapshotSet
    settings: ReductionSettings
    mount_stiffness: np.ndarray | None
    curves: SnapshotCurves
    training: np.ndarray
    heldout: np.ndarray
    clock: StageTimes
    progress: ProgressReport | None

    @property
    def mirror_nodes(self) -> np.ndarray | None:
        return self.part.mesh.mirror_nodes if self.settings.symmetric else None


@dataclass(frozen=True, eq=False)
class _Projected:
    """The part in its modes with all of its elements, and how to assemble it with fewer."""

    metric: sparse.csr_array
    basis: Pod
    stresses: np.ndarray | None
    assembled: Callable[..., ReducedPart]
    every: ReducedPart
    bends: Mapping[str, ReducedBend]
    blocked: ReducedBlockedForce | None


def _projected(asked: _Asked) -> _Projected:
    part, snapshots, training = asked.part, asked.snapshots, asked.training
    settings, clock = asked.settings, asked.clock
    clock.start("metric")
    metric = pod_metric(part, snapshots, training, settings, asked.mount_stiffness)
    answers = None
    if settings.answer_share > 0.0:
        clock.start("answers to forces")
        answers = asked.curves.answers()
    clock.start("modes")
    basis = learned_modes(
        part, snapshots, training, answers, metric, asked.mirror_nodes, settings, asked.progress
    )

    def changes() -> Iterator[WeightedChange]:
        return weighted_changes(part, snapshots, training, answers, metric, settings)

    stresses = learned_stresses(part, changes(), settings)
    assembled = partial(
        assemble_reduced_part,
        part,
        basis.modes,
        mount_stiffness=asked.mount_stiffness,
        pressure_fields=learned_pressures(part, changes(), settings),
        stress_fields=stresses,
    )
    every = assembled()
    clock.start("bend of the modes")
    bends = asked.curves.bends(every)
    clock.start("blocked force of the modes")
    blocked = asked.curves.blocked(every)
    return _Projected(metric, basis, stresses, assembled, every, bends, blocked)


def _chosen(asked: _Asked, projected: _Projected) -> EcswResult:
    """The elements that stand for all."""
    asked.clock.start("sampled elements")
    settings, every = asked.settings, projected.every
    trained = asked.snapshots.states(evenly(asked.training, settings.training_state_limit))
    alpha = nearest_states(trained, every.modes, projected.metric)
    own = _own_equilibria(projected, settings)
    return ecsw(
        sampled_groups(asked.part, projected.stresses),
        every.modes,
        np.concatenate([alpha, own]),
        settings.ecsw,
        rotation=settings.rotation,
        weights=np.repeat([1.0, settings.ecsw.equilibrium_weight], [len(alpha), len(own)]),
        mirror_nodes=asked.mirror_nodes,
        linear_stiffness=every.linear_stiffness,
        mixed=(every.dilatation, every.sheet),
        relaxing=asked.part.branches is not None,
        progress=asked.progress,
    )


def _own_equilibria(projected: _Projected, settings: ReductionSettings) -> np.ndarray:
    """Modal coordinates of the free bends and blocked tips that the modes have themselves, where
    snapshots of the kind have a share of the weight, (state, mode)."""
    own = [np.zeros((0, projected.every.mode_count))]
    if settings.bend_share > 0.0:
        own += [each.alpha[~np.isnan(each.reduced_deg)] for each in projected.bends.values()]
    if projected.blocked and settings.blocked_share > 0.0:
        own.append(projected.blocked.alpha)
    return np.concatenate(own)


def _measured(
    asked: _Asked, projected: _Projected, chosen: EcswResult
) -> tuple[ReducedPart, ReductionReport]:
    """The reduced part and its errors."""
    asked.clock.start("errors")
    curves, every, basis = asked.curves, projected.every, projected.basis
    sampled = projected.assembled(cubatures=chosen.cubatures, contact_modes=every.contact_modes)
    bends, blocked = curves.bends(sampled), curves.blocked(sampled)
    # A soft mount gives way besides.
    compliance = curves.compliance(sampled, bends) if asked.mount_stiffness is None else None
    node_error, reached = nearest_of_all(asked.snapshots, every.modes, projected.metric)
    parity = None if asked.mirror_nodes is None else basis.parity
    sampled = replace(sampled, snapshot_range=snapshot_range(reached, parity))
    if asked.settings.contact_flexibility:
        sampled = with_contact_flexibility(asked.part, sampled)
    unseen = node_error[asked.heldout]
    force_error = np.zeros(0)
    if len(unseen):
        tried = asked.snapshots.states(evenly(asked.heldout, 100))
        alpha = nearest_states(tried, every.modes, projected.metric)
        force_error = force_errors(sampled, every, alpha, asked.settings.rotation)
    asked.clock.stop()
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
        training_node_error_mm=float(node_error[asked.training].mean()),
        heldout_node_error_mm=float(unseen.mean()) if len(unseen) else None,
        heldout_worst_node_error_mm=float(unseen.max()) if len(unseen) else None,
        heldout_force_error_percent=(
            float(100.0 * np.sqrt(np.mean(force_error**2))) if len(unseen) else None
        ),
        bend_error_percent=_worst(bends),
        bend_error_unsampled_percent=_worst(projected.bends),
        bend=bends[BEND].table() if BEND in bends else {},
        bend_of_cavities={
            name.removeprefix(f"{BEND} of "): curve.table()
            for name, curve in bends.items()
            if name != BEND
        },
        chamber_growth=_growth(sampled, bends[BEND]) if BEND in bends else None,
        blocked_error_percent=blocked.worst_percent if blocked else None,
        blocked_error_unsampled_percent=(
            projected.blocked.worst_percent if projected.blocked else None
        ),
        blocked=blocked.table() if blocked else {},
        compliance_error_percent=compliance.worst_percent if compliance else None,
        compliance=compliance.table() if compliance else {},
        snapshot_count=len(asked.snapshots),
        stage_seconds=asked.clock.seconds,
        peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    )
    return sampled, report


def _growth(sampled: ReducedPart, bend: ReducedBend) -> list[float]:
    """How its chambers grow along the free bends that it has itself."""
    known = ~np.isnan(bend.reduced_deg) & (bend.pressure_kPa > 0.0)
    cavities = [sampled.cavity(index) for index in range(sampled.cavity_count)]
    volumes = np.array([sum(each.volume(alpha) for each in cavities) for alpha in bend.alpha])
    ratio = volumes[known] / float(sampled.cavity_volume.sum())
    return list(fitted_growth(bend.pressure_kPa[known], ratio))


def _check(
    part: PartModel,
    snapshots: SnapshotSet,
    settings: ReductionSettings,
    mount_stiffness: np.ndarray | None,
) -> None:
    """Refuse, before anything is computed, what the part cannot be reduced with."""
    digest = part.mesh.digest()
    if snapshots.metadata.get("mesh_digest") != digest:
        raise ValueError(
            f"snapshots must be of the part's mesh {digest[:12]}, got the mesh "
            f"{str(snapshots.metadata.get('mesh_digest'))[:12]}; collect them again"
        )
    bends = [place for place, source in enumerate(snapshots.sources) if source == BEND]
    if part.cavities and not np.isin(snapshots.source, bends).any():
        raise ValueError(
            "snapshots must hold free-bending equilibria of all cavities (source 'bend'); without "
            "them a basis can be 30 % too stiff in free air; where none was found, the leg "
            "balloons or buckles before the first pressure: ask for a lower largest pressure, or "
            "make its walls thicker"
        )
    check_settings(part, settings, on_soft_mount=mount_stiffness is not None)


def check_settings(
    part: PartModel, settings: ReductionSettings, *, on_soft_mount: bool = False
) -> None:
    """Refuse settings that a part cannot be reduced with, before there are snapshots of it.

    Args:
        part: The full-order part.
        settings: What is asked for.
        on_soft_mount: Whether what it is mounted on gives way.

    Raises:
        ValueError: The settings ask for what the part has not, or its cavities are not named so by
            its mesh.
        MeshError: The part has no outer end to tell its bend by, or no face there whose answers
            modes could learn.
    """
    part.check_cavities(some=not settings.contact_flexibility)
    if part.cavities:
        part.mesh.node_set("outer_end_face")
    if settings.stress_limit > 0 and part.membranes:
        scaled_strain(part.element_groups[1], part.rest_nodes)
    if settings.contact_flexibility and (on_soft_mount or not part.cavities):
        kind = "on a soft mount" if on_soft_mount else "without a cavity"
        raise ValueError(
            f"contact_flexibility is true, expected false of a part {kind}: how its points give "
            "way is found with the attachment held"
        )
    if settings.answer_share > 0.0:
        if on_soft_mount or not part.cavities:
            kind = "on a soft mount" if on_soft_mount else "without a cavity"
            raise ValueError(
                f"answer_share is {settings.answer_share}, expected 0 of a part {kind}: how its "
                "tip answers forces is found with the attachment held, at free bends"
            )
        even_load(part.mesh, "outer_end_face")


def _worst(curves: Mapping[str, ReducedBend]) -> float | None:
    return max((curve.worst_percent for curve in curves.values()), default=None)
