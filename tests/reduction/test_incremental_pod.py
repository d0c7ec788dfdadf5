"""POD in blocks: its error is what it says, and blocks do not matter where nothing is dropped."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sparse
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.reduction.compressed_snapshots import SnapshotCompressor
from pneumorph.reduction.incremental_pod import IncrementalPod, gram_vectors
from pneumorph.reduction.pod import joint_pod, leading_fields, pod, truncation_error

PART = synthetic_part((6, 4, 4))
HELD = np.isin(np.arange(PART.node_count), PART.mesh.node_set("attachment"))
FREE = ~np.repeat(HELD, 3)
METRIC = sparse.csr_array(PART.stiffness(PART.rest_nodes).toarray() * np.outer(FREE, FREE))


def wandering_snapshots(count: int = 150, seed: int = 0) -> np.ndarray:
    """States whose directions change slowly, as those of a walk do, with a decaying spectrum."""
    rng = np.random.default_rng(seed)
    modes = vibration_modes(PART, 40)
    phase = np.linspace(0.0, 3.0, count)[:, None] + rng.uniform(0.0, 6.0, 40)
    size = 0.7 ** np.arange(40)
    coordinates = size * (
        np.sin(phase * rng.uniform(0.5, 2.0, 40)) + 0.1 * rng.normal(size=(count, 40))
    )
    return np.moveaxis(modes @ coordinates.T, 2, 0)


def projection_error(snapshots: np.ndarray, rows: np.ndarray) -> float:
    """Relative error of the nearest states in the span of rows, in the metric; by least squares."""
    lower = np.linalg.cholesky(METRIC.toarray()[np.ix_(FREE, FREE)])
    moved = lower.T @ snapshots.reshape(len(snapshots), -1)[:, FREE].T
    basis, _ = np.linalg.qr(lower.T @ rows[:, FREE].T)
    return float(np.linalg.norm(moved - basis @ (basis.T @ moved)) / np.linalg.norm(moved))


def in_blocks(snapshots: np.ndarray, tolerance: float, size: int, mirror=None) -> IncrementalPod:
    gathered = IncrementalPod(METRIC, tolerance, mirror)
    for start in range(0, len(snapshots), size):
        gathered.add(snapshots[start : start + size])
    return gathered


@pytest.mark.parametrize("tolerance", [0.3, 0.03, 0.003])
def test_kept_modes_hold_the_snapshots_to_the_tolerance(tolerance: float) -> None:
    snapshots = wandering_snapshots()
    gathered = in_blocks(snapshots, tolerance, 11)
    flat = snapshots.reshape(len(snapshots), -1)
    assert gathered.square == pytest.approx(np.einsum("sj,js->", flat, METRIC @ flat.T), rel=1e-10)
    true = projection_error(snapshots, gathered.scaled_modes[0])
    bound = (gathered.dropped_square / gathered.square) ** 0.5
    # The nearest states are at least as near as the approximation whose error the bound is.
    assert 0.0 < true <= bound * (1.0 + 1e-8) <= tolerance * (1.0 + 1e-8)
    # The bound is not idle: the budget is used, and few modes are kept.
    assert bound > 0.5 * tolerance
    assert len(gathered.scaled_modes[0]) < 40


def test_what_is_dropped_is_what_the_approximation_lacks() -> None:
    # Sum of squares of the snapshots = that of the kept scaled modes + all that was dropped.
    gathered = in_blocks(wandering_snapshots(), 0.1, 7)
    kept = gathered.scaled_modes[0]
    total = np.einsum("rj,jr->", kept, METRIC @ kept.T) + gathered.dropped_square
    assert total == pytest.approx(gathered.square, rel=1e-10)  # rounding of 22 decompositions


def test_singular_values_are_short_by_no_more_than_was_dropped() -> None:
    snapshots = wandering_snapshots()
    gathered = in_blocks(snapshots, 0.05, 11)
    flat = snapshots.reshape(len(snapshots), -1)
    exact = np.sort(np.linalg.eigvalsh(flat @ (METRIC @ flat.T)))[::-1]
    kept = gathered.scaled_modes[0]
    own = np.sort(np.linalg.eigvalsh(kept @ (METRIC @ kept.T)))[::-1]
    short = exact[: len(own)] - own
    assert np.all(short > -1e-9 * exact[0])
    assert short.sum() <= gathered.dropped_square * (1.0 + 1e-8)
    assert short.sum() > 0.0


def test_blocks_do_not_matter_where_little_is_dropped() -> None:
    snapshots = wandering_snapshots()
    arguments = dict(tolerance=0.01, mode_limit=60)
    whole = pod(snapshots, PART.node_mass, metric=METRIC, **arguments)
    streamed = joint_pod(
        [(1.0, in_blocks(snapshots, 1e-6, 13))], PART.node_mass, METRIC, **arguments
    )
    assert streamed.modes.shape == whole.modes.shape
    assert streamed.projection_error == pytest.approx(whole.projection_error, rel=1e-4)
    overlap = np.einsum("nim,n,nik->mk", whole.modes, PART.node_mass, streamed.modes)
    # Same span: the overlaps are an orthogonal matrix, to a dropped part of 1e-6.
    assert np.abs(overlap @ overlap.T - np.eye(len(overlap))).max() < 1e-5


def test_mode_tolerance_bounds_the_true_error_of_streamed_modes() -> None:
    snapshots = wandering_snapshots()
    for tolerance in (0.1, 0.0032):
        parts = [(1.0, in_blocks(snapshots, 0.1 * tolerance, 16))]
        basis = joint_pod(parts, PART.node_mass, METRIC, tolerance=tolerance, mode_limit=100)
        true = projection_error(snapshots, basis.modes.reshape(-1, basis.modes.shape[2]).T)
        assert true <= basis.projection_error * (1.0 + 1e-6)
        assert basis.projection_error <= tolerance
        fewer = truncation_error(basis.singular_values, basis.dropped_square)
        assert fewer[basis.modes.shape[2] - 1] > tolerance  # no mode too many


def test_leading_fields_come_first_and_the_error_is_still_that_of_all() -> None:
    """A few snapshots of little weight are held to their own tolerance; the others have the rest.
    Errors by least squares; equal to the rounding of Gram eigenvalues."""
    curve, others = wandering_snapshots(6, seed=1), wandering_snapshots(40)
    few, many = in_blocks(curve, 1e-6, 6), in_blocks(others, 1e-6, 40)
    parts = [(1e-3, few), (1.0, many)]
    leading = leading_fields([few], METRIC, 0.01)
    count = len(leading[0])
    assert projection_error(curve, leading[0]) < 0.01
    assert projection_error(curve, leading[0][:-1]) > 0.01
    settings = {"tolerance": 1e-4, "mode_limit": 12}
    plain = joint_pod(parts, PART.node_mass, METRIC, **settings)
    basis = joint_pod(parts, PART.node_mass, METRIC, **settings, first=leading)
    assert count < basis.modes.shape[2] == len(basis.parity) == 12
    assert projection_error(curve, basis.modes.reshape(-1, 12).T) < 0.01
    assert projection_error(curve, plain.modes.reshape(-1, 12).T) > 0.01
    together = np.concatenate([1e-3 * curve, others])
    true = projection_error(together, basis.modes.reshape(-1, 12).T)
    assert basis.projection_error == pytest.approx(true, rel=1e-3)
    assert plain.projection_error < basis.projection_error  # Eckart and Young
    fewest = joint_pod(parts, PART.node_mass, METRIC, tolerance=0.9, mode_limit=12, first=leading)
    assert fewest.modes.shape[2] == count


def test_mirror_halves_stay_apart_in_blocks() -> None:
    mirror = PART.mesh.mirror_nodes
    snapshots = wandering_snapshots(60)
    parts = [(1.0, in_blocks(snapshots, 1e-4, 9, mirror))]
    basis = joint_pod(parts, PART.node_mass, METRIC, tolerance=0.05, mode_limit=100)
    for number, parity in enumerate(basis.parity):
        mode = basis.modes[:, :, number]
        image = mode[mirror] * [1.0, -1.0, 1.0]
        assert np.abs(image - parity * mode).max() < 1e-9 * np.abs(mode).max()
    both = np.concatenate([snapshots, snapshots[:, mirror] * [1.0, -1.0, 1.0]])
    rows = basis.modes.reshape(-1, basis.modes.shape[2]).T
    assert projection_error(both, rows) <= basis.projection_error * (1.0 + 1e-6)


@pytest.mark.parametrize("tolerance", [0.1, 0.001])
def test_compressed_snapshots_are_within_their_error(tolerance: float, tmp_path) -> None:
    snapshots = wandering_snapshots(600)
    compressor = SnapshotCompressor(METRIC, tolerance)
    for start in range(0, 600, 4):  # four legs at a time
        compressor.add(snapshots[start : start + 4])
    compressed = compressor.finish(np.zeros(600), np.zeros(600, dtype=int), {"mesh_digest": "a"})
    loaded = type(compressed).load(compressed.save(tmp_path / "walk.npz"))
    assert len(loaded) == 600
    assert len(loaded.fields) < 40
    numbers = np.arange(600)
    error = (loaded.states(numbers) - snapshots).reshape(600, -1)
    flat = snapshots.reshape(600, -1)
    left = np.einsum("sj,js->", error, METRIC @ error.T)
    relative = (left / np.einsum("sj,js->", flat, METRIC @ flat.T)) ** 0.5
    assert loaded.metadata["relative_error"] <= tolerance
    # Single precision of fields and coefficients, about 1e-7, amplified by the stiffest directions.
    assert relative == pytest.approx(loaded.metadata["relative_error"], rel=1e-2)
    # Few factors have the same sum of products as all states.
    some = numbers[::3]
    factors = np.concatenate(list(loaded.factors(some))).reshape(-1, flat.shape[1])
    states = loaded.states(some).reshape(len(some), -1)
    assert len(factors) <= len(loaded.fields)
    products = states.T @ states
    assert np.abs(factors.T @ factors - products).max() < 1e-5 * np.abs(products).max()


def test_of_a_leg_at_rest_nothing_is_left_out() -> None:
    compressor = SnapshotCompressor(METRIC, 0.1)
    compressor.add(np.zeros((1, *PART.mesh.nodes.shape)))
    found = compressor.finish(np.zeros(1), np.zeros(1, dtype=int), {"mesh_digest": "a"})
    assert found.metadata["relative_error"] == 0.0


def test_impossible_tolerances_and_states_are_refused() -> None:
    with pytest.raises(ValueError, match="tolerance must lie between 0 and 1"):
        IncrementalPod(METRIC, 0.0)
    with pytest.raises(ValueError, match="tolerance must lie between 0 and 1"):
        SnapshotCompressor(METRIC, 1.0)
    with pytest.raises(ValueError, match="must be finite"):
        SnapshotCompressor(METRIC, 0.1).add(np.full((1, *PART.mesh.nodes.shape), np.nan))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_what_is_rounding_is_measured_by_the_largest_value(scale: float) -> None:
    """Three fields of which the third is the sum of the others, of any size."""
    metric = sparse.identity(6, format="csr")
    rows = scale * np.array([[1.0, 0, 0, 0, 0, 0], [0, 0.5, 0, 0, 0, 0], [1.0, 0.5, 0, 0, 0, 0]])
    values, _ = gram_vectors(rows, metric)
    # The sum and the sum of squares of the eigenvalues are traces of G and G G.
    gram = rows @ rows.T
    assert values.sum() == pytest.approx(np.trace(gram), rel=1e-12)
    assert (values**2).sum() == pytest.approx(np.trace(gram @ gram), rel=1e-12)
    assert values[2] == 0.0


def test_leading_fields_of_both_parities_leave_no_more_than_they_say() -> None:
    """Each t^2 of the square of snapshots and their images, so both up to 2 t^2 of it."""
    mirror, tolerance = PART.mesh.mirror_nodes, 0.05
    snapshots = wandering_snapshots(20)
    images = snapshots[:, mirror] * [1.0, -1.0, 1.0]
    gathered = in_blocks(snapshots, 1e-9, 20, mirror)
    rows = np.concatenate(list(leading_fields([gathered], METRIC, tolerance).values()))
    error = projection_error(np.concatenate([snapshots, images]), rows)
    assert error <= 2.0**0.5 * tolerance * (1.0 + 1e-6)


def test_nothing_but_all_fields_holds_all_of_several_snapshots() -> None:
    few = in_blocks(wandering_snapshots(4, seed=1), 1e-9, 4)
    assert sum(len(fields) for fields in leading_fields([few], METRIC, 0.0).values()) == 4
