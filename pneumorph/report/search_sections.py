"""Sections of searches without a policy: learning curve, gaits of each design."""

from __future__ import annotations

import numpy as np

from pneumorph.environment.goal import Goal
from pneumorph.learn.objective import Objective
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
    if np.isfinite(curve.best_achieved).any():
        figure = learning_curves_figure(
            {found.method: (curve.simulated_s, curve.best_achieved)}, goal=found.goal
        )
        caption = f"Best {found.goal.label} so far against the simulated time of all robots."
        if _is_robust(run):
            caption = (
                f"{found.goal.title} of the pair of the highest score so far, its mean over the "
                "worlds of its own generation, against the simulated time of all robots: it may "
                "fall, and begins anew where worlds are drawn first."
            )
        sections.append(Section("The search", sheet.drawn("learning_curve", figure, caption)))
    if found.designs:
        sections.append(_gaits_section(found.designs, sheet, found.goal))
    return sections


def _is_robust(run: FinishedRun) -> bool:
    """Whether candidates walked in several worlds each; not in searches of earlier versions."""
    if "objective" not in run.settings.get("search", {}):
        return False
    return run.structured("search.objective", Objective).is_robust


def _gaits_section(rows: tuple[DesignsBestGait, ...], sheet: Sheet, goal: Goal) -> Section:
    header = [
        "design", "why",
        *map(
            goal.in_unit,
            ("own gait", "gained in the last quarter", "shared policy", "fine-tuned policy"),
        ),
    ]  # fmt: skip
    table = [
        (row.design, row.why, goal.of_pair(row),
         None if row.late_gain_cm is None else goal.of_reward(row.late_gain_cm),
         row.with_policy_and_own(goal)[0],
         row.learned_distance_cm if goal.is_forward else row.learned_achieved)
        for row in rows
    ]  # fmt: skip
    body = page.table(header, table)
    if any(None not in row.with_policy_and_own(goal) for row in rows):
        caption = f"{goal.title} with a gait of its own over that with the shared policy."
        body = sheet.drawn("own_gaits", own_gaits_figure(rows, goal), caption) + body
    return Section("Gaits of each design", body)
