"""Greedy choice of snapshots: simulate in full where the reduction at hand is worst.

Each round reduces the part from the snapshots so far, asks an error indicator for every candidate
motion, and ends when the worst of the held-out candidates meets the tolerance. Otherwise the worst
training candidates are simulated by the full model and their states join the snapshots. Held-out
candidates are never simulated nor learned from (weak greedy algorithm; Prud'homme et al. 2002,
Binev et al. 2011).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from pneumorph.artefact import ArtefactError, write_json
from pneumorph.executor import ExecutorSettings, run_tasks
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshot_files import SnapshotFiles, read_header
from pneumorph.reduction.snapshots import Snapshots

Candidate = TypeVar("Candidate")
Shared = TypeVar("Shared")
Report = TypeVar("Report")
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class GreedySettings:
    """How long the search goes on."""

    round_limit: int = 0
    """Rounds that may add snapshots; 0 leaves the greedy search out."""
    tolerance: float = 0.03
    """Largest indicator over the held-out candidates at which the search ends."""
    additions_per_round: int = 2
    """Worst candidates that are simulated in each round."""

    def __post_init__(self) -> None:
        if self.round_limit < 0 or self.additions_per_round < 1 or not self.tolerance > 0.0:
            raise ValueError(
                "a greedy search needs round_limit of at least 0, additions_per_round of at least "
                f"1 and a positive tolerance, got {self.round_limit}, {self.additions_per_round} "
                f"and {self.tolerance}"
            )


@dataclass(frozen=True)
class GreedyRound:
    """What one round found."""

    snapshot_count: int
    training_worst: float
    """Largest indicator over the training candidates."""
    heldout_worst: float
    """The same over the held-out ones."""
    heldout_mean: float
    chosen: tuple[str, ...]
    """Candidates that were simulated then; empty in the last round."""


@dataclass(frozen=True)
class GreedyProblem(Generic[Shared, Candidate]):
    """What the search calls; the two functions run in workers and must be picklable."""

    shared: Shared
    """What both functions read, beside the reduced part."""
    indicator: Callable[[tuple[Shared, ReducedPart], Candidate], float]
    """Error indicator of a candidate's motion with a reduced part."""
    simulate: Callable[[Shared, Candidate], Snapshots | CompressedSnapshots]
    """Snapshots of a candidate by the full model."""
    training: Sequence[Candidate]
    """What may be simulated."""
    heldout: Sequence[Candidate]
    """What the tolerance is checked on."""
    identity: dict[str, Any] = field(default_factory=dict)
    """What simulations depend on beside their candidate, such as materials; JSON-serialisable."""


@dataclass(frozen=True, eq=False)
class GreedyResult(Generic[Report]):
    """How the search went."""

    files: tuple[Path, ...]
    """Snapshot files, those at the start among them."""
    rounds: tuple[GreedyRound, ...]
    converged: bool
    """Whether the held-out candidates meet the tolerance."""
    part: ReducedPart
    """The reduction of all files."""
    report: Report
    """Of that reduction."""


def greedy_reduction(
    problem: GreedyProblem[Shared, Candidate],
    reduce: Callable[[SnapshotFiles], tuple[ReducedPart, Report]],
    files: Sequence[Path],
    settings: GreedySettings,
    folder: Path,
    executor: ExecutorSettings | None = None,
    progress: Progress | None = None,
) -> GreedyResult[Report]:
    """Reduce a part, adding snapshots where it is worst.

    Simulated candidates are kept in ``folder``, named by their content; a search that was stopped
    finds them there, and makes the same choices again.

    Args:
        problem: Candidates, indicator and full model.
        reduce: Makes a reduced part of snapshots, and its report.
        files: Snapshots to begin with.
        settings: When to stop.
        folder: Where new snapshots and ``greedy.json``, the history, go.
        executor: Where indicators and simulations are computed.
        progress: Called with done, total and a message.

    Raises:
        ValueError: No held-out candidate.
    """
    if not problem.heldout:
        raise ValueError("heldout must name at least one candidate, got none")
    executor = executor or ExecutorSettings(process_count=1)
    paths, rounds = list(files), list[GreedyRound]()
    left = list(range(len(problem.training)))
    while True:
        part, report = reduce(SnapshotFiles(paths))
        heldout = _indicators(problem, part, problem.heldout, executor, progress)
        training = _indicators(problem, part, problem.training, executor, progress)
        converged = max(heldout) <= settings.tolerance
        last = converged or len(rounds) == settings.round_limit or not left
        left.sort(key=lambda number: -training[number])
        chosen = [] if last else left[: settings.additions_per_round]
        rounds.append(
            GreedyRound(
                snapshot_count=len(SnapshotFiles(paths)),
                training_worst=max(training, default=0.0),
                heldout_worst=max(heldout),
                heldout_mean=sum(heldout) / len(heldout),
                chosen=tuple(str(problem.training[number]) for number in chosen),
            )
        )
        write_json(folder / "greedy.json", {"rounds": [_as_json(each) for each in rounds]})
        if last:
            return GreedyResult(tuple(paths), tuple(rounds), converged, part, report)
        paths += _simulated(problem, part, chosen, folder, executor, progress)
        left = left[len(chosen) :]


def _as_json(found: GreedyRound) -> dict[str, Any]:
    """JSON has no infinity: an indicator of a motion that diverged becomes null."""
    return {name: None if value == math.inf else value for name, value in asdict(found).items()}


def _indicators(
    problem: GreedyProblem[Shared, Candidate],
    part: ReducedPart,
    candidates: Sequence[Candidate],
    executor: ExecutorSettings,
    progress: Progress | None,
) -> list[float]:
    values = [0.0] * len(candidates)
    tasks = run_tasks(problem.indicator, (problem.shared, part), candidates, executor)
    for done, (number, value) in enumerate(tasks, 1):
        values[number] = value
        if progress:
            progress(done, len(candidates), "error indicators")
    return values


def _simulated(
    problem: GreedyProblem[Shared, Candidate],
    part: ReducedPart,
    chosen: Sequence[int],
    folder: Path,
    executor: ExecutorSettings,
    progress: Progress | None,
) -> list[Path]:
    """Files of candidates, made where they are not there yet."""
    paths, missing = [], list[tuple[Path, Candidate]]()
    identity = json.loads(json.dumps(problem.identity))  # as a file gives it back
    for number in chosen:
        name = hashlib.sha256(str(problem.training[number]).encode()).hexdigest()[:16]
        paths.append(folder / f"greedy_{name}.npz")
        origin = {"candidate": str(problem.training[number]), "identity": identity}
        if not _is_there(paths[-1], origin, part):
            missing.append((paths[-1], problem.training[number]))
    tasks = [candidate for _, candidate in missing]
    if progress:
        progress(0, max(len(tasks), 1), "full model of the worst")
    simulations = run_tasks(problem.simulate, problem.shared, tasks, executor)
    for done, (number, snapshots) in enumerate(simulations, 1):
        path, candidate = missing[number]
        snapshots.metadata.update(candidate=str(candidate), identity=identity)
        snapshots.save(path)
        if progress:
            progress(done, len(tasks), "full model of the worst")
    return paths


def _is_there(path: Path, origin: dict[str, Any], part: ReducedPart) -> bool:
    if not path.exists():
        return False
    try:
        _, metadata = read_header(path)
    except (ArtefactError, json.JSONDecodeError):
        return False
    same_mesh = metadata.get("mesh_digest") == part.metadata.get("mesh_digest")
    return same_mesh and all(metadata.get(name) == value for name, value in origin.items())
