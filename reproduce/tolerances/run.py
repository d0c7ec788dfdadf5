"""Reductions over a grid of both tolerances, and how they walk: figure 12 of the paper.

    python reproduce/tolerances/run.py runs/leg --out runs/tolerances

`runs/leg` is a finished `pneumorph reduce --preset paper`, whose snapshots all reductions share.
Reductions that are there already are kept. About two minutes of a processor each; the comparison
reads full-order trajectories that ship. Writes a folder for each reduction, and compare/ with
tolerances.png and `tolerance_grid` in its summary.json.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

from pneumorph.command.run_once import run_once

MODES = (0.03, 0.018, 0.0126)
ELEMENTS = (0.03, 0.012, 0.005)
LIMITS = (
    "--reduction.mode-limit", 32, "--reduction.ecsw.element-limit", 500,
    "--reduction.bend-share", 0.2, "--reduction.load-share", 0.1,
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, help="folder of a finished reduction")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    snapshots = (options.source / "snapshots").resolve(strict=True)
    parts = []
    for modes, elements in product(MODES, ELEMENTS):
        folder = options.out / f"{modes:g}_{elements:g}"
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "snapshots").exists():
            (folder / "snapshots").symlink_to(snapshots)
        run_once(
            folder, "reduce", "--preset", "paper", "--reduction.mode-tolerance", modes,
            "--reduction.ecsw.hyperreduction-tolerance", elements, *LIMITS,
        )  # fmt: skip
        parts.append(folder / "leg.npz")
    run_once(
        options.out / "compare", "compare", "--heldout-count", 0, "--floating-duration-s", 0,
        "--timed-steps", 0, "--grid", *parts,
    )  # fmt: skip


if __name__ == "__main__":
    main()
