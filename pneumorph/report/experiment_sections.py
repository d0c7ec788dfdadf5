"""Sections of experiments around trainings: campaigns of many, and what their robots do."""

from __future__ import annotations

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.report import page
from pneumorph.report.learning_figures import AS_IT_STANDS
from pneumorph.report.page import Section
from pneumorph.report.physics_words import MEAN_OVER_WORLDS
from pneumorph.report.sheet import Sheet
from pneumorph.study.analysis import Analysis
from pneumorph.study.campaign import Campaign
from pneumorph.study.finished_run import FinishedRun


def campaign_sections(found: Campaign, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return how the runs of a campaign compare, and why some failed."""
    goal = found.runs[0].goal if found.runs else FORWARD
    alike = all(each.goal.label == goal.label for each in found.runs)
    named = goal.in_unit if alike else str

    def shown(value: float | None, own: Goal) -> float | str | None:
        """With its unit where goals differ, as the column then has none."""
        return value if alike or value is None else own.said(value)

    scored = any(each.ranked_by for each in found.runs)
    in_worlds = {each.in_drawn_worlds for each in found.runs}
    over = {True: f", {MEAN_OVER_WORLDS}", False: ""}
    # A column says it, or where runs differ each row.
    best = "best" + (over[True] if in_worlds == {True} else "")
    expert = "expert's best phase" + (f", {AS_IT_STANDS}" if True in in_worlds else "")
    apart = len(in_worlds) > 1
    runs = page.table(
        ["run", "best design", *["score (cm)"][:scored], *map(named, (best, expert)), "timesteps"],
        [
            (each.name + (over[each.in_drawn_worlds] if apart else ""),
             each.best_design or "none", *[each.score_cm][:scored],
             shown(each.counted, each.goal),
             shown(each.baseline_best_distance_cm if each.goal.is_forward
                   else each.baseline_best_achieved, each.goal),
             each.timesteps + each.finetuning_timesteps)
            for each in found.runs
        ],
    )  # fmt: skip
    ranked = {each.ranked_by for each in found.runs}
    title = f"Runs, by {ranked.pop()}" if scored and len(ranked) == 1 else "Runs"
    spread = page.table(
        ["variant", "runs", *map(named, (f"mean {best}", "least", "most"))],
        [
            (name, each.run_count, *(shown(value, each.goal) for value in
             (each.mean_best, each.least_best, each.most_best)))
            for name, each in found.variants.items()
        ],
    )  # fmt: skip
    sections = [Section(title, runs), Section("Variants over their seeds", spread)]
    if found.failures:
        failures = page.table(["run", "why it failed"], list(found.failures.items()))
        sections.append(Section("Runs that failed", failures))
    return sections


def analysis_sections(found: Analysis, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return how each robot walked and what bears its weight."""
    goal = found.goal
    header = ["", "design", "how its walk ended",
              *map(goal.in_unit, (goal.label, "slides back")), "weight on the hub"]  # fmt: skip
    rows = [
        (each.label, each.design, each.status, goal.of_pair(each), each.backsliding,
         f"{100.0 * each.hub_load_share:z.0f} %")
        for each in found.robots
    ]  # fmt: skip
    return [Section("The robots", page.table(header, rows))]
