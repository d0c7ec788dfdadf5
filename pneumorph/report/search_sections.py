"""Sections of searches without a policy: learning curve, gaits of each design."""

from __future__ import annotations

import numpy as np

from pneumorph.report import page
from pneumorph.report.learning_figures import learning_curves_figure, own_gaits_figure
from pneumorph.report.page import Section
from pneumorph.report.sheet import Sheet
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.search_findings import DesignsBestGait, SearchCurve, SearchFindings


def search_sections(found: SearchFindings, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return what `pneumorph search` found."""
    sections = []
    curve = SearchCurve.read(run.folder)
    if np.isfinite(curve.best_distance_cm).any():
        figure = learning_curves_figure({found.method: (curve.simulated_s, curve.best_distance_cm)})
        caption = "Best distance so far against the simulated time of all robots."
        sections.append(Section("The search", sheet.drawn("learning_curve", figure, caption)))
    if found.designs:
        sections.append(_gaits_section(found.designs, sheet))
    return sections


def _gaits_section(rows: tuple[DesignsBestGait, ...], sheet: Sheet) -> Section:
    header = [
        "design", "why", "own gait (cm)", "gained in the last quarter (cm)", "shared policy (cm)",
        "fine-tuned policy (cm)",
    ]  # fmt: skip
    table = [
        (row.design, row.why, row.distance_cm, row.late_gain_cm, row.policy_distance_cm,
         row.learned_distance_cm)
        for row in rows
    ]  # fmt: skip
    body = page.table(header, table)
    if any(None not in (row.distance_cm, row.policy_distance_cm) for row in rows):
        caption = "Distance with a gait of its own over that with the shared policy."
        body = sheet.drawn("own_gaits", own_gaits_figure(rows), caption) + body
    return Section("Gaits of each design", body)
