"""Snapshots that stay in their files and are read in blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, stream_rows
from pneumorph.reduction import compressed_snapshots, snapshots
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.snapshots import BLOCK_SIZE, SnapshotSet, details_of, one_mesh


class SnapshotFiles(SnapshotSet):
    """The snapshots of several files of one mesh, as `Snapshots` or `CompressedSnapshots` wrote.

    In memory are the pressures and one block of states, or one compressed file.

    Args:
        paths: The files, in order.

    Raises:
        ArtefactError: No file, files of different meshes, or a file is not readable.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        if not paths:
            raise ArtefactError("snapshots must be in at least one file, got none")
        self.paths = tuple(paths)
        headers = [read_header(path) for path in self.paths]
        digest = one_mesh([metadata for _, metadata in headers])
        names: list[str] = []
        source = []
        for arrays, metadata in headers:
            source.append(arrays["source"] + len(names))
            names += metadata.get("sources", [])
        self.pressure_kPa = np.concatenate([arrays["pressure_kPa"] for arrays, _ in headers])
        self.source = np.concatenate(source)
        self.metadata: dict[str, Any] = {
            "mesh_digest": digest,
            "sources": names,
            "details": [each for _, metadata in headers for each in details_of(metadata)],
            "seconds": _total_seconds([metadata.get("seconds") for _, metadata in headers]),
        }
        self._ends = np.cumsum([len(arrays["source"]) for arrays, _ in headers])
        self._compressed = [
            metadata["format_version"] == compressed_snapshots.FORMAT_VERSION
            for _, metadata in headers
        ]

    def blocks(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Displacements of the numbered snapshots; see `SnapshotSet`.

        Raises:
            ValueError: The numbers do not ascend; files are read from beginning to end.
        """
        for file, wanted in self._by_file(numbers):
            if self._compressed[file]:
                yield from CompressedSnapshots.load(self.paths[file]).blocks(wanted)
            else:
                yield from self._plain(file, wanted)

    def factors(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Fields with the same sum of products; see `SnapshotSet`."""
        for file, wanted in self._by_file(numbers):
            if self._compressed[file]:
                yield from CompressedSnapshots.load(self.paths[file]).factors(wanted)
            else:
                yield from self._plain(file, wanted)

    def _by_file(self, numbers: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        numbers = np.asarray(numbers)
        if np.any(np.diff(numbers) <= 0):
            raise ValueError("numbers must ascend: the files of the snapshots are read once")
        starts = self._ends - np.diff(self._ends, prepend=0)
        for file, (start, end) in enumerate(zip(starts, self._ends, strict=True)):
            wanted = numbers[np.searchsorted(numbers, start) : np.searchsorted(numbers, end)]
            if len(wanted):
                yield file, wanted - start

    def _plain(self, file: int, numbers: np.ndarray) -> Iterator[np.ndarray]:
        start = 0
        for block in stream_rows(self.paths[file], "displacement", BLOCK_SIZE):
            inside = numbers[(numbers >= start) & (numbers < start + len(block))]
            if len(inside):
                yield block[inside - start]
            start += len(block)
            if start > numbers[-1]:
                return


def read_header(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Pressures, sources and metadata of a snapshot file, without its states.

    Raises:
        ArtefactError: The file is truncated, of another kind or another format version.
    """
    versions = (snapshots.FORMAT_VERSION, compressed_snapshots.FORMAT_VERSION)
    return load_artefact(
        path, "Snapshots", *versions, leave=("displacement", "fields", "coefficients")
    )


def _total_seconds(each: Sequence[dict[str, float] | None]) -> dict[str, float | int]:
    """Wall and processor time of all files that recorded it [s], and how many did not."""
    known = [seconds for seconds in each if seconds]
    return {
        "wall": sum(seconds["wall"] for seconds in known),
        "processor": sum(seconds["processor"] for seconds in known),
        "files_without": len(each) - len(known),
    }
