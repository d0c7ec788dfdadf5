"""Sections of reductions: errors beside full robots, bend, tolerances, and the leg in use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from pneumorph.reduction.part_summary import PartSummary
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.report import page
from pneumorph.report.page import Section
from pneumorph.report.reduction_figures import bend_figure, stage_figure, tolerance_figure
from pneumorph.report.sheet import Sheet
from pneumorph.study.comparison import Comparison
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.reduction_grid import GridPoint
from pneumorph.study.robot_error import RobotError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DIGEST_DIGITS = 12
"""As many of a digest as tell meshes, and legs, apart."""


def comparison_sections(found: Comparison, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return animations, tolerances and bend of a comparison."""
    sections = [
        _errors_section(title, kind, errors, run)
        for kind, title, errors in (
            ("animations", "Reduced beside full robots", found.animations),
            ("heldout", "Robots that no snapshot came from", found.heldout),
            ("periodic", "Periodic gaits, whose errors add up", found.periodic),
            ("floating", "Without gravity and floor", found.floating),
        )
        if errors
    ]
    if found.tolerance_grid:
        sections.append(_tolerance_section(found.tolerance_grid, sheet))
    figure = bend_figure(found.bend_pressures_kPa, found.bend_full_deg, found.bend_reduced_deg)
    caption = "A single leg held at its attachment, without floor or gravity."
    return [*sections, Section("Bend of one leg", sheet.drawn("bend", figure, caption))]


class HasStages(Protocol):
    """A result that tells how long each stage took [s]."""

    @property
    def stage_seconds(self) -> Mapping[str, float]: ...


def stage_sections(found: HasStages, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return where the time of a run went."""
    drawn = sheet.drawn("stages", stage_figure(found.stage_seconds), "Wall time of each stage.")
    return [Section("Where the time went", drawn)]


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


def _errors_section(
    title: str, kind: str, errors: Mapping[str, RobotError], run: FinishedRun
) -> Section:
    """Return the errors of one kind of runs, and their course over time as it was drawn."""
    rows = [
        (name.replace("_", " "), *(getattr(error, column) for column in _COLUMNS))
        for name, error in errors.items()
    ]
    body = page.table(["run", *_COLUMNS.values()], rows)
    picture = run.folder / f"{kind}_node_error.png"
    if picture.exists():
        body += page.picture(picture, "Mean node error against time.")
    return Section(title, body)


def _tolerance_section(grid: tuple[GridPoint, ...], sheet: Sheet) -> Section:
    usual = ReductionSettings()
    figure = tolerance_figure(grid, (usual.mode_tolerance, usual.ecsw.hyperreduction_tolerance))
    caption = (
        "Mean node error against the time of a step; colours are mode tolerances, markers "
        "hyperreduction tolerances, the ring the usual pair where it is among them."
    )
    columns = ["mode_tolerance", "hyperreduction_tolerance", "mode_count", "element_count",
               "mean_node_error_mm", "s_per_step"]  # fmt: skip
    rows = [[getattr(each, name) for name in columns] for each in grid]
    table = page.table([name.replace("_", " ") for name in columns], rows)
    return Section(
        "Error and time over the tolerances", sheet.drawn("tolerances", figure, caption) + table
    )


class HasLeg(Protocol):
    """A result that tells the reduced leg it used or made; None where there is none."""

    @property
    def leg(self) -> PartSummary | None: ...


def _told(leg: PartSummary) -> dict[str, Any]:
    """What a table says of a reduced leg, by name: its size, whether it knows its range, errors."""
    left_out = ("errors", "bend", "others")
    sizes = {name: value for name, value in vars(leg).items() if name not in left_out}
    # A whole digest is as wide as a page, and leaves no room for a second leg's numbers.
    told = {**sizes, "mesh_digest": leg.mesh_digest[:_DIGEST_DIGITS]}
    if leg.digest is not None:
        told["digest"] = leg.digest[:_DIGEST_DIGITS]
    if leg.bend and leg.bend["pressure_kPa"]:
        told["bend in its last snapshot (degrees)"] = leg.bend["full_deg"][-1]
        told["at a pressure of (kPa)"] = leg.bend["pressure_kPa"][-1]
    return {**told, **leg.errors}


def leg_sections(found: HasLeg, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return size and errors of each reduced leg that a run used or made."""
    if found.leg is None:
        return []
    leg = found.leg
    every = (leg, *getattr(leg, "others", {}).values())
    told = [_told(each) for each in every]
    names = dict.fromkeys(name for each in told for name in each)
    rows = [[name.replace("_", " "), *(each.get(name) for each in told)] for name in names]
    what = "the reduced leg" if len(told) == 1 else "reduced legs"
    body = page.table([what, *[""] * len(told)], rows)
    drawn = []
    for number, each in enumerate(every):
        if each.bend:
            whose = "the leg" if len(every) == 1 else each.part
            caption = f"Bend of {whose} held at its root, by finite elements and reduced."
            name = f"leg_bend_{number}" if number else "leg_bend"
            drawn.append(sheet.drawn(name, _bend(each.bend), caption))
    if len(drawn) == 1:
        body = page.side_by_side(*drawn, body)
    elif drawn:
        body = page.side_by_side(*drawn) + body
    alone = [
        sheet.drawn(f"leg_bend_{name}", _bend(bend), f"The same where {name} alone is inflated.")
        for name, bend in getattr(found, "bend_of_cavities", {}).items()
    ]
    if alone:
        body += page.side_by_side(*alone)
    return [Section("How well the reduced leg stands for its finite elements", body)]


def _bend(told: Mapping[str, Sequence[float]]) -> Figure:
    return bend_figure(told["pressure_kPa"], told["full_deg"], told["reduced_deg"])
