"""The trajectories that lie in a run folder, in groups that belong side by side."""

from __future__ import annotations

import re
from pathlib import Path

from pneumorph.trajectory import Trajectory

_LABELS = {
    "best_trajectory": "learned",
    "baseline_trajectory": "expert",
    "trajectory": "robot",
}
_MODELS = ("full", "reduced")
_SIMULATED = "simulated_"
"""How the names of a transfer's walks begin, which its page shows beside their trials."""


def recorded_trajectories(folder: Path) -> dict[str, dict[str, Trajectory]]:
    """Return a folder's trajectories by robot, in groups by name.

    A training's best pair stands beside the expert, an evaluation's pairs beside each other, and
    the two models of an animation beside each other.
    """
    groups: dict[str, dict[str, Trajectory]] = {}
    for path in sorted(folder.glob("*.npz"), key=_order):
        group, label = _group_and_label(path.stem)
        if label is not None:
            groups.setdefault(group, {})[label] = Trajectory.load(path)
    return groups


def remove_earlier(folder: Path, *patterns: str) -> None:
    """Remove what an earlier call of the same verb wrote into a folder: a page would show as this
    run's what it does not write again.

    Args:
        folder: The run folder.
        patterns: Names of files there, with wildcards.
    """
    for pattern in patterns:
        for file in folder.glob(pattern):
            file.unlink()


def _order(path: Path) -> tuple[int, list[str | int]]:
    """By what is known of a name, then by its letters and its numbers: L2 comes before L10."""
    known = list(_LABELS)
    parts = re.split(r"(\d+)", path.stem)  # text and digits by turns, text first
    named = [int(part) if place % 2 else part for place, part in enumerate(parts)]
    return (known.index(path.stem) if path.stem in known else len(known), named)


def _group_and_label(stem: str) -> tuple[str, str | None]:
    """Group and label of an npz file by its name; the label is None for what is no trajectory."""
    if stem in _LABELS:
        return "", _LABELS[stem]
    if stem.startswith(_SIMULATED):
        return "", None
    first, _, last = stem.rpartition("_")
    if stem.startswith("trajectory_"):  # trajectory_reduced_L1
        return "", last
    if last in _MODELS:  # hamiltonian_full
        return first.replace("_", " "), last
    return "", None
