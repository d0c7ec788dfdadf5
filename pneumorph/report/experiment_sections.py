"""Sections of experiments around trainings: campaigns of many, and what their robots do."""

from __future__ import annotations

from pneumorph.report import page
from pneumorph.report.page import Section
from pneumorph.report.sheet import Sheet
from pneumorph.study.analysis import Analysis
from pneumorph.study.campaign import Campaign
from pneumorph.study.finished_run import FinishedRun


def campaign_sections(found: Campaign, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return how the runs of a campaign compare, and why some failed."""
    runs = page.table(
        ["run", "best design", "best (cm)", "expert's best phase (cm)", "timesteps"],
        [
            (each.name, each.best_design or "none", each.best_distance_cm,
             each.baseline_best_distance_cm, each.timesteps + each.finetuning_timesteps)
            for each in found.runs
        ],
    )  # fmt: skip
    spread = page.table(
        ["variant", "runs", "mean best (cm)", "least (cm)", "most (cm)"],
        [
            (name, each.run_count, each.mean_best_distance_cm, each.least_best_distance_cm,
             each.most_best_distance_cm)
            for name, each in found.variants.items()
        ],
    )  # fmt: skip
    sections = [Section("Runs", runs), Section("Variants over their seeds", spread)]
    if found.failures:
        failures = page.table(["run", "why it failed"], list(found.failures.items()))
        sections.append(Section("Runs that failed", failures))
    return sections


def analysis_sections(found: Analysis, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return how each robot walked and what bears its weight."""
    header = ["", "design", "how its walk ended", "distance (cm)", "slides back (cm)",
              "weight on the hub"]  # fmt: skip
    rows = [
        (each.label, each.design, each.status, each.distance_cm, each.backsliding_cm,
         each.hub_load_share)
        for each in found.robots
    ]  # fmt: skip
    return [Section("The robots", page.table(header, rows))]
