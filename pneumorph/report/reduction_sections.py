"""Sections of reductions: errors beside full robots, bend, tolerances, and the leg in use."""

from __future__ import annotations

from typing import Any

from pneumorph.report import page
from pneumorph.report.bend_figure import bend_figure
from pneumorph.report.page import Section
from pneumorph.report.run import Run
from pneumorph.report.sheet import Sheet
from pneumorph.report.stage_figure import stage_figure
from pneumorph.report.tolerance_figure import tolerance_figure


def comparison_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return animations, tolerances and bend of `pneumorph compare`, and times of stages."""
    summary = run.summary
    sections = [
        _kind_section(title, kind, run) for kind, title in _KINDS.items() if summary.get(kind)
    ]
    if summary.get("tolerance_grid"):
        sections.append(_tolerance_section(summary["tolerance_grid"], sheet))
    if "bend_pressures_kPa" in summary:
        figure = bend_figure(
            summary["bend_pressures_kPa"], summary["bend_full_deg"], summary["bend_reduced_deg"]
        )
        caption = "A single leg held at its attachment, without floor or gravity."
        sections.append(Section("Bend of one leg", sheet.drawn("bend", figure, caption)))
    if summary.get("stage_seconds"):
        figure = stage_figure(summary["stage_seconds"])
        caption = "Wall time of each stage."
        sections.append(Section("Where the time went", sheet.drawn("stages", figure, caption)))
    return sections


_KINDS = {
    "animations": "Reduced beside full robots",
    "heldout": "Robots that no snapshot came from",
    "floating": "Without gravity and floor",
}
_COLUMNS = {
    "mean_node_error_mm": "mean error (mm)",
    "mean_node_error_in_hub_mm": "in the hub's frame (mm)",
    "largest_node_error_mm": "largest (mm)",
    "mean_displacement_mm": "moved (mm)",
    "path_error_mm": "path (mm)",
    "forward_full_cm": "distance, full (cm)",
    "forward_reduced_cm": "reduced (cm)",
    "leg_force_error_percent": "force error (%)",
    "slip_agreement_percent": "slip agrees (%)",
}


def _kind_section(title: str, kind: str, run: Run) -> Section:
    """Return the errors of one kind of runs, and their course over time where it was drawn."""
    runs: dict[str, dict[str, Any]] = run.summary[kind]
    known = [key for key in _COLUMNS if any(key in each for each in runs.values())]
    rows = [(name.replace("_", " "), *(each.get(k) for k in known)) for name, each in runs.items()]
    body = page.table(["run", *(_COLUMNS[key] for key in known)], rows)
    picture = run.folder / f"{kind}_node_error.png"
    if picture.exists():
        body += page.picture(picture, "Mean node error against time.")
    return Section(title, body)


def _tolerance_section(grid: list[dict[str, Any]], sheet: Sheet) -> Section:
    from pneumorph.reduction.reduce import ReductionSettings

    usual = ReductionSettings()
    figure = tolerance_figure(grid, (usual.mode_tolerance, usual.ecsw.hyperreduction_tolerance))
    caption = (
        "Mean node error against the time of a step; colours are mode tolerances, markers "
        "hyperreduction tolerances, the ring the usual pair where it is among them."
    )
    columns = ["mode_tolerance", "hyperreduction_tolerance", "mode_count", "element_count",
               "mean_node_error_mm", "s_per_step"]  # fmt: skip
    rows = [[each.get(name) for name in columns] for each in grid]
    table = page.table([name.replace("_", " ") for name in columns], rows)
    return Section(
        "Error and time over the tolerances", sheet.drawn("tolerances", figure, caption) + table
    )


def leg_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return size and errors of the reduced leg that a run used or made."""
    leg = run.summary.get("leg")
    if not isinstance(leg, dict):
        return []
    sizes = [(name.replace("_", " "), leg[name]) for name in leg if name not in ("errors", "bend")]
    errors = [(name.replace("_", " "), value) for name, value in leg["errors"].items()]
    body = page.table(["the reduced leg", ""], [*sizes, *errors])
    if leg["bend"]:
        bend = leg["bend"]
        figure = bend_figure(bend["pressure_kPa"], bend["full_deg"], bend["reduced_deg"])
        caption = "Bend of the leg held at its root, by finite elements and reduced."
        body = page.side_by_side(sheet.drawn("leg_bend", figure, caption), body)
    return [Section("How well the reduced leg stands for its finite elements", body)]
