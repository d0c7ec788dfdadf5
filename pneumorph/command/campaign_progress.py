"""How far the runs of a campaign are, from the folders that other processes write."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from pneumorph.command.coopt import TRAINING_FOLDER
from pneumorph.command.progress import Progress
from pneumorph.command.run_folder import SUMMARY
from pneumorph.coopt.finetuning import FINETUNED_FOLDER
from pneumorph.coopt.metrics import read_metrics
from pneumorph.coopt.settings import CooptSettings


class CampaignProgress:
    """Shows the timesteps of all runs together, in a thread, while the ``with`` block lasts.

    Args:
        folder: The campaign's folder.
        runs: Settings of each run by the name of its folder.
        progress: Where it is shown.
        interval_s: How often the folders are looked at [s].
    """

    def __init__(
        self,
        folder: Path,
        runs: Mapping[str, CooptSettings],
        progress: Progress,
        interval_s: float = 5.0,
    ) -> None:
        self._folder, self._runs, self._progress = folder, runs, progress
        self._interval_s = interval_s
        self._total = sum(all_timesteps(settings) for settings in runs.values())
        self._ended = threading.Event()
        self._speaks = threading.Lock()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> CampaignProgress:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        self._thread.join()
        if error is None:
            self._show()

    def say(self, text: str) -> None:
        """Print a line of its own."""
        with self._speaks:
            self._progress.say(text)

    def _watch(self) -> None:
        while not self._ended.wait(self._interval_s):
            with suppress(OSError):  # of a network's folder, for the moment
                self._show()

    def _show(self) -> None:
        done = sum(timesteps_made(self._folder / name, s) for name, s in self._runs.items())
        with self._speaks:
            self._progress(done, self._total, "timesteps of all runs")


def all_timesteps(settings: CooptSettings) -> int:
    """Timesteps of a whole run, fine-tuning included."""
    finetuning = settings.finetuning
    each = finetuning.round_count(settings.timesteps_per_round) * settings.timesteps_per_round
    trained = settings.round_count * settings.timesteps_per_round
    return trained + finetuning.finalist_count * each


def timesteps_made(folder: Path, settings: CooptSettings) -> int:
    """Timesteps that a run has made; of fine-tuning, those of designs it has done with."""
    if (folder / SUMMARY).exists():
        return all_timesteps(settings)
    training = folder / TRAINING_FOLDER
    metrics = read_metrics(training)
    made = int(metrics[-1]["timestep"]) if metrics else 0
    each = settings.finetuning.round_count(settings.timesteps_per_round)
    policies = len(list((training / FINETUNED_FOLDER).glob("*.npz")))
    return made + policies * each * settings.timesteps_per_round
