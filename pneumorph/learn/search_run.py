"""Run a search to the end of its budget of simulated time; a stopped one goes on to the same bits.

Every generation's distances are a line of ``search.jsonl``, beside them what they were ranked by
where the reward takes something off. A resumed search is asked and told again what it was before,
without walking: no state of the searcher needs saving.
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
        best: The pair of highest score of each design that walked, by its index.
        timesteps: Actions made until the end of each generation, shape (generation,).
        best_distance_cm: Distance of the best pair until then [cm], shape (generation,); NaN before
            any robot came to the end of its walk.
        late_gain_cm: What the last quarter of the budget added to each design's best score [cm],
            by its index: where it is much, the search was too short to call its best the best.
        resumed_timesteps: Actions that an earlier process had made.
    """

    best: Mapping[int, DesignGaitPair]
    timesteps: np.ndarray
    best_distance_cm: np.ndarray
    late_gain_cm: Mapping[int, float]
    resumed_timesteps: int

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
                kept = np.array(known.pop(0), dtype=float)
                score_cm, distance_cm = np.broadcast_to(kept, (2, kept.shape[-1]))
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
                score_cm, distance_cm = _walked(candidates, environment, space)
                same = np.array_equal(score_cm, distance_cm)
                line = distance_cm.tolist() if same else [score_cm.tolist(), distance_cm.tolist()]
                stream.write(json.dumps(line) + "\n")
                stream.flush()
            searcher.tell(score_cm)
            done += len(candidates) * task.action_count
            _note(candidates, score_cm, distance_cm, environment, done, best)
            if done <= 0.75 * timesteps:
                earlier_cm = {design: pair.score_cm for design, pair in best.items()}
            if best:
                furthest = max(best.values(), key=lambda pair: pair.score_cm).distance_cm
            reached.append((done, furthest))
    if progress is not None:
        progress(timesteps, timesteps, "searching")
    curve = np.array(reached).reshape(-1, 2)
    late_gain_cm = {
        design: pair.score_cm - earlier_cm[design]
        for design, pair in best.items()
        if design in earlier_cm
    }
    return SearchResult(best, curve[:, 0].astype(int), curve[:, 1], late_gain_cm, resumed)


def _walked(
    candidates: Candidates, environment: CrawlingEnvironment, space: DesignSpace
) -> np.ndarray:
    """Return and distance of every candidate [cm], (2, candidate), in batches of the environment's
    size."""
    count = environment.num_envs
    found = []
    for begin in range(0, len(candidates), count):
        rows = filled_batch(np.arange(begin, min(begin + count, len(candidates))), count)
        actions = iter(np.moveaxis(candidates.action[rows], 1, 0))
        walked = walk_episode(
            environment,
            space,
            candidates.design[rows],
            lambda _, actions=actions: next(actions),  # type: ignore[misc]
        )
        found.append(np.where(walked.failed, FAILED_CM, [walked.return_cm, walked.distance_cm]))
    return np.concatenate(found, axis=1)[:, : len(candidates)]


def _note(
    candidates: Candidates,
    score_cm: np.ndarray,
    distance_cm: np.ndarray,
    environment: CrawlingEnvironment,
    timestep: int,
    best: dict[int, DesignGaitPair],
) -> None:
    """Keep the gait of highest score of each design."""
    for place, design in enumerate(candidates.design):
        score = float(score_cm[place])
        known = best.get(int(design))
        if score > FAILED_CM and (known is None or score > known.score_cm):
            held_kPa = environment.task.pressure_kPa(candidates.action[place])
            best[int(design)] = DesignGaitPair(
                int(design), held_kPa, float(distance_cm[place]), score, "search", timestep
            )


def _read_or_begin(path: Path, header: dict[str, Any]) -> list[list[Any]]:
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
