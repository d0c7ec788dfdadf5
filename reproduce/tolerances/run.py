"""Reductions over a grid of both tolerances, and how they walk: figure 12 of the paper.

    python reproduce/tolerances/run.py runs/leg --out runs/tolerances

`runs/leg` is a finished `pneumorph reduce --preset paper`, whose snapshots all reductions share.
Reductions that are there already are kept. About two minutes of a processor each; the comparison
reads full-order trajectories that ship. Writes a folder for each reduction, and compare/ with
tolerances.png and `tolerance_grid` in its summary.json.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.settings import load_settings, settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.run_once import run_once

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
MODES = (0.03, 0.018, 0.0126)
ELEMENTS = (0.03, 0.012, 0.005)
LIMITS = (
    "--reduction.mode-limit", 32, "--reduction.ecsw.element-limit", 500,
    "--reduction.bend-share", 0.2, "--reduction.load-share", 0.1,
)  # fmt: skip


def main(source: tyro.conf.Positional[Path], out: Path) -> None:
    """Reduce and compare.

    Args:
        source: Folder of a finished reduction.
        out: Folder of the reductions and of their comparison.
    """
    snapshots = (source / "snapshots").resolve(strict=True)
    parts = []
    for modes, elements in product(MODES, ELEMENTS):
        folder = out / f"{modes:g}_{elements:g}"
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "snapshots").exists():
            (folder / "snapshots").symlink_to(snapshots)
        run_once(
            folder, "reduce", "--preset", "paper", "--leg", PUBLISHED.leg, "--hub", "soft",
            "--reduction.mode-tolerance", modes,
            "--reduction.ecsw.hyperreduction-tolerance", elements, *LIMITS,
        )  # fmt: skip
        parts.append(folder / "leg.npz")
    robot = write_json(out / "robot.json", {"robot": settings_to_dict(PUBLISHED)})
    run_once(
        out / "compare", "compare", "--settings", robot, "--heldout-count", 0,
        "--floating-duration-s", 0, "--timed-steps", 0, "--grid", *parts,
    )  # fmt: skip


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
