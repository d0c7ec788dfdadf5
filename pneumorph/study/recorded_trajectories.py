"""The trajectories that lie in a run folder, in groups that belong side by side."""

from __future__ import annotations

from pathlib import Path

from pneumorph.trajectory import Trajectory

_LABELS = {
    "best_trajectory": "learned",
    "baseline_trajectory": "expert",
    "trajectory": "robot",
}
_MODELS = ("full", "reduced")


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


def _order(path: Path) -> tuple[int, str]:
    known = list(_LABELS)
    return (known.index(path.stem) if path.stem in known else len(known), path.stem)


def _group_and_label(stem: str) -> tuple[str, str | None]:
    """Group and label of an npz file by its name; the label is None for what is no trajectory."""
    if stem in _LABELS:
        return "", _LABELS[stem]
    first, _, last = stem.rpartition("_")
    if stem.startswith("trajectory_"):  # trajectory_reduced_L1
        return "", last
    if last in _MODELS:  # hamiltonian_full
        return first.replace("_", " "), last
    return "", None
