"""The published reduction itself: the paper's protocol and both of its tolerances.

    python reproduce/tolerances/published.py --out runs/published-reduction

Robots walk every corner of their pressures, as the paper's do, but only six of the 255. Modes and
elements are as many as the paper's tolerances ask for. The leg walks the four test animations
beside finite elements, which ship, and the leg that ships. Ten minutes of a processor; the same
call goes on where it was stopped. Writes reduction/ and compare/ with their summary.json.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import tyro
from run import compared

from pneumorph.study.reduction import Reduction
from pneumorph.study.reduction_options import ReduceOptions, corners, reduce_as_asked
from pneumorph.study.study_once import study_folder, study_once

LEG_COUNTS = (1, 2, 2, 3, 3, 4)
"""Legs of the robots that walk for snapshots: 42 corners together, where all 255 have 6560."""


def options() -> ReduceOptions:
    """The paper's protocol and tolerances, of fewer robots."""
    asked = corners()
    walk = replace(asked.snapshots.walk, robots="drawn", leg_counts=LEG_COUNTS)
    return replace(asked, snapshots=replace(asked.snapshots, walk=walk))


def main(out: Path) -> None:
    """Reduce and compare.

    Args:
        out: Folder of the reduction and of its comparison.
    """
    place, asked = study_folder(out / "reduction", "reduce"), options()
    found = study_once(place, Reduction, asked, lambda: reduce_as_asked(asked, place))
    compared(out / "compare", [Path(found.part)])


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
