"""The report page of a run of any verb: what was asked, what came out, and how to repeat it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pneumorph.report import page
from pneumorph.report.hardware_sections import calibration_sections, trial_sections
from pneumorph.report.making_sections import making_sections
from pneumorph.report.page import Section
from pneumorph.report.reduction_sections import comparison_sections, leg_sections
from pneumorph.report.repeat_section import repeat_section
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.run import Run
from pneumorph.report.search_sections import search_sections
from pneumorph.report.sheet import Sheet
from pneumorph.report.training_sections import (
    evaluation_sections,
    pair_sections,
    sweep_sections,
    training_sections,
)
from pneumorph.report.walk_sections import walk_sections

_TITLES = {
    "mesh": ("A mesh with named regions", "Nodes, tetrahedra and regions, checked."),
    "reduce": ("A reduced part", "Modes and sampled elements, with their measured errors."),
    "compare": ("Reduced beside full", "Modes beside the finite elements they stand for."),
    "simulate": ("A robot walks", "One design under one gait."),
    "baseline": ("The expert's gait", "The expert's design under its gait at every phase."),
    "coopt": ("A robot learned to crawl", "Design and gait learned together, beside the expert's."),
    "demo": ("A robot learned to crawl", "Design and gait learned together, beside the expert's."),
    "campaign": ("Many trainings", "How seeds and settings compare."),
    "search": ("Searched designs and gaits", "Without a policy, to judge the learned ones."),
    "analyse": ("What learned robots do", "Steps, tilt, loads and friction of the best pairs."),
    "evaluate": ("Learned pairs, walked again", "The best pairs of a training, simulated anew."),
    "bench": ("Speed of this machine", "How fast robots are simulated."),
    "calibrate": ("The simulation, fitted", "Parameters fitted to what was measured."),
    "deploy": ("Trials on a rig", "A gait driven through regulators, and what they sensed."),
    "transfer": ("From simulation to reality", "Trials beside the simulation."),
    "fabricate": ("A robot to build", "Moulds, hub, parts and tubes of a design."),
    "exchange": ("A file of another program", "What was read and what was written."),
}  # fmt: skip

_HEADLINE = {
    "best_distance_cm": ("distance of the best pair", "{:.1f} cm"),
    "baseline_best_distance_cm": ("expert's best phase", "{:.1f} cm"),
    "baseline_best_phase_deg": ("the expert's best phase", "{:.0f}°"),
    "distance_cm": ("distance", "{:.1f} cm"),
    "mean_distance_cm": ("measured distance", "{:.1f} cm"),
    "simulated_distance_cm": ("simulated distance", "{:.1f} cm"),
    "transfer_ratio": ("measured over simulated", "{:.2f}"),
    "best_design": ("best design", "{}"),
    "design": ("design", "{}"),
    "animations_mean_node_error_mm": ("mean node error", "{:.2f} mm"),
    "bend_error_percent": ("bend error", "{:.1f} %"),
    "time_ratio": ("times as fast as the full model", "{:.0f}"),
    "mode_count": ("modes", "{}"),
    "tetrahedron_count": ("tetrahedra", "{:,}"),
    "env_steps_per_s": ("robot steps per second", "{:,.0f}"),
    "slope": ("simulated kPa per real kPa", "{:.4f}"),
    "intercept_kPa": ("intercept", "{:.2f} kPa"),
    "silicone_g": ("silicone", "{:.0f} g"),
    "status": ("status", "{}"),
    "wall_s": ("time taken", "{:.0f} s"),
}
"""Numbers that a reader wants first: key of the summary -> its name and how it is written."""


_SHOWN_ELSEWHERE = (
    "bend", "calibration", "drawing", "node_error", "path_fit", "transfer_gaits",
    "transfer_rewards",
)  # fmt: skip
"""How the names of pictures end that other sections show."""


@dataclass(frozen=True)
class WrittenPage:
    """A page and the figures beside it."""

    path: Path
    figures: tuple[Path, ...]


def write_run_page(run: Run, path: Path, replay: ReplaySettings | None = None) -> WrittenPage:
    """Write the page of a run.

    Args:
        run: The run.
        path: The HTML file; figures are written beside it.
        replay: How exact replays are.
    """
    sheet = Sheet(path.parent, replay)
    sections: list[Section] = [
        *walk_sections(run, sheet),
        *trial_sections(run, sheet),
        *calibration_sections(run),
        *sweep_sections(run, sheet),
        *training_sections(run, sheet),
        *pair_sections(run, sheet),
        *evaluation_sections(run, sheet),
        *search_sections(run, sheet),
        *comparison_sections(run, sheet),
        *making_sections(run, sheet),
        *_picture_sections(run),
        _results_section(run),
        *leg_sections(run, sheet),
        repeat_section(run),
    ]
    verb = str(run.summary["verb"])
    title, lead = _TITLES.get(verb, (f"pneumorph {verb}", ""))
    page.write_page(path, title, f"{lead} {_where(run)}", _headline(run), sections, sheet.head)
    return WrittenPage(path, tuple(sheet.files))


def _where(run: Run) -> str:
    damping = run.summary.get("damping")
    return f"Run folder {run.folder}" + (f", {damping} damping." if damping else ".")


def _headline(run: Run) -> str:
    baseline = {key: value for key, value in run.source.items() if key.startswith("baseline_best")}
    known = {**baseline, **run.summary}
    return page.numbers(
        {
            name: pattern.format(known[key])
            for key, (name, pattern) in _HEADLINE.items()
            if known.get(key) is not None
        }
    )


def _picture_sections(run: Run) -> list[Section]:
    """Return the figures that the verb itself saved and no other section shows."""
    pictures = [
        page.picture(path, path.stem.replace("_", " "))
        for path in sorted(run.folder.glob("*.png"))
        if not path.stem.endswith(_SHOWN_ELSEWHERE)
    ]
    return [Section("Figures", page.side_by_side(*pictures))] if pictures else []


def _results_section(run: Run) -> Section:
    plain = [
        (name.replace("_", " "), value)
        for name, value in run.summary.items()
        if isinstance(value, str | int | float) and not isinstance(value, bool)
    ]
    notes = "".join(page.paragraph(note, "note") for note in run.summary.get("notes", []))
    return Section("Results", page.table(["what", "value"], plain) + notes)
