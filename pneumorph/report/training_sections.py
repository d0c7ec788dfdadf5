"""Sections of learning: phase sweep, training, best pairs, and how they fare when walked again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from pneumorph.base.run_folder import TRAINING_FOLDER
from pneumorph.environment.goal import Goal
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.metrics import DRAWN, HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.physics.regulators import RateLimited
from pneumorph.report import page
from pneumorph.report.expert_words import (
    durations_apart,
    expert_elsewhere,
    unasked_of_expert,
)
from pneumorph.report.learning_figures import (
    AS_IT_STANDS,
    entropy_figure,
    phase_figure,
    reward_figure,
)
from pneumorph.report.page import Section
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.plan import plans_of
from pneumorph.report.robustness_figures import robustness_figure
from pneumorph.report.sheet import Sheet
from pneumorph.study.baseline import BestPhase
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.training_result import LearnedPair, TrainingResult

_DRAWN_PAIRS = 5


def sweep_sections(found: BestPhase, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return the expert's gait at every phase."""
    goal, achieved = found.goal, found.phases_achieved or found.distances_cm
    learned = None
    if isinstance(found, TrainingResult) and found.own_task is None:
        learned = _nominal(found)
    figure = phase_figure(found.phases_deg, achieved, learned, goal)
    caption = f"{found.baseline_design} under two sine waves, the second later by the phase"
    apart = durations_apart(run)
    if apart is not None:
        caption += f"; what it achieves {apart.of_expert}"
        caption += "" if learned is None else f", beside the learned pair {apart.of_pairs}"
    return [
        Section(
            "The expert's gait at every phase", sheet.drawn("phase_sweep", figure, f"{caption}.")
        )
    ]


def _best(found: TrainingResult) -> float | None:
    """What the best pair achieved [the goal's unit]."""
    return found.best_distance_cm if found.goal.is_forward else found.best_achieved


def _nominal(found: TrainingResult) -> float | None:
    """The same in the expert's world; `_best` of runs of earlier versions, which do not know it."""
    walked = found.replayed_distance_cm if found.goal.is_forward else found.replayed_achieved
    return _best(found) if walked is None else walked


def training_sections(found: TrainingResult, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return the rewards over training and the entropy of the design distribution."""
    metrics = read_metrics(run.folder / TRAINING_FOLDER, DRAWN)
    if not metrics:
        return []
    # Those that training saw; the best pairs of a fine-tuned run are later than the last of it.
    seen = (found.seen_pairs or found.pairs)[:_DRAWN_PAIRS]
    labels = _labels(seen, found)
    apart = durations_apart(run)
    of_expert = AS_IT_STANDS if found.randomisation else ""
    if apart is not None:
        of_expert = f"{of_expert}, {apart.of_expert}".removeprefix(", ")
    best = _best(found)
    if found.own_task is not None:
        best = found.pairs[0].score_cm if found.pairs else None
    penalised = "coopt" in run.settings and run.task.reward.takes_off
    rewards = reward_figure(
        metrics,
        HISTOGRAM_EDGES_CM,
        found.best_achieved_by_expert,
        best,
        seen,
        plans_of(run.robot),
        found.goal,
        of_expert,
        labels,
        found.own_task,
        penalised,
    )
    body = page.side_by_side(
        sheet.drawn(
            "training",
            rewards,
            f"{_title_of_rewards(found, penalised)} of each round of episodes. Grey shades: scores "
            "of all "
            "designs, weighted by the design distribution; the last bin holds all beyond it. Dots: "
            f"where training saw its best pairs.{_later(found, labels)}{_beginnings(found)}"
            f"{_rewards(found, penalised)}"
            + ("" if apart is None else f" Robots of a round walk for {apart.pairs_s:.3g} s."),
        ),
        sheet.drawn(
            "entropy",
            entropy_figure(metrics),
            "Entropy of the design distribution and its target: the less, the fewer designs remain"
            + (", from each beginning." if found.restart_scores_cm else "."),
        ),
    )
    return [Section("Training", body)]


def _labels(seen: Sequence[LearnedPair], found: TrainingResult) -> list[str]:
    """What pairs that training saw are called: as among the best pairs, where their designs are;
    empty where they are not."""
    ranks = {pair.design: f"L{rank}" for rank, pair in reversed([*enumerate(found.pairs, start=1)])}
    return [ranks.get(pair.design, "") for pair in seen]


def _later(found: TrainingResult, labels: Sequence[str]) -> str:
    """That fine-tuning came after what the figure shows of its pairs, where it did."""
    later = found.seen_pairs and found.finetuning_timesteps
    said = " The robots beside it are told as they walked then, before fine-tuning."
    return (said if later else "") + (
        "" if all(labels) else " Those without a name are none of the best pairs."
    )


def _title_of_rewards(found: TrainingResult, penalised: bool) -> str:
    if found.own_task is not None:
        return f"Reward of {found.own_task}"
    return "Reward" if penalised else found.goal.title


def _rewards(found: TrainingResult, penalised: bool) -> str:
    """What of the figure is rewards, where these are not the goal alone."""
    if found.own_task is not None:
        return (
            f" What is grey is the reward of {found.own_task} in cm, and the blue line its most "
            "in an episode; numbers beside dots and designs are scores. The expert's is not known."
        )
    if not penalised:
        return ""
    return (
        f" What is grey is rewards; the blue line, the dots and the expert are {found.goal.label}."
    )


def _beginnings(found: TrainingResult) -> str:
    """What came of each of several beginnings."""
    scores = found.restart_scores_cm
    said = ", ".join("none" if score is None else f"{score:.1f}" for score in scores)
    return f" Learning began {len(scores)} times, with best scores of {said} cm." if scores else ""


def learned_pair_sections(found: TrainingResult, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return a training's best pairs with their gaits, beside the baseline."""
    title = "The best pairs" + (f", by {found.ranked_by}" if found.ranked_by else "")
    beside: dict[str, Sequence[object]] = {}
    # A mean over worlds is not compared with the expert's walk in one of them.
    drawn, apart = bool(found.randomisation), durations_apart(run)
    if drawn and found.certificate is not None:
        nominal = {each.design: each.nominal for each in found.certificate.pairs}
        walked = [nominal.get(each.design) for each in found.pairs]
        beside[found.goal.in_unit(AS_IT_STANDS)] = walked
    if found.ranked_by:
        beside["score (cm)"] = [each.score_cm for each in found.pairs]
    return _pair_sections(
        found.pairs,
        run,
        sheet,
        found.goal,
        None if drawn or found.own_task is not None else found,
        title,
        label=f"mean {found.goal.label}, worlds of the training" if drawn else "",
        beside=beside,
        elsewhere="" if apart is None else apart.of_expert,
    )


def evaluation_sections(found: Evaluation, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return an evaluation's distances beside those reported, and its worlds drawn at random."""
    learned, goal = run.source, found.goal
    compared = learned is not None and learned.verb in ("coopt", "demo")  # a search has no baseline
    compared = compared and unasked_of_expert(run) is None
    baseline = learned.result(BestPhase) if learned is not None and compared else None
    apart = durations_apart(run)
    otherwise = [expert_elsewhere(run), "" if apart is None else apart.of_expert]
    rows = [
        (
            f"L{rank}",
            pair.design,
            pair.reported_distance_cm if goal.is_forward else pair.reported_achieved,
            "failed" if (far := goal.of_pair(pair)) is None else far,
        )
        for rank, pair in enumerate(found.pairs, start=1)
    ]
    header = [
        "place in the run",
        "design",
        *map(goal.in_unit, ("reported by the run", f"{found.model} model")),
    ]
    sections = [
        *_pair_sections(
            found.pairs,
            run,
            sheet,
            goal,
            baseline,
            "The best pairs of the run",
            Path(found.run),
            elsewhere=", ".join(filter(None, otherwise)),
        ),
        Section("Walked again", page.table(header, rows)),
    ]
    if found.robustness is not None:
        caption = (
            f"{goal.title} in {found.robustness.world_count} worlds drawn at random: mean, "
            "10th percentile, and the world as it stands."
        )
        share, furthest = found.robustness.left_range_share, found.robustness.range_ratio
        if share:
            caption += (
                f" In {100.0 * share:.0f} % of the walks a leg left the range of its snapshots, up "
                f"to {furthest:.2f} times as far: there the reduced leg extrapolates."
            )
        figure = robustness_figure(found.robustness)
        sections.append(Section("In other worlds", sheet.drawn("robustness", figure, caption)))
    return sections


class _Pair(Protocol):
    """What pairs of trainings, evaluations and searches have in common."""

    @property
    def design(self) -> str: ...

    @property
    def gait(self) -> str | None:
        """File of its gait."""

    @property
    def distance_cm(self) -> float | None: ...

    @property
    def achieved(self) -> float | None: ...


def _pair_sections(
    pairs: Sequence[_Pair],
    run: FinishedRun,
    sheet: Sheet,
    goal: Goal,
    baseline: BestPhase | None = None,
    title: str = "The best pairs",
    gait_folder: Path | None = None,
    label: str = "",
    beside: Mapping[str, Sequence[object]] | None = None,
    elsewhere: str = "",
) -> list[Section]:
    """Sections of the pairs of a run's summary.

    Args:
        pairs: The pairs.
        run: The run.
        sheet: Draws.
        goal: What they were to do.
        baseline: The expert, where they are compared with it.
        title: Of the section.
        gait_folder: Of their gaits; None for the run's own.
        label: Of what they achieved; empty for that of the goal.
        beside: Further columns of their table, by header.
        elsewhere: Where the expert walked, or how long, if that is not as the pairs did: then it
            only stands beside them.
    """
    if not pairs:
        return []
    drawn, missing = [], []
    for rank, pair in enumerate(pairs, start=1):
        place = f"pairs.{rank - 1}"
        path = run.gait_path(place, gait_folder) if pair.gait else None
        if path is not None and path.is_file():
            gait, _ = read_gait(path, maximum_pressure_kPa=float("inf"))
            design = run.design(f"{place}.design", gait.regulator_count)
            drawn.append(Pair(f"L{rank}", design, gait, goal.of_pair(pair), goal))
            continue
        run.design(f"{place}.design")
        missing.append(f"L{rank} (no file is named)" if path is None else f"L{rank} ({path})")
    found = drawn[:_DRAWN_PAIRS]
    body = _pair_table(pairs, baseline, goal, label or goal.label, beside or {}, elsewhere)
    if found:
        physics, plans = run.robot.physics, plans_of(run.robot)
        rate = physics.pressure_rate_kPa_per_s
        if physics.air.law == "rate_limit":
            figure, how = (
                pairs_figure(found, lambda _: RateLimited(rate), plans),
                f"' {rate:g} kPa/s",
            )
        else:
            figure, how = pairs_figure(found, run.spec().regulators, plans), ""
        caption = (
            "Best designs from above, and their gaits: commanded (dashed) and smoothed by the "
            f"regulators{how}."
        )
        robot = run.robot.description
        if robot is not None and robot.letters:
            caption += f" Modules: {robot.letters}."
        body = sheet.drawn("pairs", figure, caption) + body
    if missing:
        told = f"Gaits that are not there, and not drawn: {', '.join(missing)}."
        body += page.paragraph(told, "note")
    return [Section(title, body)]


def searched_pair_sections(found: SearchFindings, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return the best pairs of a search with their gaits."""
    return _pair_sections(found.pairs or (), run, sheet, found.goal)


def _pair_table(
    pairs: Sequence[_Pair],
    baseline: BestPhase | None,
    goal: Goal,
    label: str,
    beside: Mapping[str, Sequence[object]],
    elsewhere: str,
) -> str:
    base = None if baseline is None else baseline.best_achieved_by_expert
    header, rows = ["", "design", goal.in_unit(label)], list[list[object]]()
    compared = baseline is not None and not elsewhere
    if compared:
        header.append(goal.in_unit("over the baseline"))
    if baseline is not None:
        label_of_expert = f"B, {elsewhere}" if elsewhere else "B"
        over = [0.0] if compared else []
        rows.append([label_of_expert, baseline.baseline_design, base, *over, *[None] * len(beside)])
    for rank, pair in enumerate(pairs, start=1):
        far = goal.of_pair(pair)
        row: list[object] = [f"L{rank}", pair.design, "failed" if far is None else far]
        if compared:
            row.append("" if far is None or base is None else far - base)
        rows.append([*row, *(values[rank - 1] for values in beside.values())])
    return page.table([*header, *beside], rows)
