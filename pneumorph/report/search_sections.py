"""Sections of searches without a policy: learning curve, gaits of each design."""

from __future__ import annotations

import json

from pneumorph.report import page
from pneumorph.report.page import Section
from pneumorph.report.run import Run
from pneumorph.report.search_figure import learning_curves_figure, own_gaits_figure
from pneumorph.report.sheet import Sheet


def search_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return what `pneumorph search` found."""
    if run.summary["verb"] != "search":
        return []
    sections = []
    curve = json.loads((run.folder / "learning_curve.json").read_text())
    if any(best is not None for best in curve["best_distance_cm"]):
        label = str(run.summary["method"])
        figure = learning_curves_figure({label: (curve["simulated_s"], curve["best_distance_cm"])})
        caption = "Best distance so far against the simulated time of all robots."
        sections.append(Section("The search", sheet.drawn("learning_curve", figure, caption)))
    rows = run.summary.get("designs") or []
    if rows:
        columns = {
            "design": "design",
            "why": "why",
            "own gait (cm)": "distance_cm",
            "gained in the last quarter (cm)": "late_gain_cm",
            "shared policy (cm)": "policy_distance_cm",
            "fine-tuned policy (cm)": "learned_distance_cm",
        }
        body = page.table(list(columns), [[r.get(c) for c in columns.values()] for r in rows])
        if any(None not in (r["distance_cm"], r["policy_distance_cm"]) for r in rows):
            caption = "Distance with a gait of its own over that with the shared policy."
            body = sheet.drawn("own_gaits", own_gaits_figure(rows), caption) + body
        sections.append(Section("Gaits of each design", body))
    return sections
