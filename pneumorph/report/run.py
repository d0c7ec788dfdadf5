"""A finished run as its files tell it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumorph.trajectory import Trajectory

_LABELS = {
    "best_trajectory": "learned",
    "baseline_trajectory": "expert",
    "trajectory": "robot",
}
_MODELS = ("full", "reduced")


@dataclass(frozen=True)
class Run:
    """A finished run.

    Attributes:
        folder: The run folder.
        summary: Its summary, with the name of its ``verb``.
        settings: Its resolved settings.
    """

    folder: Path
    summary: Mapping[str, Any]
    settings: Mapping[str, Any]

    @property
    def source(self) -> Mapping[str, Any]:
        """Summary of the run that this one looks at; empty where there is none or it is gone."""
        summary = Path(str(self.summary.get("run", ""))) / "summary.json"
        if "run" not in self.summary or not summary.exists():
            return {}
        content: dict[str, Any] = json.loads(summary.read_text())
        return content

    def trajectories(self) -> dict[str, dict[str, Trajectory]]:
        """Return the folder's trajectories by robot, in groups that belong side by side.

        A training's best pair stands beside the expert, an evaluation's pairs beside each other,
        and the two models of an animation beside each other.
        """
        groups: dict[str, dict[str, Trajectory]] = {}
        for path in sorted(self.folder.glob("*.npz"), key=_order):
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
