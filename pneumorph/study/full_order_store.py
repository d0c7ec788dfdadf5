"""Trajectories of full-order robots, kept so that they need not be computed again.

Ten seconds of a full-order robot take minutes; a reduced one is compared with it many times. A kept
trajectory holds a tenth of the nodes, evenly taken, positions rounded to 2^-9 mm, forces to 1/4 mN
and velocities to 1/16 mm/s: below a megabyte.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.catalogue.shipped_data import data_folder
from pneumorph.trajectory import Trajectory

NODE_COUNT = 96
"""So many nodes of each leg are kept."""


def shipped_folders() -> tuple[Path, ...]:
    """Folders of the trajectories that ship with the package, one for each physics."""
    return tuple(sorted(data_folder("full_order").glob("*/")))


@dataclass(frozen=True)
class FullOrderStore:
    """Folders of kept trajectories.

    Attributes:
        folders: Where to look; the first is where new ones go.
    """

    folders: tuple[Path, ...]

    def find(self, name: str, identity: str) -> Trajectory | None:
        """Return a kept trajectory.

        Args:
            name: What it was saved as.
            identity: Digest of all that decides it (`rollout_identity`); another one's is not
                returned.
        """
        for folder in self.folders:
            path = folder / f"{name}.npz"
            if path.exists():
                kept = Trajectory.load(path)
                if kept.metadata.get("identity") == identity:
                    return kept
        return None

    def save(self, name: str, identity: str, trajectory: Trajectory) -> Trajectory:
        """Keep a trajectory, and return what `find` will return."""
        kept = thinned(trajectory)
        kept.metadata["identity"] = identity
        kept.save(self.folders[0] / f"{name}.npz")
        return kept


def thinned(trajectory: Trajectory) -> Trajectory:
    """A trajectory with few nodes, their numbers in its metadata as ``nodes``."""
    if trajectory.node_positions_mm is None:
        raise ValueError("a trajectory without node positions cannot be compared with; record them")
    count = trajectory.node_positions_mm.shape[2]
    nodes = np.unique(np.linspace(0, count - 1, min(NODE_COUNT, count)).astype(int))
    thin = at_nodes(trajectory, nodes)
    rounded: dict[str, Any] = {}
    for name, unit in (
        ("node_positions_mm", 2.0**-9),
        ("contact_force_mN", 0.25),
        ("contact_velocity_mm_per_s", 0.0625),
    ):
        value = getattr(thin, name)
        if value is not None:
            rounded[name] = (np.round(value / unit) * unit).astype(np.float32)
    return replace(thin, **rounded, metadata={**trajectory.metadata, "nodes": nodes.tolist()})


def at_nodes(trajectory: Trajectory, nodes: Sequence[int] | np.ndarray) -> Trajectory:
    """A trajectory with some of its nodes and no skin."""
    positions = trajectory.node_positions_mm
    if positions is None:
        raise ValueError("a trajectory without node positions has none to choose from")
    chosen = np.ascontiguousarray(positions[:, :, np.asarray(nodes, dtype=int)])
    return replace(trajectory, node_positions_mm=chosen, skin_triangles=None)


def rollout_identity(described: dict[str, Any], commands_kPa: np.ndarray) -> str:
    """Digest of a rollout.

    Args:
        described: Design, mesh digests, materials, settings; JSON-serialisable.
        commands_kPa: Real pressure asked for in every step [kPa], (step, regulator).
    """
    digest = hashlib.sha256(json.dumps(described, sort_keys=True).encode())
    digest.update(np.ascontiguousarray(commands_kPa, dtype=float).tobytes())
    return digest.hexdigest()
