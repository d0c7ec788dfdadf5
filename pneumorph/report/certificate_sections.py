"""Sections of a certificate: bands, what they depend on, finite elements, what to measure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report import page
from pneumorph.report.expert_words import unasked_of_expert
from pneumorph.report.page import Section
from pneumorph.report.sheet import Sheet
from pneumorph.report.style import (
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_axes,
    zero_line,
)
from pneumorph.report.walk_sections import can_be_drawn, replay_section
from pneumorph.study.certified_pairs import Band, Certificate
from pneumorph.study.certified_rounds import CERTIFICATE_FOLDER, nearest_round
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.sensitivity import chance_index
from pneumorph.study.shown_worlds import SHOWN_WORLDS
from pneumorph.study.training_result import TrainingResult
from pneumorph.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN_NUMBERS = 4
"""Most important numbers that are named for each pair."""


@figure_style()
def band_figure(found: Certificate) -> Figure:
    """Return what the expert and each pair achieve in every world, with their bands."""
    labels = ["expert", *(pair.label for pair in found.pairs)]
    bands = [found.expert.band, *(pair.band for pair in found.pairs)]
    figure, axes = new_axes(max(4.2, 1.0 + 0.75 * len(labels)), 3.2)
    places = np.arange(len(labels))
    # A fixed spread across, in the worlds' order: the same picture each time.
    across = places + 0.25 * np.linspace(-1.0, 1.0, found.world_count)[:, None]
    axes.plot(across, np.array(found.achieved), ".", color=NEUTRAL_COLOUR, markersize=3, zorder=1)
    low, high = [band.low for band in bands], [band.high for band in bands]
    axes.vlines(places, low, high, LEARNED_COLOUR, lw=4.0, alpha=0.6, label="80 % of the worlds")
    median = [band.median for band in bands]
    axes.hlines(median, places - 0.3, places + 0.3, LEARNED_COLOUR, lw=2.0, label="median")
    full = [
        (place, each.full)
        for place, pair in enumerate(found.pairs, start=1)
        for each in pair.full_order
        if each.full is not None
    ]
    if full:
        axes.plot(*zip(*full, strict=True), "D", color=INK_COLOUR, ms=5, label="finite elements")
    zero_line(axes)
    axes.set_xticks(places, labels)
    axes.set(ylabel=found.goal.axis)
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return figure


def _title(found: Certificate) -> str:
    return "How far, and how sure" if found.goal.unit == "cm" else "How much it turns, and how sure"


def certificate_sections(
    found: Certificate, run: FinishedRun, sheet: Sheet, walks: Path | None = None
) -> list[Section]:
    """Return the bands, what they depend on, finite elements, and what to measure.

    Args:
        found: The certificate.
        run: The run that it is of.
        sheet: Draws.
        walks: Folder of the walks that it recorded; None for that of the run.
    """
    caption = (
        f"{found.goal.title} in {found.world_count} worlds that training never saw. "
        "The expert's robot has "
        f"the phase of its largest mean in {_tuned_in(found)}, {found.expert.phase_deg:g}°. "
        "After ± are standard errors."
    )
    own_task = unasked_of_expert(run)
    if own_task is not None:
        caption += f" Pairs learned {own_task}, whose reward is known of none of them here."
    sections = [
        Section(
            _title(found),
            sheet.drawn("bands", band_figure(found), caption)
            + _band_table(found, is_compared=own_task is None),
        ),
        *_world_sections(found, run.folder if walks is None else walks, sheet),
        Section(f"What the {found.goal.label} depends on", _sensitivity_table(found)),
        Section("How much of their friction legs use", _friction_table(found)),
    ]
    if found.rounds:
        sections.append(Section("As finite elements", _full_order_table(found)))
    return [*sections, Section("What to measure next", _tests_table(found))]


def _tuned_in(found: Certificate) -> str:
    count = found.expert.tuning_world_count
    if found.expert.tuned_as_drawn:
        return f"{count} other worlds that are drawn alike"
    if all(pair.optimism_error is None for pair in found.pairs):  # of a training in one world
        return f"{count or ''} worlds drawn to choose in".strip()
    return f"{'' if count is None else f'{count} of '}the training's worlds"


def trained_certificate_sections(
    found: TrainingResult, run: FinishedRun, sheet: Sheet
) -> list[Section]:
    """Return the same of a training that was certified at its end."""
    certificate = found.certificate
    if certificate is None:
        return []
    # With finite elements it has a folder of its own.
    walks = run.folder / CERTIFICATE_FOLDER if certificate.rounds else run.folder
    return certificate_sections(certificate, run, sheet, walks)


def _world_sections(found: Certificate, walks_in: Path, sheet: Sheet) -> list[Section]:
    """Return the best pair in its median and in a bad world, side by side."""
    walks = {
        name: Trajectory.load(walks_in / file)
        for name, (file, _) in SHOWN_WORLDS.items()
        if (walks_in / file).is_file()
    }
    drawn = {name: each for name, each in walks.items() if can_be_drawn(each)}
    return (
        [replay_section(f"{found.best} in two worlds", drawn, sheet, found.goal)] if drawn else []
    )


def _band_table(found: Certificate, is_compared: bool = True) -> str:
    unit = found.goal.in_unit
    header = [
        "robot", "design", *map(unit, ("10th percentile", "median", "90th percentile")),
        *["beyond the expert"] * is_compared,
        *map(unit, ("promised", "optimism")), "weight on the hub",
        "worlds in which a leg left its snapshots' range",
    ]  # fmt: skip
    expert = found.expert
    rows = [
        [
            "expert",
            expert.design,
            *_percentiles(expert.band),
            *[""] * (4 + is_compared),
        ]
    ]
    rows += [
        [
            pair.label,
            pair.design,
            *_percentiles(pair.band),
            *[f"{100.0 * pair.share_beyond_expert:.0f} %"] * is_compared,
            *_numbers(pair.promised),
            _with_error(pair.optimism, pair.optimism_error),
            f"{100.0 * pair.hub_load_share:z.0f} %",
            "" if (left := pair.left_range_share) is None else f"{100.0 * left:.0f} %",
        ]
        for pair in found.pairs
    ]
    return page.table(header, rows)


def _percentiles(band: Band) -> tuple[str, ...]:
    """Of a band, each with its standard error."""
    return (
        _with_error(band.low, band.low_error),
        _with_error(band.median, band.median_error),
        _with_error(band.high, band.high_error),
    )


def _friction_table(found: Certificate) -> str:
    rows = [
        [pair.label, leg.location, f"{leg.mean_load_mN:.0f}",
         *(f"{100.0 * share:.0f} %" for share in (leg.used_share, leg.slipping_share,
                                                  leg.at_limit_share, leg.in_air_share))]
        for pair in found.pairs
        for leg in pair.legs
    ]  # fmt: skip
    header = ["robot", "leg", "mean load (mN)", "friction used", "of its load slips",
              "is at the limit", "of the time in the air"]  # fmt: skip
    said = "In the world as it stands. A leg that uses little of its friction keeps its grip on a "
    return page.paragraph(f"{said}smoother floor.") + page.table(header, rows)


def _sensitivity_table(found: Certificate) -> str:
    rows = [
        [pair.label, each.number, f"{100.0 * each.first_order_index:z.0f} %",
         f"{each.rank_correlation:+.2f}"]
        for pair in found.pairs
        for each in pair.sensitivities[:_SHOWN_NUMBERS]
    ]  # fmt: skip
    header = ["robot", "number", "share of the variance", "rank correlation"]
    count = max((len(pair.sensitivities) for pair in found.pairs), default=1)
    chance = chance_index(found.world_count, numbers=max(count, 1))
    said = (
        f"Shares are estimates: of {count} numbers that nothing depends on the largest stays below "
        f"{100.0 * chance:.0f} % in 95 of 100 cases, so small ones may be chance, and together "
        "they may come to more than 100 %."
    )
    return page.paragraph(said) + page.table(header, rows)


def _full_order_table(found: Certificate) -> str:
    rows = [
        [number or "the run's", pair.label, pair.design,
         "as it stands" if each.world is None else f"number {each.world}",
         *_numbers(each.full, each.reduced, each.error),
         "agree" if each.agrees else "differ" if each.repeats else "differ: chaotic",
         " to ".join(_numbers(each.near_low, each.near_high)) if each.near_low is not None else ""]
        for number, leg in enumerate(found.rounds)
        for pair in leg.pairs
        for each in pair.full_order
    ]  # fmt: skip
    header = ["new reductions", "robot", "design", "world",
              *map(found.goal.in_unit, ("finite elements", "reduced", "difference")),
              "they", found.goal.in_unit("reduced, in worlds a thousandth away")]  # fmt: skip
    legs = [
        [number or "the run's", leg.leg.part, leg.leg.mode_count,
         leg.leg.tetrahedron_count, f"{leg.made_s / 60.0:.0f}"]
        for number, leg in enumerate(found.rounds)
    ]  # fmt: skip
    made = ["new reductions", "leg", "modes", "tetrahedra", "minutes, with fine-tuning"]
    number = nearest_round(found.rounds)
    whose = f"new reduction {number}" if number else "the run's own leg"
    said = (
        f"Bands above are of {whose} and its gaits: of these rounds, the nearest. Where a "
        "thousandth of friction, stiffness and mass takes the reduced robot elsewhere its walk is "
        "chaotic, and one walk of either model says little of the next."
    )
    return page.paragraph(said) + page.table(header, rows) + page.table(made, legs)


def _tests_table(found: Certificate) -> str:
    rows = [
        [each.test, each.number, f"{each.minutes:g}", *_numbers(each.width, each.narrowing),
         each.how]
        for each in found.tests
    ]  # fmt: skip
    header = [
        "test",
        "of",
        "minutes",
        *map(found.goal.in_unit, ("width then", "narrower by")),
        "how",
    ]
    by_chance = found.chance_narrowing
    up_to = "" if by_chance is None else f" by up to {found.goal.said(by_chance)}"
    said = (
        f"Of {found.best}'s band, 10th to 90th percentile. By chance alone a test may seem to "
        f"narrow it{up_to}, or to widen it. "
        + (f"Worth most: {found.measure_next}." if found.measure_next else "None does more.")
    )
    return page.paragraph(said) + page.table(header, rows)


def _with_error(value: float | None, error: float | None) -> str:
    if value is None or error is None:
        return _numbers(value)[0]
    return f"{value:.1f} ± {error:.1f}"


def _numbers(*values: float | None) -> list[str]:
    return ["" if value is None else f"{value:.1f}" for value in values]
