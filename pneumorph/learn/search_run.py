"""Run a search to the end of its budget of simulated time; a stopped one goes on to the same bits.

Every generation's distances are a line of ``search.jsonl``. A resumed search is asked and told
again what it was before, without walking: no state of the searcher needs saving.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import read_text, write_atomically
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.gait.walk import Progress
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.evaluation import filled_batch, walk_episode
from pneumorph.learn.searcher import Candidates, Searcher
from pneumorph.robot.design_space import DesignSpace

LOG_FILE = "search.jsonl"
CURVE_FILE = "learning_curve.json"  # what a finished search found, for its page
FAILED_CM = -1e3
"""What a search is told of a robot whose simulation failed [cm]: worse than any walk."""


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search found.

    Attributes:
        best: The furthest pair of each design that walked, by its index.
        timesteps: Actions made until the end of each generation, shape (generation,).
        best_distance_cm: Furthest distance until then [cm], shape (generation,); NaN before any
            robot came to the end of its walk.
        late_gain_cm: What the last quarter of the budget added to each design's best [cm], by its
            index: where it is much, the search was too short to call its best the best there is.
        resumed_timesteps: Actions that an earlier process had made.
    """

    best: Mapping[int, DesignGaitPair]
    timesteps: np.ndarray
    best_distance_cm: np.ndarray
    late_gain_cm: Mapping[int, float]
    resumed_timesteps: int

    def ranked(self, space: DesignSpace) -> list[DesignGaitPair]:
        """The pairs, the furthest first; a design and its mirror image count as one."""
        ranked, seen = [], set()
        for pair in sorted(self.best.values(), key=lambda each: -each.distance_cm):
            twin = min(pair.design, int(space.mirror_index[pair.design]))
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
    description: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """Ask, walk and tell until the budget is used.

    Args:
        searcher: Fresh; proposes candidates.
        environment: Where they walk; its designs are replaced.
        space: The design space.
        timesteps: Actions of all robots together; the last generation may exceed them.
        folder: Receives ``search.jsonl``; a search that is there already goes on.
        description: What a resumed search must have in common with its beginning; JSON values.
        progress: Told (timesteps done, timesteps in all, message).

    Raises:
        ValueError: The folder holds a search of another description, or one whose generations do
            not fit.
    """
    path = Path(folder) / LOG_FILE
    header = {"description": json.loads(json.dumps(description or {}))}
    known = _read_or_begin(path, header)
    task = environment.task
    best: dict[int, DesignGaitPair] = {}
    earlier_cm: dict[int, float] = {}
    reached: list[tuple[int, float]] = []
    done, resumed, furthest = 0, 0, np.nan
    with path.open("a", encoding="utf-8") as stream:
        while done < timesteps:
            candidates = searcher.ask()
            if known:
                distance_cm = np.array(known.pop(0), dtype=float)
                if len(distance_cm) != len(candidates):
                    raise ValueError(
                        f"{path} has a generation of {len(distance_cm)} distances, expected "
                        f"{len(candidates)}; it was made by another version of this search"
                    )
                resumed += len(candidates) * task.action_count
            else:
                if progress is not None:
                    # Before the walk: the time left counts from the first that is made now.
                    far = "" if np.isnan(furthest) else f", best {furthest:.1f} cm"
                    progress(done, timesteps, f"searching{far}")
                distance_cm = _walked(candidates, environment, space)
                stream.write(json.dumps(distance_cm.tolist()) + "\n")
                stream.flush()
            searcher.tell(distance_cm)
            done += len(candidates) * task.action_count
            _note(candidates, distance_cm, environment, done, best)
            if done <= 0.75 * timesteps:
                earlier_cm = {design: pair.distance_cm for design, pair in best.items()}
            furthest = max((pair.distance_cm for pair in best.values()), default=np.nan)
            reached.append((done, furthest))
    if progress is not None:
        progress(timesteps, timesteps, "searching")
    curve = np.array(reached).reshape(-1, 2)
    late_gain_cm = {
        design: pair.distance_cm - earlier_cm[design]
        for design, pair in best.items()
        if design in earlier_cm
    }
    return SearchResult(best, curve[:, 0].astype(int), curve[:, 1], late_gain_cm, resumed)


def _walked(
    candidates: Candidates, environment: CrawlingEnvironment, space: DesignSpace
) -> np.ndarray:
    """Distance of every candidate [cm], in batches of the environment's size."""
    count = environment.num_envs
    distances = []
    for begin in range(0, len(candidates), count):
        rows = filled_batch(np.arange(begin, min(begin + count, len(candidates))), count)
        actions = iter(np.moveaxis(candidates.action[rows], 1, 0))
        _, distance_cm, failed = walk_episode(
            environment,
            space,
            candidates.design[rows],
            lambda _, actions=actions: next(actions),  # type: ignore[misc]
        )
        distances.append(np.where(failed, FAILED_CM, distance_cm))
    return np.concatenate(distances)[: len(candidates)]


def _note(
    candidates: Candidates,
    distance_cm: np.ndarray,
    environment: CrawlingEnvironment,
    timestep: int,
    best: dict[int, DesignGaitPair],
) -> None:
    """Keep the furthest gait of each design."""
    for place, design in enumerate(candidates.design):
        distance = float(distance_cm[place])
        known = best.get(int(design))
        if distance > FAILED_CM and (known is None or distance > known.distance_cm):
            held_kPa = environment.task.pressure_kPa(candidates.action[place])
            best[int(design)] = DesignGaitPair(int(design), held_kPa, distance, "search", timestep)


def _read_or_begin(path: Path, header: dict[str, Any]) -> list[list[float]]:
    """Distances of the generations that were walked; a last line that was cut short is dropped."""
    if not path.exists():
        write_atomically(path, lambda stream: stream.write((json.dumps(header) + "\n").encode()))
        return []
    lines = []
    for text in read_text(path, "search").splitlines():
        try:
            lines.append(json.loads(text))
        except json.JSONDecodeError:
            break
    if not lines or lines[0] != header:
        raise ValueError(
            f"{path} holds a search with other settings, expected those of this one; choose "
            "another folder"
        )
    whole = "".join(json.dumps(line) + "\n" for line in lines)
    write_atomically(path, lambda stream: stream.write(whole.encode()))
    return lines[1:]
