"""Whether a reduced part knows how far its snapshots went."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part

from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_range import (
    LEAST_AXIS,
    RANGE_TOLERANCE,
    known_ratio,
    range_note,
    range_ratio,
    snapshot_range,
)
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import (
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)
from pneumorph.robot.scaled_part import scaled_part

STATIC = StaticSnapshotSettings(
    bend_pressure_kPa=80.0,
    bend_count=4,
    load_count=6,
    load_pressure_kPa=60.0,
    load_limit_mN=200.0,
)
RNG = np.random.default_rng(0)
SEEN = RNG.normal(size=(40, 5)) @ RNG.normal(size=(5, 5))


@pytest.fixture(scope="module")
def model() -> PartModel:
    return synthetic_part((4, 4, 4))


@pytest.fixture(scope="module")
def snapshots(model: PartModel) -> Snapshots:
    bend = bend_snapshots(model, STATIC)
    return Snapshots.joined([bend, load_snapshots(model, STATIC, range(6), bend)])


@pytest.fixture(scope="module")
def reduced(model: PartModel, snapshots: Snapshots) -> ReducedPart:
    settings = ReductionSettings(
        mode_tolerance=1e-3, mode_limit=6, ecsw=EcswSettings(hyperreduction_tolerance=0.005)
    )
    part, _ = reduce_part(model, snapshots, settings)
    return part


def test_the_ratio_is_that_of_the_leverages() -> None:
    hat = SEEN @ np.linalg.inv(SEEN.T @ SEEN) @ SEEN.T
    rows = snapshot_range(SEEN)
    expected = np.sqrt(np.diag(hat) / np.diag(hat).max())
    # Two ways to the same: rounding times the condition of A^T A, about 1e3.
    np.testing.assert_allclose(range_ratio(rows, SEEN), expected, rtol=1e-10)
    assert range_ratio(rows, SEEN).max() == pytest.approx(1.0, rel=1e-14)
    assert range_ratio(rows, 3.0 * SEEN).max() == pytest.approx(3.0, rel=1e-14)


def test_the_ratio_does_not_depend_on_the_basis() -> None:
    mixed = RNG.normal(size=(5, 5))
    state = RNG.normal(size=5)
    other = range_ratio(snapshot_range(SEEN @ mixed), state @ mixed)
    assert other == pytest.approx(range_ratio(snapshot_range(SEEN), state), rel=1e-9)


def test_mirror_images_of_snapshots_are_in_range_as_they_are() -> None:
    parity = np.array([1.0, 1.0, -1.0, 1.0, -1.0])
    rows = snapshot_range(SEEN, parity)
    ratios = range_ratio(rows, SEEN)
    np.testing.assert_allclose(range_ratio(rows, SEEN * parity), ratios, rtol=1e-12)
    assert ratios.max() == pytest.approx(1.0, rel=1e-14)
    # Without the images the range is of one side.
    alone = snapshot_range(SEEN)
    assert not np.allclose(range_ratio(alone, SEEN * parity), range_ratio(alone, SEEN), rtol=0.01)


def test_where_no_snapshot_went_is_out_of_range() -> None:
    flat = SEEN * [1.0, 1.0, 1.0, 0.0, 0.0]
    rows = snapshot_range(flat)
    assert range_ratio(rows, flat).max() == pytest.approx(1.0)
    furthest = np.linalg.norm(flat, axis=1).max()
    aside = range_ratio(rows, furthest * np.eye(5)[3])
    assert aside == pytest.approx(1.0 / LEAST_AXIS, rel=1e-10)
    assert np.isfinite(snapshot_range(SEEN[:2])).all()  # fewer snapshots than modes


def test_what_the_snapshots_hardly_have_tells_no_robot_out_of_range() -> None:
    """A thousandth of a millimetre instead of a ten-thousandth is no extrapolation."""
    hardly = SEEN * [1.0, 1.0, 1.0, 1.0, 1e-7]
    rows = snapshot_range(hardly)
    assert range_ratio(rows, hardly).max() == pytest.approx(1.0)
    assert range_ratio(rows, hardly * [1.0, 1.0, 1.0, 1.0, 10.0]).max() < 1.01
    # Axes that are longer stay what they are.
    np.testing.assert_allclose(
        range_ratio(rows, hardly * [1.0, 1.0, 1.0, 1.0, 0.0]),
        range_ratio(snapshot_range(SEEN[:, :4]), SEEN[:, :4])
        / range_ratio(snapshot_range(SEEN[:, :4]), SEEN[:, :4]).max(),
        rtol=1e-3,
    )


def test_a_part_inflated_beyond_its_snapshots_is_out_of_range(reduced: ReducedPart) -> None:
    assert reduced.knows_range
    for pressure_kPa in (10.0, 50.0, STATIC.bend_pressure_kPa):
        inside = reduced.range_ratio(modal_equilibrium(reduced, pressure_kPa).alpha)
        assert range_note("L1", float(inside)) is None
    beyond = reduced.range_ratio(modal_equilibrium(reduced, 1.5 * STATIC.bend_pressure_kPa).alpha)
    assert beyond > RANGE_TOLERANCE
    note = range_note("L1", float(beyond))
    assert note is not None
    assert note.startswith("L1 left the range of its legs' snapshots")
    assert f"{beyond:.2f} times" in note


def test_every_snapshot_is_in_range_whether_it_trained_or_not(
    model: PartModel, snapshots: Snapshots, reduced: ReducedPart
) -> None:
    flat = reduced.modes.reshape(-1, reduced.mode_count)
    metric = model.stiffness(model.rest_nodes, "edge")
    moved = snapshots.displacement.reshape(len(snapshots), -1)
    # Nearest in the stiffness at rest, not in the mean over the snapshots as the range is.
    nearest = np.linalg.solve(flat.T @ (metric @ flat), flat.T @ (metric @ moved.T)).T
    ratios = reduced.range_ratio(nearest)
    assert 0.8 < ratios.max() < RANGE_TOLERANCE


def test_a_scaled_part_has_the_same_range_of_shapes(reduced: ReducedPart) -> None:
    alpha = modal_equilibrium(reduced, 50.0).alpha
    heavy = scaled_part(reduced, modulus_factor=0.8, mass_factor=4.0)
    assert heavy.range_ratio(2.0 * alpha) == pytest.approx(reduced.range_ratio(alpha), rel=1e-12)


def test_an_older_part_does_not_know_its_range(tmp_path, reduced: ReducedPart) -> None:
    known = ReducedPart.load(reduced.save(tmp_path / "known.npz"))
    np.testing.assert_array_equal(known.snapshot_range, reduced.snapshot_range)
    assert known.describe("leg").knows_range is True
    older = replace(reduced, snapshot_range=np.zeros((0, 0)))
    path = older.save(tmp_path / "older.npz")
    with np.load(path) as file:
        assert "snapshot_range" not in file.files
    read = ReducedPart.load(path)
    assert not read.knows_range
    assert read.describe("leg").knows_range is False
    assert np.isnan(read.range_ratio(np.zeros((3, read.mode_count)))).all()
    assert known_ratio(np.nan) is None
    assert range_note("L1", None) is None
    assert older.digest() == reduced.digest()  # it moves the same


def test_a_range_of_other_modes_is_refused() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    with pytest.raises(ValueError, match=r"snapshot_range must have shape \(4, 4\)"):
        replace(part, snapshot_range=np.eye(3))


def test_a_part_of_one_mode_knows_its_range() -> None:
    part = replace(
        synthetic_reduced_part(mode_count=1, cells=(4, 4, 4)), snapshot_range=np.array([[0.5]])
    )
    assert part.knows_range
    assert part.range_ratio(np.array([3.0])) == pytest.approx(1.5)
