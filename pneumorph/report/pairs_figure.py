"""The best designs with their gaits, a column each: the designs of figure 6 of the paper over the
commanded and smoothed pressures of its figures 8 and 10."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.physics.open_loop_gait import OpenLoopGait, sample_commands
from pneumorph.physics.regulators import Regulators
from pneumorph.report.plan import PlanOf, paper_plan
from pneumorph.report.plan_view import framed_plan_view
from pneumorph.report.style import figure_style, new_figure, regulator_colour
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STEP_S = 0.02
_USUAL_KPA = 90.0
"""What the highest pressure of the paper's gaits is."""


@dataclass(frozen=True)
class Pair:
    """A design and the gait it walks.

    Attributes:
        label: Such as L1.
        design: The design.
        gait: Its gait.
        achieved: What of the goal [its unit]; None where it failed or was not walked.
        goal: What is achieved.
    """

    label: str
    design: Design
    gait: OpenLoopGait
    achieved: float | None
    goal: Goal = FORWARD


@figure_style()
def pairs_figure(
    pairs: Sequence[Pair],
    regulators_of: Callable[[Design], Regulators],
    plan_of: PlanOf = paper_plan,
) -> Figure:
    """Return each design from above, and below it its pressures over time, a panel a regulator.

    Args:
        pairs: In the order to draw.
        regulators_of: The regulators of a design, which smooth what is commanded.
        plan_of: What a design looks like from above.

    Raises:
        ValueError: No pairs.
    """
    if not pairs:
        raise ValueError("pairs is empty, expected at least one design with its gait")
    regulators = max(pair.design.highest_regulator for pair in pairs)
    figure = new_figure(max(3.0, 0.5 + 1.35 * len(pairs)), 1.6 + 0.75 * regulators)
    panels = figure.subplots(
        regulators + 1, len(pairs), squeeze=False, height_ratios=[1.7] + [1.0] * regulators
    )
    courses = [_pressures(pair.gait, regulators_of(pair.design)) for pair in pairs]
    shown = [
        values[:, : pair.design.highest_regulator].max(initial=_USUAL_KPA)
        for pair, (_, *both) in zip(pairs, courses, strict=True)
        for values in both
    ]
    highest = float(max(shown))
    margin, tick = 4.0 / _USUAL_KPA * highest, 10.0 * (highest // 10.0)
    for column, (pair, (time_s, commanded, smoothed)) in enumerate(
        zip(pairs, courses, strict=True)
    ):
        above = panels[0, column]
        framed_plan_view(above, plan_of(pair.design), number_size=6.5)
        far = "" if pair.achieved is None else f": {pair.goal.said(pair.achieved)}"
        above.set_title(f"{pair.label}{far}\n{pair.design}", size=8, loc="center")
        for index in range(regulators):
            axes = panels[index + 1, column]
            colour = regulator_colour(index + 1)
            if index + 1 > pair.design.highest_regulator:
                axes.axis("off")
                continue
            axes.plot(time_s, commanded[:, index], color=colour, linewidth=0.7, linestyle="--")
            axes.plot(time_s, smoothed[:, index], color=colour, linewidth=1.2)
            axes.set(
                ylim=(-margin, highest + margin), yticks=[0, tick / 2, tick], xlim=(0, time_s[-1])
            )
            axes.tick_params(labelleft=column == 0)
            last = index + 1 == pair.design.highest_regulator
            axes.tick_params(labelbottom=last)
            if last:
                axes.set_xlabel("time (s)")
            if column == 0:
                axes.set_ylabel(f"p{index + 1} (kPa)", color=colour)
    return figure


def _pressures(
    gait: OpenLoopGait, regulators: Regulators
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, commanded and smoothed pressures of a gait that starts at rest."""
    commanded = sample_commands(gait, _STEP_S, round(gait.duration_s / _STEP_S))
    smoothed, now = [], np.zeros(gait.regulator_count)
    for command in commanded:
        now = regulators.after(now, command, _STEP_S)
        smoothed.append(now)
    return _STEP_S * np.arange(1, len(commanded) + 1), commanded, np.array(smoothed)
