"""POD against what it promises: the error formula, orthonormal modes, mirrored symmetry."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sparse
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.reduction.pod import MIRROR, pod, project, truncation_error

PART = synthetic_part((4, 4, 4))
MESH = PART.mesh


def random_snapshots(count: int, rank: int, seed: int = 0) -> np.ndarray:
    """Combinations of vibration modes with falling amplitudes."""
    modes = vibration_modes(PART, rank)
    amplitude = 0.3 ** np.arange(rank) * np.random.default_rng(seed).normal(size=(count, rank))
    return np.einsum("nim,sm->sni", modes, amplitude)


def test_snapshots_of_few_modes_are_reproduced_by_as_many():
    snapshots = random_snapshots(12, 4)
    result = pod(snapshots, PART.node_mass, tolerance=1e-6, mode_limit=20)
    assert result.modes.shape[2] == 4
    rebuilt = np.einsum(
        "nim,sm->sni", result.modes, project(snapshots, result.modes, PART.node_mass)
    )
    # Square roots of Gram eigenvalues resolve 1e-8 of the largest amplitude.
    assert np.abs(rebuilt - snapshots).max() < 1e-6 * np.abs(snapshots).max()


@pytest.mark.parametrize("metric", ["mass", "energy"])
def test_tolerance_is_the_relative_projection_error(metric):
    matrix = None
    if metric == "energy":
        matrix = sparse.csr_matrix(PART.stiffness(MESH.nodes))
    snapshots = random_snapshots(30, 10)
    result = pod(snapshots, PART.node_mass, tolerance=0.01, mode_limit=20, metric=matrix)
    weight = sparse.diags(np.repeat(PART.node_mass, 3)) if matrix is None else matrix
    flat = snapshots.reshape(30, -1).T
    modes = result.modes.reshape(-1, result.modes.shape[2])
    coordinates = np.linalg.solve(modes.T @ (weight @ modes), modes.T @ (weight @ flat))
    error = flat - modes @ coordinates
    relative = np.sqrt(np.sum(error * (weight @ error)) / np.sum(flat * (weight @ flat)))
    # Identity (Eckart-Young); the difference is the rounding of the Gram eigenvalues.
    assert relative == pytest.approx(result.projection_error, rel=1e-4)
    assert result.projection_error <= 0.01
    fewer = truncation_error(result.singular_values)[result.modes.shape[2] - 1]
    assert fewer > 0.01


def test_modes_are_mass_orthonormal_in_every_metric():
    matrix = sparse.csr_matrix(PART.stiffness(MESH.nodes))
    for metric in (None, matrix):
        modes = pod(
            random_snapshots(20, 6), PART.node_mass, tolerance=1e-3, mode_limit=20, metric=metric
        ).modes
        product = np.einsum("n,nim,nik->mk", PART.node_mass, modes, modes)
        assert np.abs(product - np.eye(len(product))).max() < 1e-12


def test_modes_are_symmetric_or_antisymmetric_and_equal_those_of_snapshots_with_images():
    snapshots = random_snapshots(8, 6)
    split = pod(
        snapshots,
        PART.node_mass,
        tolerance=1e-6,
        mode_limit=20,
        mirror_nodes=MESH.mirror_nodes,
    )
    image = np.moveaxis(split.modes[MESH.mirror_nodes], 1, 2) * MIRROR
    for mode, parity in enumerate(split.parity):
        difference = image[:, mode] - parity * split.modes[:, :, mode]
        assert np.abs(difference).max() < 1e-12 * np.abs(split.modes).max()
    assert set(split.parity) == {1, -1}
    assert np.all(np.diff(split.parity) <= 0)  # those of one parity stand together

    doubled = np.concatenate([snapshots, snapshots[:, MESH.mirror_nodes] * MIRROR])
    plain = pod(doubled, PART.node_mass, tolerance=1e-6, mode_limit=20)
    count = split.modes.shape[2]
    # Same matrix decomposed in two ways; 1e-8 of the largest is the Gram's resolution.
    assert plain.modes.shape[2] == count
    assert np.allclose(
        split.singular_values[:count],
        plain.singular_values[:count],
        atol=1e-7 * plain.singular_values[0],
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"displacement": np.zeros((0, len(MESH.nodes), 3))}, "at least one snapshot"),
        ({"displacement": np.zeros((3, 5, 3))}, "must have shape"),
        ({"displacement": np.full((2, len(MESH.nodes), 3), np.nan)}, "must be finite"),
        ({"displacement": np.zeros((2, len(MESH.nodes), 3))}, "must not be zero"),
        ({"tolerance": 0.0}, "tolerance must lie between"),
        ({"mode_limit": 0}, "mode_limit must be at least 1"),
    ],
)
def test_bad_input_is_refused(change, message):
    arguments = {"displacement": random_snapshots(3, 3), "tolerance": 0.1, "mode_limit": 5}
    arguments.update(change)
    with pytest.raises(ValueError, match=message):
        pod(node_mass=PART.node_mass, **arguments)


def test_what_is_left_out_is_told_relative_to_all() -> None:
    values = np.array([4.0, 3.0, 0.0])
    np.testing.assert_allclose(truncation_error(values), [1.0, 0.6, 0.0, 0.0])
    # Of 25 and 11 that were dropped before, all, 20, 11 and 11 of 36 are left.
    np.testing.assert_allclose(truncation_error(values, 11.0) ** 2, np.array([36, 20, 11, 11]) / 36)
