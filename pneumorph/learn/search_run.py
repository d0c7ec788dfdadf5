"""Run a search to the end of its budget of simulated time; a stopped one goes on to the same bits.

Every generation's distances are a line of ``search.jsonl``, before them what they were ranked by
where the reward takes something off, and after them what was achieved where forward is not the
goal. A resumed search is asked and told again what it was before,
without walking: no state of the searcher needs saving.

Where an objective asks for several worlds, all candidates of a generation walk in the same ones,
drawn anew for each generation. Scores are not centred by it, as a training's rounds are: what a
generation is better than the one before would be taken for easy worlds. The best of so few
worlds is often the luckiest: at the end the best walk again, in the worlds of an evaluation. Until
the objective's `nominal_until_timestep` they walk in the nominal world alone, as a training's
designs do; the best from there are half of those that walk again. Where the best gait of each
design is asked for, each design's best of the drawn worlds walks again before any of these.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import read_text, write_text
from pneumorph.base.progress import ProgressReport
from pneumorph.base.settings import differences
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluated_gaits import best_of_each_design, walk_open_loop
from pneumorph.learn.evaluation import evaluation_timesteps
from pneumorph.learn.objective import Objective
from pneumorph.learn.round_scores import RoundLevel
from pneumorph.learn.searcher import Candidates, Searcher
from pneumorph.robot.design_space import DesignSpace

LOG_FILE = "search.jsonl"
CURVE_FILE = "learning_curve.json"  # what a finished search found, for its page
_KEPT_OF_DESIGN = 8
"""Gaits of a design that are kept for an evaluation, where candidates walk in drawn worlds."""
FAILED_CM = -1e3
"""What a search is told of a robot whose simulation failed [cm]: worse than any walk."""


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search found.

    Attributes:
        best: The pair of highest score of each design that walked, by its index; where the
            objective asks for several worlds, of those that walked in an evaluation's.
        timesteps: Actions made until the end of each generation, shape (generation,).
        best_achieved: What of the task's goal the best pair until then achieved [its unit], shape
            (generation,), in the worlds of its generation; NaN before any robot came to the end of
            its walk.
        late_gain_cm: What the last quarter of the budget added to each design's best score [cm],
            by its index: where it is much, the search was too short to call its best the best.
            Scores in the nominal world and in drawn ones are not compared.
        resumed_timesteps: Actions that an earlier process had made.
        finalist_timesteps: Actions of those that walked again in an evaluation's worlds.
    """

    best: Mapping[int, DesignGaitPair]
    timesteps: np.ndarray
    best_achieved: np.ndarray
    late_gain_cm: Mapping[int, float]
    resumed_timesteps: int
    finalist_timesteps: int = 0

    def ranked(self, space: DesignSpace, mirrored: bool = True) -> list[DesignGaitPair]:
        """The pairs, the highest score first; of a design and its mirror image, where these count
        as one, the better."""
        ranked, seen = [], set()
        for pair in sorted(self.best.values(), key=lambda each: -each.score_cm):
            twin = space.twin(pair.design) if mirrored else pair.design
            if twin not in seen:
                seen.add(twin)
                ranked.append(pair)
        return ranked


def run_search(
    searcher: Searcher,
    environment: CrawlingEnvironment,
    space: DesignSpace,
    timesteps: int,
    folder: Path | str,
    *,
    objective: Objective | None = None,
    finalist_count: int = 24,
    every_design: bool = False,
    description: Mapping[str, Any] | None = None,
    progress: ProgressReport | None = None,
) -> SearchResult:
    """Ask, walk and tell until the budget is used.

    Args:
        searcher: Fresh; proposes candidates.
        environment: Where they walk; its designs are replaced.
        space: The design space.
        timesteps: Actions of all robots together, without those of the walks at the end; the last
            generation may exceed them.
        folder: Receives ``search.jsonl``; a search that is there already goes on.
        objective: What counts where candidates walk in several worlds; None for one world. Its
            `centring_rounds` have no effect, but on a search that an earlier version began.
        finalist_count: How many pairs then walk in the worlds of an evaluation: the best of each
            design, the second ones and so on, until there are so many.
        every_design: Whether each design that walked has the best of its gaits among these, however
            many come from the nominal world.
        description: What a resumed search must have in common with its beginning; JSON values.
        progress: Told (timesteps done, timesteps in all, message).

    Raises:
        ValueError: The folder holds a search of another description, or one whose generations do
            not fit.
    """
    objective = objective or Objective()
    path = Path(folder) / LOG_FILE
    header, *known = _read_or_begin(path, json.loads(json.dumps(description or {})))
    # Those that an earlier version began say nothing of it.
    is_centred = header.get("centred", objective.centring_rounds > 0)
    level = RoundLevel(objective.centring_rounds if is_centred else 0)
    task = environment.task
    goal = task.goal
    kept_of_design = _KEPT_OF_DESIGN if objective.is_robust else 1
    found: dict[int, list[DesignGaitPair]] = {}
    earlier_cm: dict[int, float] = {}
    nominal: dict[int, list[DesignGaitPair]] = {}
    reached: list[tuple[int, float]] = []
    done, resumed, most = 0, 0, np.nan
    now = _objective_at(objective, done)
    with path.open("a", encoding="utf-8") as stream:
        while done < timesteps:
            if now is not objective and _objective_at(objective, done) is objective:
                now, nominal, found, most = objective, found, {}, np.nan
                earlier_cm = {}  # scores of another measure
                searcher.begin_in_other_worlds()
            walks_each = task.action_count * now.worlds_per_design
            candidates = searcher.ask()
            if known:
                kept = np.atleast_2d(np.array(known.pop(0), dtype=float))
                score_cm, distance_cm, achieved = kept[0], kept[min(1, len(kept) - 1)], kept[-1]
                if len(distance_cm) != len(candidates):
                    raise ValueError(
                        f"{path} has a generation of {len(distance_cm)} distances, expected "
                        f"{len(candidates)}; it was made by another version of this search"
                    )
                resumed += len(candidates) * walks_each
            else:
                far = "" if np.isnan(most) else f", best {goal.said(most)}"
                # The last generation may exceed what was asked for.
                whole = max(timesteps, done + len(candidates) * walks_each)

                def report(
                    made: int, before: int = done, whole: int = whole, far: str = far
                ) -> None:
                    if progress is not None:
                        progress(before + made, whole, f"searching{far}")

                report(0)  # before the walk: the time left counts from the first that is made now
                seed = done if objective.is_robust else None
                walked = _walked(candidates, environment, space, now, seed, report)
                score_cm, distance_cm, achieved = walked
                same = goal.is_forward and np.array_equal(score_cm, distance_cm)
                rows = walked[: 2 if goal.is_forward else 3].tolist()
                stream.write(json.dumps(rows[0] if same else rows) + "\n")
                stream.flush()
            ended = score_cm > FAILED_CM
            if now is objective:
                score_cm = np.where(ended, level.centred(score_cm, ended), FAILED_CM)
            searcher.tell(score_cm)
            done += len(candidates) * walks_each
            told = (score_cm, distance_cm, achieved)
            _note(candidates, told, environment, done, found, kept_of_design)
            if done <= 0.75 * timesteps:
                earlier_cm = {design: pairs[0].score_cm for design, pairs in found.items()}
            if found:
                most = max(
                    (pairs[0] for pairs in found.values()), key=lambda pair: pair.score_cm
                ).achieved
            reached.append((done, most))
    if progress is not None:
        progress(done, done, "searching")
    curve = np.array(reached).reshape(-1, 2)
    late_gain_cm = {
        design: pairs[0].score_cm - earlier_cm[design]
        for design, pairs in found.items()
        if design in earlier_cm
    }
    best = {design: pairs[0] for design, pairs in found.items()}
    again = 0
    if objective.is_robust:
        pairs = _finalists(nominal, found, finalist_count, every_design)
        best = best_of_each_design(pairs, environment, space, objective, progress)
        again = evaluation_timesteps(len(pairs), objective, task)
    return SearchResult(best, curve[:, 0].astype(int), curve[:, 1], late_gain_cm, resumed, again)


def _objective_at(objective: Objective, timestep: int) -> Objective:
    """What counts of a generation: itself, or in the nominal world the one walk there."""
    worlds = objective.worlds_at(timestep)
    if worlds == objective.worlds_per_design:
        return objective
    return replace(objective, worlds_per_design=worlds)


def _walked(
    candidates: Candidates,
    environment: CrawlingEnvironment,
    space: DesignSpace,
    objective: Objective,
    seed: int | None,
    report: Callable[[int], None],
) -> np.ndarray:
    """Score and distance of every candidate [cm], and what it achieved, (3, candidate), in batches
    for which the environment has room; the seed draws the worlds, and told are the actions that
    all robots have made."""
    count = environment.num_envs // objective.worlds_per_design
    found = []
    for begin in range(0, len(candidates), count):
        batch = slice(begin, begin + count)
        design, action = candidates.design[batch], candidates.action[batch]

        def step(made: int, begin: int = begin, count: int = len(design)) -> None:
            actions = begin * environment.task.action_count + count * made
            report(actions * objective.worlds_per_design)

        walked = walk_open_loop(environment, space, design, action, objective, [seed], step)
        means = (each.mean(axis=1) for each in (walked.distance_cm, walked.achieved))
        far = np.stack([objective.of(walked.return_cm), *means])
        found.append(np.where(walked.failed.all(axis=1), FAILED_CM, far))
    return np.concatenate(found, axis=1)


def _note(
    candidates: Candidates,
    told: tuple[np.ndarray, np.ndarray, np.ndarray],
    environment: CrawlingEnvironment,
    timestep: int,
    found: dict[int, list[DesignGaitPair]],
    count: int,
) -> None:
    """Keep the gaits of highest score of each design, so many; told are score, distance and what
    was achieved, each (candidate,)."""
    score_cm, distance_cm, achieved = told
    for place, design in enumerate(candidates.design):
        score = float(score_cm[place])
        known = found.setdefault(int(design), []) if score > FAILED_CM else []
        if score > FAILED_CM and (len(known) < count or score > known[-1].score_cm):
            held_kPa = environment.task.pressure_kPa(candidates.action[place])
            pair = DesignGaitPair(
                int(design),
                held_kPa,
                float(distance_cm[place]),
                score,
                "search",
                timestep,
                float(achieved[place]),
            )
            # Of equals the first that was found stays ahead.
            known.append(pair)
            known.sort(key=lambda each: -each.score_cm)
            del known[count:]


def _finalists(
    nominal: Mapping[int, Sequence[DesignGaitPair]],
    found: Mapping[int, Sequence[DesignGaitPair]],
    count: int,
    every_design: bool,
) -> list[DesignGaitPair]:
    """The pairs that walk once more: half of them from the nominal world, where there are as many;
    half of the others where each design has its first.

    Args:
        nominal: The best of each design there, the best first.
        found: The same in drawn worlds.
        count: How many are wanted.
        every_design: Whether the first of every design in drawn worlds are among them, and of one
            that never came to an end there its first of the nominal world.
    """
    first: list[DesignGaitPair] = []
    if every_design:
        first = [pairs[0] for pairs in {**nominal, **found}.values()]
    known = set(map(id, first))

    def others(of: Mapping[int, Sequence[DesignGaitPair]]) -> list[DesignGaitPair]:
        return [pair for pair in _ranked(of) if id(pair) not in known]

    room = max(0, count - len(first))
    of_nominal = others(nominal)[: room // 2]
    return [*first, *of_nominal, *others(found)[: room - len(of_nominal)]]


def _ranked(found: Mapping[int, Sequence[DesignGaitPair]]) -> list[DesignGaitPair]:
    """The best of each design, the second ones and so on, by score among themselves."""
    ranked = [(rank, pair) for pairs in found.values() for rank, pair in enumerate(pairs)]
    ranked.sort(key=lambda each: (each[0], -each[1].score_cm))
    return [pair for _, pair in ranked]


def _read_or_begin(path: Path, description: dict[str, Any]) -> list[Any]:
    """What the search is, and distances of the generations that were walked; a last line that was
    cut short is dropped."""
    if not path.exists():
        header = {"description": description, "centred": False}
        write_text(path, json.dumps(header) + "\n")
        return [header]
    lines = []
    for text in read_text(path, "search").splitlines():
        try:
            lines.append(json.loads(text))
        except json.JSONDecodeError:
            break
    theirs = lines[0] if lines and isinstance(lines[0], dict) else {}
    if theirs.get("description") != description:
        apart = differences(theirs.get("description", {}), description)
        changed = "; ".join(
            f"{name} {before!r:.80}, now {now!r:.80}" for name, before, now in apart
        )
        raise ValueError(
            f"{path} holds a search with other settings ({changed or 'its first line is damaged'}),"
            " expected the same; search with the settings of its folder's settings.json, or choose "
            "another folder"
        )
    whole = "".join(json.dumps(line) + "\n" for line in lines)
    write_text(path, whole)
    return lines
