"""Snapshots in files: read in blocks, any number of them in the same memory."""

from __future__ import annotations

import tracemalloc
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sparse
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.base.artefact import ArtefactError
from pneumorph.reduction.compressed_snapshots import SnapshotCompressor
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.snapshots import BLOCK_SIZE, Snapshots
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, bend_snapshots

CELLS = (6, 4, 4)


def moving_states(count: int, seed: int) -> np.ndarray:
    """Combinations of vibration modes of a millimetre."""
    rng = np.random.default_rng(seed)
    return np.moveaxis(falling_modes() @ rng.normal(size=(12, count)), 2, 0).astype(np.float32)


@cache
def falling_modes() -> np.ndarray:
    """The first of a millimetre, each further one of 0.7 of the last."""
    modes = vibration_modes(synthetic_part(CELLS), 12)
    scaled: np.ndarray = modes / np.abs(modes).max(axis=(0, 1)) * 0.7 ** np.arange(12)
    return scaled


def snapshots_of(displacement: np.ndarray, name: str, digest: str = "a") -> Snapshots:
    count = len(displacement)
    return Snapshots(
        displacement,
        np.arange(float(count)),
        np.zeros(count, dtype=np.int32),
        {"mesh_digest": digest, "sources": [name], "seconds": {"wall": 2.0, "processor": 1.5}},
    )


def test_files_are_the_joined_snapshots(tmp_path: Path) -> None:
    metric = sparse.identity(synthetic_part(CELLS).mesh.nodes.size, format="csr")
    pieces = [
        snapshots_of(moving_states(BLOCK_SIZE + 40, 0), "walk 0"),
        snapshots_of(moving_states(5, 1), "load"),
    ]
    paths = [piece.save(tmp_path / f"{number}.npz") for number, piece in enumerate(pieces)]
    compressor = SnapshotCompressor(metric, 1e-6)
    third = moving_states(30, 2)
    compressor.add(third)
    compressed = compressor.finish(
        np.zeros(30), np.zeros(30, dtype=np.int32), {"mesh_digest": "a", "sources": ["walk 1"]}
    )
    files = SnapshotFiles([*paths, compressed.save(tmp_path / "2.npz")])

    whole = np.concatenate([*(piece.displacement for piece in pieces), third])
    assert len(files) == len(whole)
    assert files.sources == ["walk 0", "load", "walk 1"]
    assert files.of("walk").tolist() == [
        *range(BLOCK_SIZE + 40),
        *range(BLOCK_SIZE + 45, len(whole)),
    ]
    assert files.pressure_kPa[BLOCK_SIZE + 41] == 1.0
    assert files.metadata["seconds"] == {"wall": 4.0, "processor": 3.0, "files_without": 1}
    numbers = np.arange(3, len(whole), 7)
    exact = numbers < BLOCK_SIZE + 45
    assert np.array_equal(files.states(numbers[exact]), whole[numbers[exact]])
    # Fields and coefficients in single precision.
    assert np.abs(files.states(numbers) - whole[numbers]).max() < 1e-5
    factors = np.concatenate(list(files.factors(numbers))).reshape(-1, whole[0].size)
    states = files.states(numbers).reshape(len(numbers), -1)
    assert np.abs(factors.T @ factors - states.T @ states).max() < 1e-4
    assert max(len(block) for block in files.blocks(np.arange(len(whole)))) <= BLOCK_SIZE


def test_each_source_of_a_file_has_its_own_details(tmp_path: Path) -> None:
    """A file of several sources, as the bends of a leg with two chambers, moves no others'."""
    names = ("bend", "bend of left", "bend of right", "load", "blocked")
    pieces = [snapshots_of(moving_states(2, 0), name) for name in names]
    for piece in pieces:
        piece.metadata["details"] = {"of": piece.sources[0]}
    del pieces[3].metadata["details"]
    first = Snapshots.joined([Snapshots.joined(pieces[:2]), pieces[2]])
    files = [first, *pieces[3:]]
    paths = [each.save(tmp_path / f"{number}.npz") for number, each in enumerate(files)]
    read = SnapshotFiles(paths)
    details = read.metadata["details"]
    assert [each and each["of"] for each in details] == [*names[:3], None, "blocked"]
    assert read.sources == list(names)
    assert Snapshots.joined(files).metadata["details"] == details


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    states = moving_states(4, 0)
    one = snapshots_of(states, "walk").save(tmp_path / "one.npz")
    other = snapshots_of(states, "walk", "b").save(tmp_path / "other.npz")
    with pytest.raises(ArtefactError, match="must be of one mesh"):
        SnapshotFiles([one, other])
    with pytest.raises(ArtefactError, match="at least one file"):
        SnapshotFiles([])
    with pytest.raises(ValueError, match="numbers must ascend"):
        SnapshotFiles([one]).states(np.array([2, 1]))
    one.write_bytes(one.read_bytes()[:200])
    with pytest.raises(ArtefactError, match="is not a readable Snapshots file"):
        SnapshotFiles([one])


def peak_memory_mb(paths: list[Path]) -> float:
    """Largest memory of arrays and objects while a part is reduced from the files."""
    settings = ReductionSettings(
        mode_limit=4, training_state_limit=8, ecsw=EcswSettings(stiffness_state_count=1)
    )
    part = synthetic_part(CELLS)
    tracemalloc.start()
    reduce_part(part, SnapshotFiles(paths), settings)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / 2**20


def test_memory_of_a_reduction_does_not_grow_with_the_snapshots(tmp_path: Path) -> None:
    part = synthetic_part(CELLS)
    digest = part.mesh.digest()
    bend = bend_snapshots(part, StaticSnapshotSettings(bend_pressure_kPa=30.0, bend_count=1))
    paths = [bend.save(tmp_path / "bend.npz")]
    for number in range(4):
        states = moving_states(500, number)
        states[:, part.mesh.node_set("attachment")] = 0.0
        walk = snapshots_of(states, f"walk {number}", digest)
        paths.append(walk.save(tmp_path / f"walk_{number}.npz"))
    peak_memory_mb(paths[:1])  # imports and caches
    few, many = peak_memory_mb(paths[:2]), peak_memory_mb(paths)
    # Held whole, 1500 more snapshots in double precision are 4.5 MB; numbers, pressures and errors
    # of each, some hundred bytes, are below 1 MB.
    assert 1500 * part.node_count * 24 / 2**20 > 4.5
    assert many - few < 2.0
