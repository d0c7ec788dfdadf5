"""Snapshots: states of a full-order part that a reduction learns from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import ArtefactError, load_artefact, save_artefact

FORMAT_VERSION = 1


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Displacements of a part in its own frame, zero at the attachment nodes."""

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

    def __len__(self) -> int:
        return len(self.displacement)

    @property
    def sources(self) -> list[str]:
        """Names of the protocols."""
        return list(self.metadata.get("sources", []))

    def of(self, *names: str) -> np.ndarray:
        """Numbers of the snapshots whose source starts with one of the names, ascending."""
        wanted = [i for i, source in enumerate(self.sources) if source.startswith(names)]
        return np.flatnonzero(np.isin(self.source, wanted))

    @classmethod
    def joined(cls, pieces: Sequence[Snapshots]) -> Snapshots:
        """All snapshots of several sets of the same mesh, in order.

        Raises:
            ArtefactError: The sets belong to different meshes.
        """
        digests = {piece.metadata.get("mesh_digest") for piece in pieces}
        if len(digests) != 1:
            raise ArtefactError(
                f"snapshots must be of one mesh, got {len(digests)} different mesh digests; "
                "collect them again for the mesh at hand"
            )
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
                "mesh_digest": digests.pop(),
                "sources": sources,
                "details": [piece.metadata.get("details") for piece in pieces],
            },
        )

    def save(self, path: Path | str) -> Path:
        """Write the snapshots."""
        arrays = {
            "displacement": self.displacement.astype(np.float32),
            "pressure_kPa": self.pressure_kPa,
            "source": self.source,
        }
        return save_artefact(path, "Snapshots", FORMAT_VERSION, arrays, self.metadata)

    @classmethod
    def load(cls, path: Path | str) -> Snapshots:
        """Read snapshots.

        Raises:
            ArtefactError: The file is truncated, of another kind or another format version.
        """
        arrays, metadata = load_artefact(path, "Snapshots", FORMAT_VERSION)
        return cls(**arrays, metadata=metadata)
