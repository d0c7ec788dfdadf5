"""Figures of the real robot: trials on a rig, simulation beside them, and what was fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.physics.pressure import PressureMap
from pneumorph.report.plan import HALF_WIDTH_MM, PlanOf, paper_plan
from pneumorph.report.plan_view import draw_plan_view
from pneumorph.report.style import (
    BASELINE_COLOUR,
    FIGURE_FILES,
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    legend_above,
    legend_beside,
    new_axes,
    new_figure,
    regulator_colour,
    save_figure,
    zero_line,
)
from pneumorph.robot.design import Design
from pneumorph.study.fitted_calibration import CalibrationStudy
from pneumorph.study.recorded_trajectories import remove_earlier
from pneumorph.study.transfer import TransferStudy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.hardware.deployment_log import LoggedPressures
    from pneumorph.hardware.marker_track import MarkerTrack
    from pneumorph.hardware.trial import Trial
    from pneumorph.hardware.trial_comparison import TrialComparison

_SIMULATED = LEARNED_COLOUR
_MEASURED = BASELINE_COLOUR


@figure_style()
def trials_figure(
    logs: Sequence[LoggedPressures], tracks: Mapping[str, MarkerTrack] | None = None
) -> Figure:
    """Return pressures over time, a panel a channel, and below the travel where it was tracked.

    Args:
        logs: Log of each trial, with at least one sample.
        tracks: Track of each trial that has one, by its name.

    Raises:
        ValueError: No log.
    """
    if not logs:
        raise ValueError("logs is empty, expected that of at least one trial")
    channels = logs[0].commanded_kPa.shape[1]
    heights = [1.0] * channels + ([2.0] if tracks else [])
    figure = new_figure(5.2, 0.8 + 0.85 * sum(heights))
    panels = figure.subplots(
        len(heights), 1, sharex=True, squeeze=False, height_ratios=heights
    )[:, 0]  # fmt: skip
    _draw_channels(panels[:channels], logs, labelled=True)
    for number, (name, track) in enumerate((tracks or {}).items()):
        colour = REGULATOR_COLOURS[number % len(REGULATOR_COLOURS)]
        panels[-1].plot(track.time_s, track.forward_cm(track.time_s), color=colour, linewidth=1.1,
                        label=name)  # fmt: skip
    if tracks:
        zero_line(panels[-1])
        panels[-1].set_ylabel("forward distance (cm)")
        legend_beside(panels[-1])
    panels[-1].set_xlabel("time (s)")
    return figure


def _draw_channels(panels: np.ndarray, logs: Sequence[LoggedPressures], labelled: bool) -> None:
    """Draw what each channel was commanded and what was sensed in every trial, the first boldly."""
    for index, axes in enumerate(panels):
        colour = regulator_colour(index + 1)
        axes.step(logs[0].time_s, logs[0].commanded_kPa[:, index], where="post", color=INK_COLOUR,
                  linewidth=0.8, linestyle=(0, (3, 2)), label="commanded")  # fmt: skip
        for number, log in enumerate(logs):
            label, alpha = ("sensed", 1.0) if number == 0 else (None, 0.25)
            axes.plot(log.time_s, log.sensed_kPa[:, index], color=colour, linewidth=1.2,
                      alpha=alpha, label=label)  # fmt: skip
        axes.set_yticks([0, 45, 90])
        if labelled:
            axes.set_ylabel(f"p{index + 1} (kPa)", color=colour)
    if labelled:
        legend_above(panels[0])


@figure_style()
def transfer_rewards_figure(
    comparisons: Sequence[TrialComparison], plan_of: PlanOf = paper_plan
) -> Figure:
    """Return what every robot achieves, simulated and measured with its spread (paper, fig. 6).

    Args:
        comparisons: The robots, in the order to draw.
        plan_of: What their designs look like.
    """
    count = len(comparisons)
    figure = new_figure(max(3.6, 0.8 + 1.0 * count), 3.6)
    above, axes = figure.subplots(2, 1, height_ratios=(1, 2.6), sharex=True)
    place = np.arange(count)
    counted = [each.counted for each in comparisons]
    simulated = [each.simulated_end for each in counted]
    measured = [each.mean for each in counted]
    spread = [each.spread or 0.0 for each in counted]
    axes.bar(place - 0.2, simulated, 0.36, color=_SIMULATED, label="simulation")
    axes.bar(place + 0.2, measured, 0.36, yerr=spread, color=_MEASURED, ecolor=INK_COLOUR,
             capsize=3, label="measured")  # fmt: skip
    for number, each in enumerate(comparisons):
        dots = np.full(len(each.counted.ends), number + 0.2)
        axes.plot(dots, each.counted.ends, ".", color=INK_COLOUR, markersize=3)
    above.axis("off")
    zero_line(axes)
    axes.set_xticks(place, [each.label for each in comparisons])
    axes.set(xlim=(-0.6, count - 0.4), ylabel=counted[0].goal.axis)
    figure.legend(loc="outside lower center", ncols=2)
    # Designs stand over their bars: an equal aspect would narrow the upper axes alone, so their
    # height is counted in steps between robots instead, once the figure is laid out.
    figure.draw_without_rendering()
    box = above.get_window_extent()
    height = float(np.diff(above.get_xlim())[0] * box.height / box.width)
    above.set_ylim(-0.5 * height, 0.5 * height)
    for number, each in enumerate(comparisons):
        plan = plan_of(Design.parse(each.design))
        size = 0.45 * min(1.0, height) / max(HALF_WIDTH_MM, plan.half_width_mm)
        draw_plan_view(above, plan, (number, 0.0), size_mm=size)
    return figure


@figure_style()
def transfer_gaits_figure(
    comparisons: Sequence[TrialComparison], trials: Sequence[Sequence[Trial]]
) -> Figure:
    """Return pressures and what is achieved over time, one column a robot (paper, figs. 8 to 10).

    Args:
        comparisons: The robots.
        trials: Trials of each.
    """
    regulators = max(Design.parse(each.design).highest_regulator for each in comparisons)
    columns = len(comparisons)
    same_count = len({len(own) for own in trials}) == 1
    figure = new_figure(max(4.2, 2.9 * columns), 1.0 + 0.8 * regulators + 2.0)
    panels = figure.subplots(
        regulators + 1, columns, sharex=True, sharey="row", squeeze=False,
        height_ratios=[1.0] * regulators + [2.4],
    )  # fmt: skip
    for column, (comparison, own) in enumerate(zip(comparisons, trials, strict=True)):
        pressures = [trial.pressures for trial in own]
        _draw_channels(panels[:regulators, column], pressures, labelled=column == 0)
        axes, counted = panels[-1, column], comparison.counted
        time_s, mean = counted.time_s, counted.measured.mean(axis=0)
        simulated = axes.plot(time_s, counted.simulated, color=_SIMULATED, label="simulation")
        if len(counted.measured) > 1:
            spread = counted.measured.std(axis=0, ddof=1)
            axes.fill_between(time_s, mean - spread, mean + spread, color=_MEASURED, alpha=0.3,
                              linewidth=0)  # fmt: skip
        label = f"measured, {len(own)} trial{'s' if len(own) > 1 else ''}"
        (measured,) = axes.plot(time_s, mean, color=_MEASURED, label=label)
        if column == 0 or not same_count:
            # What simulations are drawn in is told once, how many trials there were of each.
            axes.legend(
                handles=[*simulated, measured] if column == 0 else [measured], loc="lower left",
                bbox_to_anchor=(0.0, 0.98), ncols=2, fontsize=7, borderaxespad=0.1,
            )  # fmt: skip
        zero_line(axes)
        axes.set_xlabel("time (s)")
        panels[0, column].set_title(f"{comparison.label}: {comparison.design}", pad=16)
    panels[-1, 0].set_ylabel(comparisons[0].counted.goal.axis)
    return figure


@figure_style()
def calibration_figure(
    real_kPa: np.ndarray, simulated_kPa: np.ndarray, fitted: PressureMap, r_squared: float
) -> Figure:
    """Return real and simulated pressures of equal bend with their line (paper, figure 11).

    Args:
        real_kPa: Real pressures [kPa], (pair,).
        simulated_kPa: Simulated pressures of equal bend [kPa], (pair,).
        fitted: The line.
        r_squared: Share of the variance that it explains.
    """
    figure, axes = new_axes(4.2, 3.2)
    reach = np.linspace(0.0, 1.05 * float(real_kPa.max()), 100)
    axes.plot(reach, PressureMap().simulated(reach), color=NEUTRAL_COLOUR, label="published line")
    sign = "+" if fitted.intercept_kPa >= 0.0 else "-"
    label = f"{fitted.slope:.3f} p {sign} {abs(fitted.intercept_kPa):.2f} kPa, R² {r_squared:.4f}"
    axes.plot(reach, fitted.simulated(reach), color=LEARNED_COLOUR, label=label)
    axes.plot(real_kPa, simulated_kPa, "o", color=LEARNED_COLOUR, markersize=4)
    axes.set(xlabel="real pressure p (kPa)", ylabel="simulated pressure of equal bend (kPa)")
    axes.legend(loc="upper left")
    return figure


@figure_style()
def path_fit_figure(
    measured_s: np.ndarray,
    measured_mm: np.ndarray,
    simulated_s: np.ndarray,
    start_mm: np.ndarray,
    fitted_mm: np.ndarray,
    r_squared: float,
) -> Figure:
    """Return forward and sideways travel over time, before and after parameters were fitted.

    Args:
        measured_s: Times of the track [s], (sample,).
        measured_mm: Its positions [mm], (sample, 2).
        simulated_s: Times of the simulations [s], (step,).
        start_mm: Path with the parameters that the fit began with [mm], (step, 2).
        fitted_mm: Path with the fitted ones [mm], (step, 2).
        r_squared: Share of the variance that the fit explains.
    """
    figure = new_figure(5.2, 4.2)
    panels = figure.subplots(2, 1, sharex=True)
    for time_s, path, colour, label in (
        (measured_s, measured_mm, NEUTRAL_COLOUR, "measured"),
        (simulated_s, start_mm, BASELINE_COLOUR, "simulated before the fit"),
        (simulated_s, fitted_mm, LEARNED_COLOUR, f"fitted, R² {r_squared:.4f}"),
    ):
        for axes, travel in zip(panels, (path - path[0]).T, strict=True):
            axes.plot(time_s, travel, color=colour, label=label)
    panels[0].set(ylabel="forward (mm)")
    panels[0].legend(loc="best")
    panels[1].set(xlabel="time (s)", ylabel="sideways (mm)")
    return figure


@figure_style()
def air_fit_figure(log: LoggedPressures, fitted_kPa: np.ndarray, rms_kPa: float) -> Figure:
    """Return commanded, sensed and fitted pressures over time, a panel a channel.

    Args:
        log: What was commanded and sensed.
        fitted_kPa: Pressures of the fitted valves at the log's samples [kPa], (sample, channel).
        rms_kPa: Root mean square of what the fit leaves [kPa].
    """
    channels = fitted_kPa.shape[1]
    figure = new_figure(5.2, 0.8 + 1.1 * channels)
    panels = figure.subplots(channels, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    _draw_channels(panels, [log], labelled=True)
    for axes, fitted in zip(panels, fitted_kPa.T, strict=True):
        axes.plot(log.time_s, fitted, color=INK_COLOUR, linewidth=0.7, label="fitted")
    legend_above(panels[0])
    panels[0].set_title(f"{rms_kPa:.2f} kPa left", size=8)
    panels[-1].set_xlabel("time (s)")
    return figure


def save_calibration_figures(study: CalibrationStudy, folder: Path) -> None:
    """Draw ``calibration.png``, ``air_fit.png`` and ``path_fit.png``, where there is such a fit;
    those of an earlier calibration in the folder are removed."""
    for name in ("calibration", "air_fit", "path_fit"):
        remove_earlier(folder, *(f"{name}.{suffix}" for suffix in FIGURE_FILES))
    fit = study.found.fit
    if study.filled is not None:
        log, fitted_kPa = study.filled
        figure = air_fit_figure(log, fitted_kPa, fit["air"]["rms_kPa"])
        save_figure(figure, folder / "air_fit.png")
    if study.pairs is not None:
        fitted = PressureMap(study.found.slope, study.found.intercept_kPa)
        figure = calibration_figure(
            study.pairs.real_kPa, study.pairs.simulated_kPa, fitted, fit["pressure"]["r_squared"]
        )
        save_figure(figure, folder / "calibration.png")
    if study.path is not None:
        path = study.path
        figure = path_fit_figure(
            path.track.time_s,
            path.track.position_mm,
            path.time_s,
            path.start_mm,
            path.fitted_mm,
            fit["trajectories"]["r_squared"],
        )
        save_figure(figure, folder / "path_fit.png")


def save_transfer_figures(
    study: TransferStudy, folder: Path, plan_of: PlanOf = paper_plan
) -> list[Path]:
    """Draw ``transfer_rewards`` and ``transfer_gaits`` and return their files."""
    rewards = transfer_rewards_figure(study.comparisons, plan_of)
    gaits = transfer_gaits_figure(study.comparisons, study.trials)
    return [
        *save_figure(rewards, folder / "transfer_rewards.png"),
        *save_figure(gaits, folder / "transfer_gaits.png"),
    ]
