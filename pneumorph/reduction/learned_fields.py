"""What a reduction learns from its snapshots: modes, and fields of pressure and of stress.

Snapshots are of four kinds, free bends, blocked tips, loads and walks, and each kind has its share
of the weight; so have the tip's answers to small forces.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import scipy.sparse as sparse

from pneumorph.base.progress import ProgressReport
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.incremental_pod import MIRROR, IncrementalPod
from pneumorph.reduction.mirror_pairs import mirror_elements, shared_columns
from pneumorph.reduction.mixed_dilatation import pressure_fields
from pneumorph.reduction.mixed_sheet import scaled_strain, stress_fields
from pneumorph.reduction.pod import Pod, joint_pod, leading_fields
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshots import SnapshotSet
from pneumorph.reduction.tip_answers import TipAnswers

WeightedChange = tuple[np.ndarray, np.ndarray, float]
"""Positions (node, 3) before and after a change, and what it is multiplied by to count as it
should."""

STREAMING_SHARE = 0.1
"""Share of the mode tolerance that decomposing block by block may cost."""


def snapshot_kinds(
    snapshots: SnapshotSet, settings: ReductionSettings
) -> tuple[tuple[np.ndarray, float], ...]:
    """Numbers of the free-bending, the blocked, the loaded and the walking snapshots, and their
    shares."""
    bend, load, blocked = (snapshots.of(name) for name in ("bend", "load", "blocked"))
    walk = np.setdiff1d(np.arange(len(snapshots)), np.concatenate([bend, load, blocked]))
    given = settings.bend_share + settings.load_share + settings.blocked_share
    walk_share = 1.0 - given - settings.answer_share
    walk_share = walk_share if walk_share > 1e-9 else 0.0  # rounding
    return (
        (bend, settings.bend_share),
        (blocked, settings.blocked_share),
        (load, settings.load_share),
        (walk, walk_share),
    )


def split_snapshots(
    snapshots: SnapshotSet, settings: ReductionSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Training and held-out snapshots; free bending and blocked tips are never held out, nor is
    what has no share.

    Raises:
        ValueError: Nothing is left to learn from.
    """
    *curves, load, walk = snapshot_kinds(snapshots, settings)
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
            "bend_share, load_share, blocked_share and answer_share"
        )
    return training, heldout


def pod_metric(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    settings: ReductionSettings,
    mount_stiffness: np.ndarray | None,
) -> sparse.csr_array:
    """Inner product of the POD, by `ReductionSettings.norm`: in that of the mean rotated stiffness
    over snapshots an error costs about its energy."""
    if settings.norm == "mass":
        return sparse.csr_array(sparse.diags(np.repeat(part.node_mass, 3)))
    moved = snapshots.states(evenly(training, 48))
    stiffness = part.stiffness if settings.norm == "energy" else part.shape_stiffness
    total = stiffness(part.rest_nodes, settings.rotation)
    for displacement in moved:
        total = total + stiffness(part.rest_nodes + displacement, settings.rotation)
    mean = sparse.csr_array(total / (len(moved) + 1))
    if mount_stiffness is None:
        return mean
    rows = (3 * part.mesh.node_set("attachment")[:, None] + np.arange(3)).ravel()
    first, second = np.meshgrid(rows, rows, indexing="ij")
    mount = sparse.coo_array(
        (mount_stiffness.ravel(), (first.ravel(), second.ravel())), shape=mean.shape
    )
    return sparse.csr_array(mean + mount)


def learned_modes(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    answers: TipAnswers | None,
    metric: sparse.csr_array,
    mirror_nodes: np.ndarray | None,
    settings: ReductionSettings,
    progress: ProgressReport | None,
) -> Pod:
    """Modes of the training snapshots and the tip's answers, each kind with its share of the
    weight."""
    parts, curves, done = [], [], 0
    for place, (kind, share) in enumerate(snapshot_kinds(snapshots, settings)):
        numbers = np.intersect1d(kind, training)
        if len(numbers) == 0:
            continue
        is_curve = place < 2 and settings.curve_tolerance > 0.0
        finest = settings.curve_tolerance if is_curve else settings.mode_tolerance
        gathered = IncrementalPod(metric, STREAMING_SHARE * finest, mirror_nodes)
        fields_of = snapshots.blocks if settings.equal_snapshots else snapshots.factors
        for fields in fields_of(numbers):
            gathered.add(_of_unit_energy(fields, metric) if settings.equal_snapshots else fields)
            done += len(fields)
            if progress:
                progress(min(done, len(training)), len(training), "modes")
        if gathered.square > 0.0:
            parts.append(((share / gathered.square) ** 0.5, gathered))
            curves += [gathered] if is_curve else []
    if answers is not None:
        gathered = IncrementalPod(metric, STREAMING_SHARE * settings.mode_tolerance, mirror_nodes)
        gathered.add(_of_unit_energy(answers.moved, metric))
        parts.append(((settings.answer_share / gathered.square) ** 0.5, gathered))
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


def learned_pressures(
    part: PartModel, changes: Iterable[WeightedChange], settings: ReductionSettings
) -> np.ndarray | None:
    """Fields of pressure of the changes; None of a part whose points have their own."""
    group = part.volume_group
    if group is None:
        return None

    def swelling(x: np.ndarray) -> np.ndarray:
        result: np.ndarray = group.volumes(x) / group.rest_volume - 1.0
        return result

    rows = (weight * (swelling(after) - swelling(before)) for before, after, weight in changes)
    mirror = None
    if settings.symmetric and part.mesh.mirror_nodes is not None:
        mirror = mirror_elements(group, part.mesh.mirror_nodes)
    return pressure_fields(
        group, rows, settings.pressure_tolerance, settings.pressure_limit, mirror
    )


def learned_stresses(
    part: PartModel, changes: Iterable[WeightedChange], settings: ReductionSettings
) -> np.ndarray | None:
    """Fields of stress of the membrane in the changes; None where it is sampled."""
    if settings.stress_limit == 0 or not part.membranes:
        return None
    sheet, mirror = part.element_groups[1], part.mesh.mirror_nodes if settings.symmetric else None
    if mirror is not None:
        shared_columns(sheet, mirror)  # refuses a sheet that is not its own image

    def strain(before: np.ndarray, after: np.ndarray, weight: float) -> np.ndarray:
        return weight * (scaled_strain(sheet, after) - scaled_strain(sheet, before))

    def image(before: np.ndarray, after: np.ndarray, weight: float) -> np.ndarray | None:
        if mirror is None:
            return None
        return strain(before[mirror] * MIRROR, after[mirror] * MIRROR, weight)

    return stress_fields(((strain(*each), image(*each)) for each in changes), settings.stress_limit)


def weighted_changes(
    part: PartModel,
    snapshots: SnapshotSet,
    training: np.ndarray,
    answers: TipAnswers | None,
    metric: sparse.csr_array,
    settings: ReductionSettings,
) -> Iterator[WeightedChange]:
    """The changes that fields are learned from: from rest to each training snapshot, and the tip's
    answers, half of each before and half after its state."""
    for kind, share in snapshot_kinds(snapshots, settings):
        numbers = np.intersect1d(kind, training)
        if len(numbers) == 0 or share == 0.0:
            continue
        whole = float(len(numbers))
        if not settings.equal_snapshots:
            whole = sum(
                float(_moved(block, metric)[0].sum()) for block in snapshots.blocks(numbers)
            )
        for block in snapshots.blocks(numbers):
            scale = np.full(len(block), (share / whole) ** 0.5)
            if settings.equal_snapshots:
                square, moved = _moved(block, metric)
                scale = np.where(moved, scale / np.sqrt(np.where(moved, square, 1.0)), 0.0)
            for displacement, weight in zip(block.astype(np.float64), scale.tolist(), strict=True):
                yield part.rest_nodes, part.rest_nodes + displacement, weight
    if answers is None:
        return
    square, _ = _moved(answers.moved, metric)
    scale = (settings.answer_share / len(square) / square) ** 0.5
    for x, moved, weight in zip(answers.positions, answers.moved, scale.tolist(), strict=True):
        yield x - 0.5 * moved, x + 0.5 * moved, weight


def _moved(displacement: np.ndarray, metric: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Squares of snapshots (snapshot, node, 3) in the metric, and which are not at rest."""
    flat = displacement.reshape(len(displacement), -1).astype(np.float64)
    square = np.einsum("sj,sj->s", flat, (metric @ flat.T).T)
    return square, square > 1e-12 * square.max(initial=0.0)


def _of_unit_energy(displacement: np.ndarray, metric: sparse.csr_array) -> np.ndarray:
    """Snapshots (snapshot, node, 3) scaled to the same norm in the metric; none where at rest."""
    square, moved = _moved(displacement, metric)
    return displacement[moved] / np.sqrt(square[moved])[:, None, None]


def evenly(numbers: np.ndarray, limit: int) -> np.ndarray:
    """At most so many of the numbers, evenly spread, the first and the last among them."""
    if len(numbers) <= limit:
        return numbers
    return numbers[np.linspace(0, len(numbers) - 1, limit).astype(int)]
