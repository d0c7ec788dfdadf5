"""Figures of learning and search: the expert's sweep, rewards, entropy, learning curves, gaits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.report.plan import PlanOf, paper_plan
from pneumorph.report.plan_view import framed_plan_view
from pneumorph.report.style import (
    BASELINE_COLOUR,
    INK_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_axes,
    new_figure,
    white_between,
    zero_line,
)
from pneumorph.robot.design import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pneumorph.study.search_findings import DesignsBestGait
    from pneumorph.study.training_result import LearnedPair

_MOST_PAIRS = 5
_SECONDS_PER_HOUR = 3600.0


AS_IT_STANDS = "world as it stands"
"""What the expert's phases walk in, and not what robots in drawn worlds do."""


@figure_style()
def phase_figure(
    phases_deg: Sequence[float],
    achieved: Sequence[float],
    learned: float | None = None,
    goal: Goal = FORWARD,
) -> Figure:
    """Return what of a goal is achieved against phase in degrees, the best phase marked (figure
    5d).

    Args:
        phases_deg: Phase shifts.
        achieved: By each [the goal's unit]; NaN where the simulation failed.
        learned: By the best learned gait, drawn as a line to compare with.
        goal: What is achieved.

    Raises:
        ValueError: Lists of different lengths, or no finite distance.
    """
    distances = np.asarray(achieved, dtype=float)
    if len(phases_deg) != len(distances):
        raise ValueError(f"got {len(phases_deg)} phases and {len(distances)} distances")
    if not np.isfinite(distances).any():
        raise ValueError("no phase has a finite distance; every simulation of the sweep failed")
    figure, axes = new_axes()
    axes.plot(
        phases_deg, distances, "o-", color=BASELINE_COLOUR, markersize=4, label="expert's gait"
    )
    number = int(np.nanargmax(distances))
    best = (phases_deg[number], distances[number])
    axes.plot(*best, "o", color=INK_COLOUR, markersize=6)
    axes.annotate(f"{goal.said(best[1])} at {best[0]:g}°", best, xytext=(0, 7),
                  textcoords="offset points", ha="center")  # fmt: skip
    if learned is not None:
        axes.axhline(learned, color=LEARNED_COLOUR, label=f"learned: {goal.said(learned)}")
    zero_line(axes)
    axes.margins(y=0.15)
    axes.set(xlabel="phase shift between the two sine waves (°)", ylabel=goal.axis)
    axes.legend(loc="best")
    return figure


@figure_style()
def reward_figure(
    metrics: Sequence[Mapping[str, Any]],
    histogram_edges_cm: Sequence[float],
    baseline: float | None = None,
    learned: float | None = None,
    pairs: Sequence[LearnedPair] = (),
    plan_of: PlanOf = paper_plan,
    goal: Goal = FORWARD,
    baseline_world: str = "",
    labels: Sequence[str] | None = None,
    own_task: str | None = None,
    penalised: bool = False,
) -> Figure:
    """Return what of a goal is achieved, rewards in its unit, against timesteps (paper, figure 7).

    The shades are the histogram of scores weighted by the design distribution; the lines are the
    mean of each round and the best so far. Of a task of one's own all are its rewards, the best so
    far is an episode and pairs are told by their scores: the expert, who has none, is left out.

    Args:
        metrics: Rounds, as the training's metrics file holds them.
        histogram_edges_cm: Edges of their `score_histogram`.
        baseline: What the expert's best phase achieves [the goal's unit].
        learned: What the best pair does, evaluated after the last round.
        pairs: The best pairs, drawn beside and marked where training saw them; at most five.
        plan_of: What a design looks like from above.
        goal: What is achieved.
        baseline_world: Where the expert walked, if that is not where these rounds did.
        labels: What each pair is called, empty for one that has no name; None for L1, L2, ...
        own_task: What a task of one's own is called, whose rewards are drawn [cm]; None for none.
        penalised: Whether something is taken off the goal in rewards.

    Raises:
        ValueError: No rounds.
    """
    counted = _Counted(goal, own_task)
    timestep = _timesteps(metrics)
    pairs = pairs[:_MOST_PAIRS]
    names = labels or [f"L{rank}" for rank in range(1, len(pairs) + 1)]
    named = list(zip(names, pairs, strict=False))
    figure = new_figure(6.6 if pairs else 5.2, 3.6 if pairs else 3.2)
    axes = _with_plan_views(figure, named, plan_of, counted) if pairs else figure.add_subplot()
    shares = np.array([each["score_histogram"] for each in metrics])
    if shares.shape[1] >= len(histogram_edges_cm):
        raise ValueError(
            f"the metrics' score_histogram has {shares.shape[1]} bins, expected fewer than the "
            f"{len(histogram_edges_cm)} edges; the run was made by a newer pneumorph"
        )
    # Runs of an earlier version end at fewer bins of the same size; the square root shows the thin
    # tail of good designs early in training.
    edges = np.asarray(histogram_edges_cm)[: shares.shape[1] + 1] / counted.cm_per_unit
    axes.pcolormesh(np.concatenate([[0.0], timestep]), edges, np.sqrt(shares.T), cmap="Greys",
                    vmax=1.6, rasterized=True)  # fmt: skip
    if own_task is None:
        best = np.array([best_of_round(each) for each in metrics], dtype=float)
        told, of_mean = "best so far", "mean of the round"
        if penalised:
            told, of_mean = f"{goal.label} of the best so far", "mean reward of the round"
    else:
        best, baseline = best_returns_cm(metrics), None
        told, of_mean = "best episode so far", "mean of the round"
    mean = np.array([each["return_mean_cm"] for each in metrics]) / counted.cm_per_unit
    axes.plot(timestep, best, color=LEARNED_COLOUR, label=told)
    axes.plot(timestep, mean, color=NEUTRAL_COLOUR, label=of_mean)
    _draw_baseline(axes, baseline, goal, baseline_world)
    if learned is not None:
        axes.plot(timestep[-1], learned, "o", color=LEARNED_COLOUR, clip_on=False)
        axes.annotate(counted.said(learned), (timestep[-1], learned), xytext=(0, 5),
                      textcoords="offset points", ha="right", va="bottom")  # fmt: skip
    # The first pair is the end of the blue line.
    for label, pair in named[1:]:
        far = counted.of_pair(pair)
        if pair.timestep is not None and far is not None:
            place = (pair.timestep, far)
            axes.plot(*place, "o", color=INK_COLOUR, markersize=3, clip_on=False)
            axes.annotate(label, place, xytext=(4, -8), textcoords="offset points", size=7,
                          path_effects=white_between())  # fmt: skip
    zero_line(axes)
    highest = max(np.nan_to_num(best).max(), baseline or 0.0, learned or 0.0)
    lowest = min(-3.0, float(histogram_edges_cm[0]) / 2) / counted.cm_per_unit
    axes.set_ylim(lowest, 1.12 * highest + 0.5 / counted.cm_per_unit)
    what = counted.axis
    if penalised and own_task is None:
        what = goal.in_unit(f"reward and {goal.label}")
    axes.set(xlabel="timesteps (actions of all robots)", ylabel=what)
    # The shades of good designs come up to the top.
    figure.legend(loc="outside upper left", ncols=2)
    return figure


@dataclass(frozen=True)
class _Counted:
    """What pairs of a training are told by: the goal, or the score of a task of one's own."""

    goal: Goal
    own_task: str | None

    @property
    def cm_per_unit(self) -> float:
        return self.goal.cm_per_unit if self.own_task is None else 1.0

    @property
    def axis(self) -> str:
        return self.goal.axis if self.own_task is None else f"reward of {self.own_task} (cm)"

    def of_pair(self, pair: LearnedPair) -> float | None:
        return self.goal.of_pair(pair) if self.own_task is None else pair.score_cm

    def said(self, value: float) -> str:
        return self.goal.said(value) if self.own_task is None else said_score(value)


def said_score(score_cm: float) -> str:
    """What pairs are ranked by, for a person."""
    return f"{score_cm:.2f} cm"


def best_returns_cm(metrics: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Most that an episode was rewarded until each round [cm], (round,); NaN before the first."""
    best = np.array([each.get("return_maximum_cm") for each in metrics], dtype=float)
    return np.asarray(np.fmax.accumulate(best))


def best_of_round(metrics: Mapping[str, Any]) -> float | None:
    """What the best pair so far achieved [the goal's unit]; None before the first. Rounds of an
    earlier version know its distance alone."""
    best: float | None = metrics.get("best_achieved", metrics["best_distance_cm"])
    return best


def _with_plan_views(
    figure: Figure, pairs: Sequence[tuple[str, LearnedPair]], plan_of: PlanOf, counted: _Counted
) -> Axes:
    """Draw the pairs' designs in a column at the right and return the axes at the left."""
    columns = figure.add_gridspec(1, 2, width_ratios=(5.2, 1.2))
    views = columns[1].subgridspec(_MOST_PAIRS, 1)
    for row, (label, pair) in enumerate(pairs):
        view = figure.add_subplot(views[row])
        framed_plan_view(view, plan_of(Design.parse(pair.design)))
        far = counted.of_pair(pair)
        said = "failed" if far is None else counted.said(far)
        view.set_title(f"{label}: {said}" if label else said, size=7, loc="center", pad=2)
    return figure.add_subplot(columns[0])


def _timesteps(metrics: Sequence[Mapping[str, Any]]) -> np.ndarray:
    if not metrics:
        raise ValueError("the run has no metrics; its training made no round")
    return np.array([each["timestep"] for each in metrics], dtype=float)


def _draw_baseline(axes: Axes, baseline: float | None, goal: Goal, world: str = "") -> None:
    if baseline is not None:
        where = f", {world}" if world else ""
        label = f"expert's best phase{where}: {goal.said(baseline)}"
        axes.axhline(baseline, color=BASELINE_COLOUR, label=label)


@figure_style()
def entropy_figure(metrics: Sequence[Mapping[str, Any]]) -> Figure:
    """Return the design distribution's entropy and its target in nats against timesteps
    (algorithm 1, line 8).

    Args:
        metrics: Rounds, as the training's metrics file holds them.

    Raises:
        ValueError: No rounds.
    """
    timestep = _timesteps(metrics)
    figure, axes = new_axes()
    target = [each["design_entropy_target"] for each in metrics]
    entropy = [each["design_entropy"] for each in metrics]
    axes.plot(timestep, target, color=NEUTRAL_COLOUR, linewidth=4, alpha=0.5, label="target")
    axes.plot(timestep, entropy, color=LEARNED_COLOUR, label="design distribution")
    axes.set(xlabel="timesteps (actions of all robots)", ylabel="entropy (nats)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right")
    return figure


@figure_style()
def learning_curves_figure(
    curves: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    baseline: float | None = None,
    goal: Goal = FORWARD,
) -> Figure:
    """Return the best so far against the simulated time, a line a method.

    Args:
        curves: Simulated time of all robots [s] and what of a goal the best until then achieved
            [its unit], by label.
        baseline: What the expert's best phase achieves.
        goal: What is achieved.

    Raises:
        ValueError: No curve.
    """
    if not curves:
        raise ValueError("curves is empty, expected at least one method's")
    figure, axes = new_axes(5.6, 3.2)
    colours = [colour for colour in REGULATOR_COLOURS if colour != BASELINE_COLOUR]
    for number, (label, (simulated_s, most)) in enumerate(curves.items()):
        hours = np.asarray(simulated_s, dtype=float) / _SECONDS_PER_HOUR
        best = np.asarray(most, dtype=float)
        axes.plot(hours, best, color=colours[number % len(colours)], label=label)
    _draw_baseline(axes, baseline, goal)
    zero_line(axes)
    axes.set(
        xlabel="simulated time of all robots (h)", ylabel=goal.in_unit(f"best {goal.label} so far")
    )
    axes.set_xlim(left=0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


@figure_style()
def own_gaits_figure(designs: Sequence[DesignsBestGait], goal: Goal = FORWARD) -> Figure:
    """Return what each design achieves with its own searched gait over that with the shared policy.

    Args:
        designs: What a search for gaits found of each.
        goal: What is achieved.

    Raises:
        ValueError: No design has both distances.
    """
    rows = [
        (row.why, (shared, own))
        for row in designs
        for shared, own in (row.with_policy_and_own(goal),)
        if shared is not None and own is not None
    ]
    if not rows:
        raise ValueError("no design has a searched and a learned distance, expected one or more")
    figure, axes = new_axes(4.2, 4.0)
    groups = {"drawn at random": ("o", BASELINE_COLOUR), "expert's design": ("s", INK_COLOUR)}
    for why, place in rows:
        marker, colour = groups.get(why, ("^", LEARNED_COLOUR))
        axes.plot(*place, marker, color=colour, markersize=5)
        if why != "drawn at random":
            axes.annotate(why, place, xytext=(4, 3), textcoords="offset points", fontsize=7)
    places = [place for _, place in rows]
    ends = [np.min(places), np.max(places)]
    axes.margins(0.08)
    axes.plot(ends, ends, color=INK_COLOUR, linewidth=0.7, linestyle=":")
    axes.set(
        xlabel=goal.in_unit("with the shared policy"),
        ylabel=goal.in_unit("with its own searched gait"),
    )
    return figure
