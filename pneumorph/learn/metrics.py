"""Metrics of training: a line of JSON for each round, and the same numbers for TensorBoard and,
where asked for, Weights & Biases."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError, read_text, write_text
from pneumorph.learn.weights_and_biases import open_wandb

METRICS_FILE = "metrics.jsonl"
TENSORBOARD_FOLDER = "tensorboard"
_FLUSH_S = 120.0
"""How often TensorBoard's file is brought to the disk, which may take long: as its package does."""

HISTOGRAM_EDGES_CM = tuple(np.arange(-5.0, 30.01, 0.5).tolist())
"""Bins of the histogram of scores [cm]; scores beyond the ends count in the last bins."""


class MetricsLog:
    """Writes the metrics of a run, and goes on where a resumed run left off."""

    def __init__(
        self, folder: Path | str, timestep: int = 0, wandb_project: str | None = None
    ) -> None:
        """Open the log of a run folder.

        Args:
            folder: The run folder.
            timestep: Timestep training goes on from; later rounds are forgotten, because training
                makes them again, and at 0 TensorBoard's files with them.
            wandb_project: Project of Weights & Biases to log to as well.
        """
        folder = Path(folder)
        self.path = folder / METRICS_FILE
        kept = [line for line in read_metrics(folder) if line["timestep"] <= timestep]
        text = "".join(json.dumps(line) + "\n" for line in kept)
        write_text(self.path, text)
        self._file = self.path.open("a", encoding="utf-8")
        if not timestep:
            shutil.rmtree(folder / TENSORBOARD_FOLDER, ignore_errors=True)
        self._board = _Board(folder / TENSORBOARD_FOLDER, timestep + 1 if timestep else None)
        self._wandb = open_wandb(folder, wandb_project, timestep) if wandb_project else None

    def write(self, metrics: Mapping[str, Any]) -> None:
        """Write one round; ``metrics["timestep"]`` places it. Lists go to the file alone.

        Raises:
            OSError: It cannot be written, such as onto a full disk.
        """
        with _named(self.path):
            self._file.write(json.dumps(dict(metrics), allow_nan=False) + "\n")
            self._file.flush()
        numbers = {
            name: value
            for name, value in metrics.items()
            if name != "timestep" and isinstance(value, int | float)
        }
        self._board.write(numbers, metrics["timestep"])
        if self._wandb is not None:
            self._wandb.log(numbers, step=metrics["timestep"])

    def close(self) -> None:
        """Close everything; raises as `write`."""
        with ExitStack() as closing:  # each of them, whichever fails
            if self._wandb is not None:
                closing.callback(self._wandb.finish)
            closing.callback(self._board.close)
            closing.enter_context(_named(self.path))
            closing.callback(self._file.close)


class _Board:
    """Writes numbers for TensorBoard: the package's own writer does it in a thread, for whose
    queue a run would wait for ever once the thread has died of a full disk."""

    def __init__(self, folder: Path, purge_step: int | None) -> None:
        """Open a file in a folder; what earlier files say from a step on is forgotten."""
        from tensorboardX.event_file_writer import EventsWriter
        from tensorboardX.proto.event_pb2 import Event, SessionLog

        self._folder, self._event = folder, Event
        with _named(folder):
            folder.mkdir(parents=True, exist_ok=True)
            self._writer = EventsWriter(str(folder / "events"))
            if purge_step is not None:
                begun = SessionLog(status=SessionLog.START)
                self._writer.write_event(Event(step=purge_step, session_log=begun))
        self._flushed_s = time.time()

    def write(self, numbers: Mapping[str, float], step: int) -> None:
        """Write the numbers of a step."""
        from tensorboardX.summary import scalar

        now_s = time.time()
        with _named(self._folder):
            for name, value in numbers.items():
                summary = scalar(name, value)
                self._writer.write_event(self._event(wall_time=now_s, step=step, summary=summary))
            if now_s > self._flushed_s + _FLUSH_S:
                self._writer.flush()
                self._flushed_s = now_s

    def close(self) -> None:
        """Close the file."""
        with _named(self._folder):
            self._writer.close()


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name what cannot be written, which an open file's error does not."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


HISTOGRAM = "score_histogram"
DRAWN = (
    "return_mean_cm", "best_distance_cm", "design_entropy", "design_entropy_target", HISTOGRAM,
)  # fmt: skip
"""What figures of a training are drawn from."""


def read_metrics(folder: Path | str, needed: Collection[str] = ()) -> list[dict[str, Any]]:
    """Read the metrics of a run folder, a dictionary for each round.

    A last line that a kill cut short is left out.

    Args:
        folder: The run folder.
        needed: Numbers that every round must have, beside its timestep.

    Raises:
        ArtefactError: A line is no round of numbers; names the line and the number.
    """
    path = Path(folder) / METRICS_FILE
    if not path.exists():
        return []
    rounds: list[dict[str, Any]] = []
    lines = read_text(path, "metrics").splitlines(keepends=True)
    for number, line in enumerate(lines, start=1):
        try:
            content = json.loads(line)
        except (json.JSONDecodeError, RecursionError) as error:
            if number == len(lines) and not line.endswith("\n"):
                break
            raise ArtefactError(f"{path}, line {number} is not JSON ({error})") from error
        _check_round(content, f"{path}, line {number}", ["timestep", *needed])
        bins = [len(each[HISTOGRAM]) for each in (*rounds[:1], content) if HISTOGRAM in each]
        if bins[:1] != bins[-1:]:
            raise ArtefactError(
                f"{path}, line {number}: {HISTOGRAM}: expected the {bins[0]} bins of the first "
                f"line, got {bins[-1]}"
            )
        rounds.append(content)
    return rounds


def _check_round(content: Any, where: str, needed: Collection[str]) -> None:
    """Refuse a line that is no table of finite numbers, with a histogram or without.

    Raises:
        ArtefactError: It is none.
    """
    if not isinstance(content, dict):
        raise ArtefactError(f"{where}: expected a table of numbers, got {content!r:.60}")
    for name in needed:
        if name not in content:
            raise ArtefactError(f"{where}: {name} is missing, expected a value")
    for name, value in content.items():
        if name == HISTOGRAM:
            fits = isinstance(value, list) and bool(value) and all(map(_is_finite, value))
            expected = "a list of finite numbers"
        elif name == "timestep":
            fits, expected = type(value) is int and value >= 0, "a whole number"
        else:
            # No robot may have come to the end of its walk yet.
            may_lack = name not in DRAWN or name == "best_distance_cm"
            fits = _is_finite(value) or (may_lack and value is None)
            fits = fits or (name not in DRAWN and isinstance(value, str | list))
            expected = "a finite number"
        if not fits:
            raise ArtefactError(f"{where}: {name}: expected {expected}, got {value!r:.60}")


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def score_histogram(scores: np.ndarray, probabilities: np.ndarray) -> list[float]:
    """Share of the design distribution in each bin of score (paper, figure 7).

    Args:
        scores: Score of each design [cm], shape (design,).
        probabilities: Probability of each design, shape (design,).
    """
    edges = np.array(HISTOGRAM_EDGES_CM)
    inside = np.clip(scores, edges[0], np.nextafter(edges[-1], 0.0))
    return [float(share) for share in np.histogram(inside, edges, weights=probabilities)[0]]
