"""How far the runs of a campaign are, from the folders that other processes write."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pneumorph.base.meanwhile import meanwhile
from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import SUMMARY, TRAINING_FOLDER
from pneumorph.learn.finetuning import FINETUNED_FOLDER
from pneumorph.learn.metrics import read_metrics
from pneumorph.learn.settings import CooptSettings


@contextmanager
def campaign_progress(
    folder: Path,
    runs: Mapping[str, CooptSettings],
    progress: Progress,
    interval_s: float = 5.0,
) -> Iterator[Callable[[str], None]]:
    """Show the timesteps of all runs together while the block lasts; yields what prints a line.

    Args:
        folder: The campaign's folder.
        runs: Settings of each run by the name of its folder.
        progress: Where it is shown.
        interval_s: How often the folders are looked at [s].
    """
    total = sum(all_timesteps(settings) for settings in runs.values())
    speaks = threading.Lock()

    def say(text: str) -> None:
        with speaks:
            progress.say(text)

    def show() -> None:
        done = sum(timesteps_made(folder / name, settings) for name, settings in runs.items())
        with speaks:
            progress(done, total, "timesteps of all runs")

    with meanwhile(show, interval_s):
        yield say
    show()


def all_timesteps(settings: CooptSettings) -> int:
    """Timesteps of a whole run, fine-tuning included."""
    finalists = settings.finetuning.finalist_count
    return settings.training_timesteps + finalists * settings.finalist_timesteps


def timesteps_made(folder: Path, settings: CooptSettings) -> int:
    """Timesteps that a run has made; of fine-tuning, those of designs it has done with."""
    if (folder / SUMMARY).exists():
        return all_timesteps(settings)
    training = folder / TRAINING_FOLDER
    metrics = read_metrics(training)
    made = int(metrics[-1]["timestep"]) if metrics else 0
    policies = len(list((training / FINETUNED_FOLDER).glob("*.npz")))
    return made + policies * settings.finalist_timesteps
