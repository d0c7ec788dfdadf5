"""The whole way from a full-order part to a reduced one, on a small part."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sparse
from helpers.synthetic_part import rubber_part, synthetic_part

from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.blocked_snapshots import BlockedSnapshotSettings, blocked_snapshots
from pneumorph.reduction.contact_flexibility import contact_flexibility
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.errors import force_errors, reduced_bend
from pneumorph.reduction.learned_fields import snapshot_kinds, weighted_changes
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_range import range_ratio
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.reduction.tip_compliance import tip_compliance

CELLS = (6, 4, 4)
STATIC = StaticSnapshotSettings(
    bend_pressure_kPa=160.0,
    bend_count=4,
    load_count=6,
    load_pressure_kPa=100.0,
    load_limit_mN=200.0,
)


@pytest.fixture(scope="module")
def model() -> PartModel:
    return synthetic_part(CELLS)


@pytest.fixture(scope="module")
def snapshots(model: PartModel) -> Snapshots:
    bend = bend_snapshots(model, STATIC)
    return Snapshots.joined([bend, load_snapshots(model, STATIC, range(6), bend)])


@pytest.fixture(scope="module")
def loads_alone(snapshots: Snapshots) -> Snapshots:
    """The snapshots without free bending."""
    loads = snapshots.of("load")
    return Snapshots(
        snapshots.displacement[loads],
        snapshots.pressure_kPa[loads],
        snapshots.source[loads],
        snapshots.metadata,
    )


@pytest.fixture(scope="module")
def reduction(model: PartModel, snapshots: Snapshots):
    settings = ReductionSettings(
        mode_tolerance=1e-5, mode_limit=12, ecsw=EcswSettings(hyperreduction_tolerance=0.002)
    )
    return reduce_part(model, snapshots, settings)


def test_a_basis_that_holds_the_equilibria_bends_as_the_full_model(model, snapshots):
    # Where the full force vanishes so does its projection: the Galerkin model has the same
    # equilibria. Single-precision snapshots (1e-7 of 10 mm) leave about 1e-4 %.
    settings = ReductionSettings(
        mode_tolerance=1e-6, mode_limit=60, holdout_every=0, symmetric=False
    )
    _, report = reduce_part(model, snapshots, settings)
    assert report.mode_count <= len(snapshots)
    assert report.bend_error_unsampled_percent < 0.01


def test_few_modes_and_elements_bend_nearly_as_the_full_model(model, reduction):
    part, report = reduction
    assert part.mode_count == report.mode_count <= 12
    assert report.sampling_converged
    every = sum(len(group.connectivity) for group in model.element_groups)
    assert report.tetrahedron_count + report.membrane_count < 0.4 * every
    # The requirement on the leg; the sampling tolerance of 0.2 % is amplified by the softness of
    # bending against the other deformations.
    assert report.bend_error_percent < 3.0
    assert report.bend["full_deg"][-1] > 5.0


def test_report_is_what_one_measures(model, snapshots, reduction):
    part, report = reduction
    bend = snapshots.of("bend")
    curve = reduced_bend(
        part, model.mesh, snapshots.displacement[bend], snapshots.pressure_kPa[bend]
    )
    assert curve.worst_percent == pytest.approx(report.bend_error_percent)
    last = model.rest_nodes + snapshots.displacement[bend[-1]]
    assert curve.full_deg[-1] == pytest.approx(end_face_bend_deg(model.mesh, last))
    assert np.all(force_errors(part, part, curve.alpha) == 0.0)
    assert part.metadata["report"]["mode_count"] == report.mode_count
    part.check_mesh(model.mesh)


def test_saved_reduction_is_the_reduction(tmp_path, reduction):
    part, _ = reduction
    loaded = ReducedPart.load(part.save(tmp_path / "leg.npz"))
    for item in dataclasses.fields(ReducedPart):
        if item.name != "metadata":
            assert np.array_equal(getattr(loaded, item.name), getattr(part, item.name))
    assert loaded.metadata["report"] == part.metadata["report"]


def test_same_snapshots_same_reduction(model, snapshots, reduction):
    part, _ = reduction
    settings = ReductionSettings(
        mode_tolerance=1e-5, mode_limit=12, ecsw=EcswSettings(hyperreduction_tolerance=0.002)
    )
    again, _ = reduce_part(model, snapshots, settings)
    assert np.array_equal(again.modes, part.modes)
    assert np.array_equal(again.tetrahedron_weight, part.tetrahedron_weight)
    assert len(again.contact_flexibility) == 0
    settings = dataclasses.replace(settings, contact_flexibility=True)
    flexible, _ = reduce_part(model, snapshots, settings)
    assert np.array_equal(flexible.modes, part.modes)
    assert np.array_equal(flexible.contact_flexibility, contact_flexibility(model, flexible))
    assert np.diag(flexible.contact_flexibility).max() > 0.0


def test_snapshots_of_another_mesh_and_without_bending_are_refused(model, snapshots, loads_alone):
    with pytest.raises(ValueError, match="must be of the part's mesh"):
        reduce_part(synthetic_part((4, 4, 4)), snapshots)
    with pytest.raises(ValueError, match="must hold free-bending equilibria"):
        reduce_part(model, loads_alone)
    # Those of one of several cavities are none of all.
    alone = dataclasses.replace(
        snapshots,
        metadata={
            **snapshots.metadata,
            "sources": [
                "bend of cavity_left" if each == "bend" else each for each in snapshots.sources
            ],
        },
    )
    with pytest.raises(ValueError, match="must hold free-bending equilibria of all cavities"):
        reduce_part(model, alone)


def test_each_fourth_load_is_on_a_leg_without_pressure(loads_alone):
    empty = loads_alone.pressure_kPa.ravel() == 0.0
    assert empty.tolist() == [True, False, False, False, True, False]


def test_kinds_without_a_share_teach_nothing(model, snapshots, loads_alone):
    alone = ReductionSettings(mode_limit=6, bend_share=0.0, load_share=1.0, holdout_every=0)
    part, report = reduce_part(model, snapshots, alone)
    # Bending that weighs nothing is measured but changes neither modes nor elements.
    bend = snapshots.of("bend")[:1]
    few = Snapshots(
        np.concatenate([0.5 * snapshots.displacement[bend], loads_alone.displacement]),
        np.concatenate([snapshots.pressure_kPa[bend], loads_alone.pressure_kPa]),
        np.concatenate([snapshots.source[bend], loads_alone.source]),
        snapshots.metadata,
    )
    other, _ = reduce_part(model, few, alone)
    assert np.array_equal(part.modes, other.modes)
    assert np.array_equal(part.tetrahedron_weight, other.tetrahedron_weight)
    assert report.bend_error_percent is not None
    nothing = ReductionSettings(bend_share=0.0, load_share=0.0)
    with pytest.raises(ValueError, match="must hold some that have a share of the weight"):
        reduce_part(model, snapshots, nothing)


def test_blocked_tips_teach_their_force_where_they_have_a_share(model, snapshots):
    """A basis of a few modes that never saw them pushes too hard; one that holds them does not."""
    tips = blocked_snapshots(model, BlockedSnapshotSettings(count=3, pressure_kPa=90.0))
    seen = Snapshots.joined([snapshots, tips])
    few = ReductionSettings(
        mode_limit=8, bend_share=0.5, load_share=0.5, ecsw=EcswSettings(element_limit=100)
    )
    _, blind = reduce_part(model, seen, few)
    part, report = reduce_part(
        model, seen, dataclasses.replace(few, load_share=0.2, blocked_share=0.3)
    )
    assert report.blocked_error_unsampled_percent < 0.1 * blind.blocked_error_unsampled_percent
    assert report.blocked_error_percent < 0.5 * blind.blocked_error_percent
    pressures = report.blocked["pressure_kPa"]
    again = [each.force_mN for each in blocked_forces(part, model.mesh, pressures)]
    np.testing.assert_allclose(again, report.blocked["reduced_mN"], rtol=1e-9)
    full = [each.force_mN for each in blocked_forces(model, model.mesh, pressures)]
    np.testing.assert_allclose(full, report.blocked["full_mN"], rtol=1e-9)
    worst = np.abs(np.divide(again, full) - 1.0).max()
    assert report.blocked_error_percent == pytest.approx(100.0 * worst)


def test_a_stiff_sheet_seen_by_its_stress_lets_the_tip_give_way():
    """Modes of free bends alone answer no force sideways, those of the answers do; a sheet that is
    sampled resists what so few modes hold only roughly, one seen by its stress a third of that."""
    model = rubber_part()
    bend = bend_snapshots(model, dataclasses.replace(STATIC, bend_pressure_kPa=4.0))
    blind = ReductionSettings(
        mode_limit=10,
        mode_tolerance=1e-6,
        norm="shape",
        bend_share=1.0,
        load_share=0.0,
        holdout_every=0,
        rotation="polar",
        ecsw=EcswSettings(element_limit=300),
    )
    sampled = dataclasses.replace(blind, bend_share=0.7, answer_share=0.3)
    seen = dataclasses.replace(sampled, stress_limit=8)
    errors, table = [], {}
    for settings in (blind, sampled, seen):
        part, report = reduce_part(model, bend, settings)
        assert report.stress_count == len(part.stretch_1) == settings.stress_limit
        assert (report.membrane_count == 0) == (settings.stress_limit > 0)
        assert ("answers to forces" in report.stage_seconds) == (settings.answer_share > 0.0)
        errors.append(report.compliance_error_percent)
        table = report.compliance
    assert errors[0] > 90.0
    assert 5.0 < errors[1] < 20.0
    assert errors[2] < 0.6 * errors[1]
    x = model.rest_nodes + bend.displacement[-1].astype(float)
    full = tip_compliance(model, x, table["pressure_kPa"][-1], "polar")
    assert table["full_y_mm_per_N"][-1] == pytest.approx(1e3 * full[1, 1])


def test_mirror_images_are_in_range_where_a_part_has_a_mirror(reduction, model):
    """The range of a symmetric part does not tell left from right."""
    part, report = reduction
    image = part.modes[model.mesh.mirror_nodes] * np.array([1.0, -1.0, 1.0])[:, None]
    parity = np.sign(np.sum(image * part.modes, axis=(0, 1)))
    assert np.sum(parity > 0.0) == report.symmetric_mode_count
    states = np.random.default_rng(3).normal(size=(20, part.mode_count))
    ratio = range_ratio(part.snapshot_range, states)
    np.testing.assert_allclose(range_ratio(part.snapshot_range, states * parity), ratio, rtol=1e-9)


@pytest.mark.parametrize("equal", [False, True])
def test_changes_of_a_kind_weigh_what_is_its_share(model, snapshots, equal):
    """Their squares in the metric, weighted, add up to it; equal snapshots have as much each."""
    settings = ReductionSettings(
        bend_share=0.2, load_share=0.5, holdout_every=0, equal_snapshots=equal
    )
    metric = sparse.diags_array(np.repeat(model.node_mass, 3)).tocsr()
    training = np.arange(len(snapshots))
    every = list(weighted_changes(model, snapshots, training, None, metric, settings))
    squares = np.array(
        [weight**2 * (v := (x - rest).ravel()) @ metric @ v for rest, x, weight in every]
    )
    ends = np.cumsum([len(kind) for kind, share in snapshot_kinds(snapshots, settings) if share])
    found = [part.sum() for part in np.split(squares, ends[:-1])]
    shares = [share for kind, share in snapshot_kinds(snapshots, settings) if share and len(kind)]
    assert [each for each in found if each] == pytest.approx(shares, rel=1e-6)
    if equal:
        bends = squares[: ends[0]]
        assert bends[bends > 0.0] == pytest.approx(bends.max(), rel=1e-6)


def test_without_blocked_tips_no_error_of_them_is_told(reduction):
    assert reduction[1].blocked_error_percent is None


def test_without_held_out_snapshots_no_error_of_them_is_told(model, snapshots, reduction):
    settings = ReductionSettings(mode_limit=6, holdout_every=0)
    _, report = reduce_part(model, snapshots, settings)
    assert report.heldout_node_error_mm is None
    assert report.heldout_worst_node_error_mm is None
    assert report.heldout_force_error_percent is None
    assert report.training_node_error_mm > 0.0
    assert reduction[1].heldout_node_error_mm is not None


def test_walks_have_what_is_left_of_the_weight(snapshots):
    settings = ReductionSettings(bend_share=0.2, load_share=0.3, blocked_share=0.1)
    kinds = snapshot_kinds(snapshots, settings)
    assert [share for _, share in kinds] == pytest.approx([0.2, 0.1, 0.3, 0.4])
    numbers = np.concatenate([each for each, _ in kinds])
    assert sorted(numbers) == list(range(len(snapshots)))


def test_shares_beyond_the_whole_are_refused():
    with pytest.raises(ValueError, match=r"must add up to at most 1, got 1\.2"):
        ReductionSettings(bend_share=0.6, load_share=0.4, blocked_share=0.2)


def test_bends_of_little_weight_are_held_where_curves_come_first(model, snapshots):
    little = ReductionSettings(
        mode_limit=8, bend_share=0.01, load_share=0.99, ecsw=EcswSettings(element_limit=60)
    )
    _, without = reduce_part(model, snapshots, little)
    _, first = reduce_part(model, snapshots, dataclasses.replace(little, curve_tolerance=1e-4))
    assert first.mode_count == without.mode_count == 8
    assert first.bend_error_unsampled_percent < 0.1 * without.bend_error_unsampled_percent
