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

from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.report.comparison_figures import draw_comparison
from pneumorph.study.comparison import Comparison, ComparisonSettings, compare
from pneumorph.study.reduction import Reduction
from pneumorph.study.reduction_options import ReduceOptions, reduce_as_asked
from pneumorph.study.study_once import study_folder, study_once

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
MODES = (0.03, 0.018, 0.0126)
ELEMENTS = (0.03, 0.012, 0.005)


def reduced(folder: Path, modes: float, elements: float) -> Path:
    """The file of a leg that was reduced to two tolerances, from the snapshots in its folder."""
    ecsw = EcswSettings(hyperreduction_tolerance=elements, element_limit=500)
    options = ReduceOptions(
        leg=PUBLISHED.leg,
        reduction=ReductionSettings(
            mode_tolerance=modes, mode_limit=32, bend_share=0.2, load_share=0.1, ecsw=ecsw
        ),
    )
    place = study_folder(folder, "reduce")
    found = study_once(place, Reduction, options, lambda: reduce_as_asked(options, place))
    return Path(found.part)


def compared(folder: Path, parts: list[Path]) -> Comparison:
    """How the reductions walk beside finite elements."""
    settings = ComparisonSettings(
        heldout_count=0, floating_duration_s=0.0, timed_steps=0, grid=tuple(parts)
    )
    place = study_folder(folder, "compare")
    found = study_once(
        place,
        Comparison,
        {"comparison": settings, "robot": PUBLISHED},
        lambda: compare(settings, PUBLISHED.spec(), place),
    )
    draw_comparison(found, place)
    return found


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
        parts.append(reduced(folder, modes, elements))
    compared(out / "compare", parts)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
