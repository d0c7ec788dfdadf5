"""The page of a training: returns, entropy against its target, best designs, the best one crawling.

The page is drawn by a script from a snapshot in JSON, so that a running training can send it anew.
"""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.learn.metrics import HISTOGRAM_EDGES_CM
from pneumorph.report import page
from pneumorph.report.learning_figures import (
    best_of_round,
    best_returns_cm,
    entropy_figure,
    reward_figure,
    said_score,
)
from pneumorph.report.plan import PlanOf, paper_plan
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.replay.page import player_script, replay_assets, script_json
from pneumorph.report.replay.replay_data import replay_data

if TYPE_CHECKING:
    from pneumorph.learn.snapshot import TrainingSnapshot
    from pneumorph.report.scene import Actor
    from pneumorph.robot.design_space import DesignSpace

SHOWN_DESIGNS = 5


def training_view_data(
    snapshot: TrainingSnapshot,
    space: DesignSpace,
    best: Actor | None,
    baseline: float | None = None,
    plan_of: PlanOf = paper_plan,
    goal: Goal = FORWARD,
    baseline_world: str = "",
    where: str = "",
    of_pairs: str = "",
    own_task: str | None = None,
    penalised: bool = False,
) -> dict[str, Any]:
    """Return what the page shows, as JSON values.

    Args:
        snapshot: The training.
        space: Its designs.
        best: The best robot crawling; None before the first checkpoint.
        baseline: What the expert's best phase achieves [the goal's unit], where it is known.
        plan_of: What a design looks like from above.
        goal: What is achieved.
        baseline_world: Where the expert walked, if that is not where the robots learn.
        where: The robots walk, in a sentence.
        of_pairs: What the best pairs' numbers are, where they are not of one walk.
        own_task: What a task of one's own is called; None for none.
        penalised: Whether something is taken off the goal in rewards.
    """
    task = "" if own_task is None else f"Robots learn the task {own_task}, whose rewards these are."
    return {
        "status": " ".join(filter(None, (_status(snapshot), task, where))),
        "numbers": page.numbers(_headline(snapshot, goal, of_pairs, own_task, penalised)),
        "figures": _figures(snapshot, baseline, goal, baseline_world, own_task, penalised),
        "designs": _designs(snapshot, space, plan_of, goal, of_pairs, own_task),
        "replay": None if best is None else replay_data([best]),
    }


def training_view_page(title: str, data: dict[str, Any] | None) -> str:
    """Return the page.

    Args:
        title: Its heading.
        data: What `training_view_data` returned, for a page that stands alone; None for one that
            is told by server-sent events.
    """
    begin = "listen()" if data is None else f"show({script_json(data)})"
    body = f"""<main><h1>{html.escape(title)}</h1>
<p class="lead" id="status">Waiting for the training ...</p><div id="numbers"></div>
<div class="row" id="figures"></div>
<h2>The best designs so far</h2><div class="tiles" id="designs"></div>
<h2>The best robot</h2><div id="replay"></div>
</main><script>
{player_script("training.js")}
pneumorphTraining.{begin};</script>"""
    return page.document(title, page.page_style() + replay_assets(), body)


def _status(snapshot: TrainingSnapshot) -> str:
    made = f"{snapshot.timestep:,} of {snapshot.timesteps:,} timesteps"
    if snapshot.is_finished:
        return f"Finished: {made}."
    if not snapshot.metrics:
        return f"No round yet: {made}."
    return f"Training: {made}; the last round was written {snapshot.last_round_s_ago:.0f} s ago."


def _headline(
    snapshot: TrainingSnapshot,
    goal: Goal,
    of_pairs: str = "",
    own_task: str | None = None,
    penalised: bool = False,
) -> dict[str, str]:
    if not snapshot.metrics:
        return {}
    last = snapshot.metrics[-1]
    if own_task is not None:
        label, most = f"best episode, reward of {own_task}", best_returns_cm(snapshot.metrics)[-1]
        if snapshot.pairs:
            label, most = f"best score, reward of {own_task}", snapshot.pairs[0].score_cm
        told = {
            label: said_score(most) if np.isfinite(most) else "none yet",
            "mean reward of the last round": said_score(last["return_mean_cm"]),
        }
    else:
        best, mean = best_of_round(last), goal.of_reward(last["return_mean_cm"])
        label = f"best {goal.label}"
        if best is None and snapshot.pairs:  # of robots in drawn worlds they are known at the end
            best = snapshot.pairs[0].achieved
            label += f", {of_pairs}" if of_pairs else ""
        told = {
            label: "none yet" if best is None else goal.said(best),
            f"mean {'reward ' if penalised else ''}of the last round": goal.said(mean),
        }
    return {
        **told,
        "entropy of the designs": f"{last['design_entropy']:.2f}",
        "its target": f"{last['design_entropy_target']:.2f}",
    }


def _figures(
    snapshot: TrainingSnapshot,
    baseline: float | None,
    goal: Goal,
    baseline_world: str,
    own_task: str | None,
    penalised: bool,
) -> str:
    if not snapshot.metrics:
        return ""
    title = f"Reward of {own_task}" if own_task else "Reward" if penalised else goal.title
    return page.drawn(
        reward_figure(
            snapshot.metrics,
            HISTOGRAM_EDGES_CM,
            baseline,
            goal=goal,
            baseline_world=baseline_world,
            own_task=own_task,
            penalised=penalised,
        ),
        f"{title} of each round of episodes. Grey shades: scores of all designs, weighted by "
        "the design distribution.",
    ) + page.drawn(
        entropy_figure(snapshot.metrics),
        "Entropy of the design distribution and its target: the less, the fewer designs are left.",
    )


def _designs(
    snapshot: TrainingSnapshot,
    space: DesignSpace,
    plan_of: PlanOf,
    goal: Goal,
    of_pairs: str,
    own_task: str | None,
) -> str:
    if not snapshot.pairs:
        return page.paragraph(
            "They come with the first checkpoint, of robots in drawn worlds at the end.", "note"
        )
    return "".join(
        page.drawn(
            plan_view_figure(plan_of(space[pair.design])),
            f"{space[pair.design]}, "
            + (
                f"score {said_score(pair.score_cm)}"
                if own_task is not None
                else ", ".join(filter(None, (goal.said(pair.achieved), of_pairs)))
            ),
        )
        for pair in snapshot.pairs[:SHOWN_DESIGNS]
    )
