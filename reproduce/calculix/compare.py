"""Compare the static bend of the shipped leg with CalculiX's, law by law.

    python reproduce/calculix/compare.py --nodes 4 --out runs/calculix

Writes comparison.json and bend.png into the folder.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import tyro
from bend_comparison import (
    LAW_PAIRS,
    BendCurve,
    LawPair,
    calculix_bend,
    our_bend,
    relative_difference,
)

from pneumorph.base.artefact import write_json
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.report.style import (
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ComparisonSettings:
    """What to compare."""

    nodes: Literal[4, 10] = 4
    """Nodes of a tetrahedron."""
    laws: tuple[str, ...] = tuple(dict.fromkeys(pair.ours for pair in LAW_PAIRS))
    """Our laws."""
    pressures_kPa: tuple[float, ...] = (20.0, 80.0, 160.0)
    """Pressures, rising [kPa]."""
    time_limit_s: float = 1800.0
    """When to end a run of CalculiX; what it has reached then counts [s]."""
    out: Path = Path("runs/calculix")
    """Folder of comparison.json and bend.png."""

    def __post_init__(self) -> None:
        known = {pair.ours for pair in LAW_PAIRS}
        if not set(self.laws) <= known:
            raise ValueError(f"laws must be among {', '.join(sorted(known))}, got {self.laws}")


def main(settings: ComparisonSettings) -> None:
    """Run both codes for every law; a line for each as it ends."""
    mesh = paper_leg_mesh() if settings.nodes == 4 else quadratic_mesh(paper_leg_mesh())

    @cache
    def theirs(law: str) -> BendCurve:
        return calculix_bend(mesh, law, settings.pressures_kPa, time_limit_s=settings.time_limit_s)

    results = []
    for pair in LAW_PAIRS:
        if pair.ours not in settings.laws:
            continue
        ours = our_bend(mesh, pair.ours, settings.pressures_kPa, rotation=pair.rotation)
        other = theirs(pair.theirs)
        results.append((pair, ours, other))
        print(_line(pair, ours, other), flush=True)
        record = {
            "nodes_per_tetrahedron": settings.nodes,
            "mesh_digest": mesh.digest(),
            "comparisons": [_record(*result) for result in results],
        }
        write_json(settings.out / "comparison.json", record)
    save_figure(_figure(results), settings.out / "bend.png", ("png",))


def _line(pair: LawPair, ours: BendCurve, theirs: BendCurve) -> str:
    differences = ", ".join(
        f"{pressure:g} kPa {bend:.3f} deg ({difference:+.1e})"
        for pressure, bend, difference in zip(
            ours.pressures_kPa, ours.bends_deg, relative_difference(ours, theirs), strict=False
        )
    )
    return (
        f"{pair.label} against {pair.theirs}: {differences}; "
        f"{ours.wall_s:.0f} s and {theirs.wall_s:.0f} s "
        f"{'; '.join(filter(None, (ours.message, theirs.message)))}"
    )


def _record(pair: LawPair, ours: BendCurve, theirs: BendCurve) -> dict[str, Any]:
    return {
        "law": pair.label,
        "same_law": pair.same,
        "ours": ours.as_json(),
        "calculix": theirs.as_json(),
        "relative_difference": relative_difference(ours, theirs),
    }


@figure_style()
def _figure(results: list[tuple[LawPair, BendCurve, BendCurve]]) -> Figure:
    """Bend against pressure: lines are ours, rings CalculiX's."""
    figure = new_figure()
    axes = figure.add_subplot()
    drawn: set[str] = set()
    for (pair, ours, theirs), colour in zip(results, REGULATOR_COLOURS, strict=False):
        axes.plot(ours.pressures_kPa, ours.bends_deg, color=colour, label=pair.label)
        if theirs.law not in drawn:
            axes.plot(
                theirs.pressures_kPa,
                theirs.bends_deg,
                "o",
                color=colour,
                fillstyle="none",
                label=f"CalculiX: {theirs.law.removeprefix('calculix_')}",
            )
            drawn.add(theirs.law)
    axes.set(xlabel="pressure (kPa)", ylabel="bend of the end face (°)")
    axes.legend(loc="upper left", fontsize=7)
    return figure


if __name__ == "__main__":
    main(tyro.cli(ComparisonSettings, description=__doc__))
