"""Sections of learning: phase sweep, training, best pairs, and how they fare when walked again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pneumorph.coopt.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.phase_sweep import PhaseSweep
from pneumorph.report import page
from pneumorph.report.entropy_figure import entropy_figure
from pneumorph.report.page import Section
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.phase_figure import phase_figure
from pneumorph.report.reward_figure import reward_figure
from pneumorph.report.robustness_figure import robustness_figure
from pneumorph.report.run import Run
from pneumorph.report.sheet import Sheet
from pneumorph.robot.design import Design
from pneumorph.simulation.simulation_settings import SimulationSettings

_DRAWN_PAIRS = 5


def sweep_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return the expert's gait at every phase."""
    if not (run.folder / "phase_sweep.npz").exists():
        return []
    sweep = PhaseSweep.load(run.folder / "phase_sweep.npz")
    figure = phase_figure(
        sweep.phase_deg.tolist(), sweep.distance_cm.tolist(), run.summary.get("best_distance_cm")
    )
    design = run.summary.get("baseline_design", "the expert's design")
    caption = f"{design} under two sine waves, the hind legs later by the phase."
    return [
        Section("The expert's gait at every phase", sheet.drawn("phase_sweep", figure, caption))
    ]


def training_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return the rewards over training and the entropy of the design distribution."""
    metrics = read_metrics(run.folder / "training")
    if not metrics:
        return []
    # Those that training saw; the best pairs of a fine-tuned run are later than the last of it.
    seen = run.summary.get("seen_pairs") or run.summary.get("pairs") or []
    rewards = reward_figure(
        metrics,
        HISTOGRAM_EDGES_CM,
        run.summary.get("baseline_best_distance_cm"),
        run.summary.get("best_distance_cm"),
        seen[:_DRAWN_PAIRS],
    )
    body = page.side_by_side(
        sheet.drawn(
            "training",
            rewards,
            "Distance of each round of episodes. Grey shades: scores of all designs, weighted by "
            "the design distribution; the last bin holds all beyond it. Dots: where training saw "
            "its best pairs.",
        ),
        sheet.drawn(
            "entropy",
            entropy_figure(metrics),
            "The design distribution narrows as its entropy follows the target.",
        ),
    )
    return [Section("Training", body)]


def pair_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return the best pairs with their gaits, beside the baseline."""
    pairs = [pair for pair in run.summary.get("pairs") or [] if pair.get("gait")]
    if not pairs:
        return []
    source = run.folder if (run.folder / pairs[0]["gait"]).exists() else run.summary.get("run")
    drawn = [_pair(rank, pair, source) for rank, pair in enumerate(pairs[:_DRAWN_PAIRS], start=1)]
    found = [pair for pair in drawn if pair is not None]
    rate = _rate_kPa_per_s(run)
    body = page.table(["", "design", "distance (cm)", "over the baseline (cm)"], _rows(run, pairs))
    if found:
        body = (
            sheet.drawn(
                "pairs",
                pairs_figure(found, rate),
                f"Best designs from above, and their gaits: commanded (dashed) and smoothed by the "
                f"regulators' {rate:g} kPa/s.",
            )
            + body
        )
    return [Section("The best pairs", body)]


def _pair(rank: int, pair: dict[str, Any], source: Any) -> Pair | None:
    path = Path(str(source)) / pair["gait"]
    if not path.exists():
        return None
    gait, _ = read_gait(path, maximum_pressure_kPa=float("inf"))
    return Pair(f"L{rank}", Design.parse(pair["design"]), gait, pair["distance_cm"])


def _rate_kPa_per_s(run: Run) -> float:
    simulation = run.settings.get("robot", {}).get("simulation", {})
    usual = SimulationSettings().pressure_rate_kPa_per_s
    return float(simulation.get("pressure_rate_kPa_per_s", usual))


def _rows(run: Run, pairs: list[dict[str, Any]]) -> list[tuple[Any, ...]]:
    known = {**run.source, **run.summary}
    baseline = known.get("baseline_best_distance_cm")
    rows: list[tuple[Any, ...]] = []
    if baseline is not None:
        rows.append(("B", known.get("baseline_design", ""), baseline, 0.0))
    for rank, pair in enumerate(pairs, start=1):
        far = pair["distance_cm"]
        more = "" if far is None or baseline is None else far - baseline
        rows.append((f"L{rank}", pair["design"], "failed" if far is None else far, more))
    return rows


def evaluation_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return an evaluation's distances beside those reported, and its worlds drawn at random."""
    pairs = run.summary.get("pairs") or []
    if not pairs or "reported_distance_cm" not in pairs[0]:
        return []
    rows = [
        (
            f"L{rank}",
            pair["design"],
            pair["reported_distance_cm"],
            "failed" if pair["distance_cm"] is None else pair["distance_cm"],
        )
        for rank, pair in enumerate(pairs, start=1)
    ]
    header = ["", "design", "reported by the run (cm)", f"{run.summary['model']} model (cm)"]
    sections = [Section("Walked again", page.table(header, rows))]
    worlds = run.folder / "robustness.json"
    if worlds.exists():
        found = json.loads(worlds.read_text())
        figure = robustness_figure(found)
        caption = (
            f"Distances in {found['world_count']} worlds drawn at random: mean, 10th percentile, "
            "and the world as it stands."
        )
        sections.append(Section("In other worlds", sheet.drawn("robustness", figure, caption)))
    return sections
