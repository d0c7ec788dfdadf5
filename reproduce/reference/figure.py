"""Our paths beside the reference's, with the spread of our own variants, and the table of numbers.

Reads what compare.py and bend.py have written. The band is from the lowest to the highest of our
variants at each time. Writes CASE.png, bend.png and summary.json.

Example: python reproduce/reference/figure.py --reference ../shared/reference
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from reference_case import CASES, read_columns

from pneumorph.base.artefact import write_atomically, write_json
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
)

PANELS = (("x", "forward (mm)"), ("z", "height (mm)"), ("pitch_deg", "pitch (deg)"))


@dataclass(frozen=True)
class FigureOptions:
    """What to draw."""

    reference: Path
    """Folder of the reference's CSV files."""
    out: Path = Path("runs/reference")
    """Folder of the results; the figures are written there too."""
    best: str = "gmsh"
    """Variant drawn as our path; the first one found where it is missing."""


@figure_style()
def path_figure(runs: list[dict[str, Any]], columns: dict[str, np.ndarray], best: str) -> Any:
    """Reference, one variant of ours and the band of all of them, over time."""
    figure = new_figure(6.5, 6.0)
    panels = figure.subplots(len(PANELS), 1, sharex=True)
    chosen = next((run for run in runs if run["name"] == best), runs[0])
    longest_s = max(run["rows"][-1]["t"] for run in runs)
    shown = columns["t"] <= longest_s + 1e-9
    for axes, (name, label) in zip(panels, PANELS, strict=True):
        longest_run = max(runs, key=lambda run: len(run["rows"]))
        time_s = [each["t"] for each in longest_run["rows"]]
        paths = np.full((len(runs), len(time_s)), np.nan)  # runs may end earlier
        for path, run in zip(paths, runs, strict=True):
            path[: len(run["rows"])] = [each[name] for each in run["rows"]]
        axes.fill_between(
            time_s,
            np.nanmin(paths, axis=0),
            np.nanmax(paths, axis=0),
            color=NEUTRAL_COLOUR,
            alpha=0.35,
            linewidth=0,
            label=f"spread of our {len(runs)} meshes",
        )
        axes.plot(
            [each["t"] for each in chosen["rows"]],
            [each[name] for each in chosen["rows"]],
            color=LEARNED_COLOUR,
            label=f"pneumorph, {chosen['name']}",
        )
        axes.plot(
            columns["t"][shown], columns[name][shown], color=BASELINE_COLOUR, label="reference"
        )
        axes.set_ylabel(label)
    panels[0].legend()
    panels[-1].set_xlabel("time (s)")
    return figure


@figure_style()
def bend_figure(runs: list[dict[str, Any]]) -> Any:
    """Difference of the bend from the reference's over pressure, one line a mesh."""
    figure = new_figure()
    axes = figure.subplots()
    for run in runs:
        axes.plot(
            [each["kPa"] for each in run["rows"]],
            [each["difference_percent"] for each in run["rows"]],
            "o-",
            label=run["name"],
        )
    axes.axhspan(-3.0, 3.0, color=NEUTRAL_COLOUR, alpha=0.2, linewidth=0)
    axes.set(xlabel="simulated pressure (kPa)", ylabel="bend against reference (%)")
    axes.legend()
    return figure


def main(options: FigureOptions) -> None:
    """Draw what is there and collect its numbers."""
    summary: dict[str, Any] = {}
    for name, case in CASES.items():
        runs = _results(options.out, name)
        if not runs:
            continue
        columns = read_columns(options.reference / case.file)
        _save(options.out / f"{name}.png", path_figure(runs, columns, options.best))
        summary[name] = {run["name"]: run["differences"] for run in runs}
    bends = _results(options.out, "bend")
    if bends:
        _save(options.out / "bend.png", bend_figure(bends))
        summary["bend"] = {run["name"]: run["rows"] for run in bends}
    if not summary:
        raise SystemExit(f"{options.out} has no results; run compare.py or bend.py first")
    write_json(options.out / "summary.json", summary)


def _results(folder: Path, case: str) -> list[dict[str, Any]]:
    return [json.loads(path.read_text()) for path in sorted(folder.glob(f"{case}-*.json"))]


def _save(path: Path, figure: Any) -> None:
    write_atomically(path, lambda stream: figure.savefig(stream, format="png"))


if __name__ == "__main__":
    main(tyro.cli(FigureOptions, description=__doc__))
