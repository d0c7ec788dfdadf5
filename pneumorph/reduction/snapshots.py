"""Snapshots: states of a full-order part that a reduction learns from.

`Snapshots` holds every state as it is. `CompressedSnapshots` of `compressed_snapshots.py` holds
them as combinations of few fields, `SnapshotFiles` of `snapshot_files.py` leaves them on the disk.
A reduction reads any of the three in blocks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact

FORMAT_VERSION = 1
BEND = "bend"
"""Source of free bending with one pressure in all cavities; ``bend of NAME`` is of one alone."""
BLOCK_SIZE = 256
"""Snapshots that are in memory at a time."""


class SnapshotSet(ABC):
    """States of one part, however they are kept."""

    pressure_kPa: np.ndarray
    """Pressure in the cavity [kPa], (snapshot,)."""
    source: np.ndarray
    """Index into ``metadata["sources"]`` of the protocol each came from, (snapshot,)."""
    metadata: dict[str, Any]
    """``mesh_digest``, ``sources`` (names), and what the protocol recorded; JSON-serialisable."""

    @abstractmethod
    def blocks(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Node displacements of the numbered snapshots, in order [mm], each (some, node, 3).

        Args:
            numbers: Which snapshots, ascending, (number,).
        """

    @abstractmethod
    def factors(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Fields f with sum f f^T = sum u u^T over the numbered snapshots u; maybe far fewer.

        Args:
            numbers: Which snapshots, ascending, (number,).
        """

    def __len__(self) -> int:
        return len(self.source)

    @property
    def sources(self) -> list[str]:
        """Names of the protocols."""
        return list(self.metadata.get("sources", []))

    def of(self, *names: str) -> np.ndarray:
        """Numbers of the snapshots whose source starts with one of the names, ascending."""
        wanted = [i for i, source in enumerate(self.sources) if source.startswith(names)]
        return np.flatnonzero(np.isin(self.source, wanted))

    def states(self, numbers: np.ndarray) -> np.ndarray:
        """Displacements of a few snapshots in double precision [mm], (number, node, 3)."""
        blocks = [block.astype(np.float64) for block in self.blocks(np.asarray(numbers))]
        return np.concatenate(blocks) if blocks else np.zeros((0, 0, 3))


class SavedSnapshots(SnapshotSet):
    """Snapshots that are a file: what the states are made of, and what is known of each."""

    format_version: ClassVar[int]
    state_arrays: ClassVar[tuple[str, ...]]
    """Names of what the states are made of; kept in single precision."""

    def save(self, path: Path | str) -> Path:
        """Write the snapshots."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.state_arrays}
        arrays |= {"pressure_kPa": self.pressure_kPa, "source": self.source}
        return save_artefact(path, "Snapshots", self.format_version, arrays, self.metadata)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read snapshots.

        Raises:
            ArtefactError: The file is truncated, of another kind or another format version.
        """
        arrays, metadata = load_artefact(path, "Snapshots", cls.format_version)
        with reading(path, "Snapshots"):
            return cls(**arrays, metadata=metadata)  # type: ignore[call-arg]  # its dataclasses'


def details_of(metadata: Mapping[str, Any]) -> list[Any]:
    """What is known of each source of some snapshots, by their metadata, in its order."""
    details = metadata.get("details")
    return details if isinstance(details, list) else [details] * len(metadata.get("sources", []))


@dataclass(frozen=True, eq=False)
class Snapshots(SavedSnapshots):
    """Displacements of a part in its own frame, zero at the attachment nodes."""

    format_version = FORMAT_VERSION
    state_arrays = ("displacement",)

    displacement: np.ndarray
    """Node displacements from rest [mm], (snapshot, node, 3), single precision."""
    pressure_kPa: np.ndarray
    """Pressure in the cavity [kPa], (snapshot,)."""
    source: np.ndarray
    """Index into ``metadata["sources"]`` of the protocol each came from, (snapshot,)."""
    metadata: dict[str, Any] = field(default_factory=dict)
    """``mesh_digest``, ``sources`` (names), and what the protocol recorded; JSON-serialisable."""

    def __post_init__(self) -> None:
        count = len(self.displacement)
        if self.displacement.ndim != 3 or self.displacement.shape[2] != 3:
            raise ValueError(
                f"displacement must have shape (snapshot, node, 3), got {self.displacement.shape}"
            )
        for name in ("pressure_kPa", "source"):
            if np.shape(getattr(self, name)) != (count,):
                raise ValueError(
                    f"{name} must have one entry for each of the {count} snapshots, got shape "
                    f"{np.shape(getattr(self, name))}"
                )
        if not np.all(np.isfinite(self.displacement)):
            raise ValueError("displacement must be finite; the full-order run may have diverged")

    def blocks(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """Displacements of the numbered snapshots; see `SnapshotSet`."""
        for start in range(0, len(numbers), BLOCK_SIZE):
            yield self.displacement[numbers[start : start + BLOCK_SIZE]]

    def factors(self, numbers: np.ndarray) -> Iterator[np.ndarray]:
        """The same: every snapshot stands for itself."""
        return self.blocks(numbers)

    @classmethod
    def joined(cls, pieces: Sequence[Snapshots]) -> Snapshots:
        """All snapshots of several sets of the same mesh, in order.

        Raises:
            ArtefactError: The sets belong to different meshes.
        """
        digest = one_mesh([piece.metadata for piece in pieces])
        sources: list[str] = []
        numbers = []
        for piece in pieces:
            numbers.append(piece.source + len(sources))
            sources += piece.sources
        return cls(
            np.concatenate([piece.displacement for piece in pieces]),
            np.concatenate([piece.pressure_kPa for piece in pieces]),
            np.concatenate(numbers),
            {
                "mesh_digest": digest,
                "sources": sources,
                "details": [each for piece in pieces for each in details_of(piece.metadata)],
            },
        )


def one_mesh(metadata: Sequence[Mapping[str, Any]]) -> str | None:
    """Digest of the one mesh that sets of snapshots are of.

    Args:
        metadata: Of each set of snapshots.

    Raises:
        ArtefactError: They are of several meshes.
    """
    digests = {each.get("mesh_digest") for each in metadata}
    if len(digests) != 1:
        raise ArtefactError(
            f"snapshots must be of one mesh, got {len(digests)} different mesh digests; "
            "collect them again for the mesh at hand"
        )
    return digests.pop()
