"""Look at a training in the browser while it goes on, or when it is finished.

Shows the returns, the entropy of the design distribution against its target, the five best designs
from above and the best robot crawling. The address of the page is printed; it is renewed with every
round and checkpoint until Ctrl-C. With --once one self-contained file is written instead,
watch.html, and with --json alone the numbers of the moment are printed. TensorBoard reads the same
run: tensorboard --logdir RUN/training/tensorboard.

Example: pneumorph watch runs/quick
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from pneumorph.command.coopt import TRAINING_FOLDER
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder, read_settings
from pneumorph.command.verb import Verb
from pneumorph.coopt.checkpoint import NEWEST
from pneumorph.coopt.design_gait_pair import DesignGaitPair
from pneumorph.coopt.metrics import METRICS_FILE
from pneumorph.coopt.settings import CooptSettings
from pneumorph.coopt.snapshot import TrainingSnapshot, training_snapshot
from pneumorph.gait.phase_sweep import PhaseSweep
from pneumorph.report.replay.live_server import LivePage
from pneumorph.report.replay.page import write_page_file
from pneumorph.report.scene import Actor
from pneumorph.report.training_view import SHOWN_DESIGNS, training_view_data, training_view_page
from pneumorph.settings import settings_from_dict


@dataclass(frozen=True)
class WatchOptions:
    """Which training, and how to show it."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run or a demo, finished or not."""
    once: bool = False
    """Write one self-contained page of this moment instead of serving one."""
    port: int = 0
    """Port of 127.0.0.1; 0 takes a free one."""
    interval_s: float = 2.0
    """How often the run's files are looked at [s]."""

    def __post_init__(self) -> None:
        if not 0 <= self.port < 65536:
            raise ValueError(f"port is {self.port}, expected 0 to 65535")
        if not self.interval_s > 0.0:
            raise ValueError(f"interval_s is {self.interval_s}, expected above 0")


class WatchedRun:
    """A run's training, and its best robot simulated once for as long as it is the best."""

    def __init__(self, folder: Path) -> None:
        saved = read_settings(folder)
        if "coopt" not in saved:
            raise ValueError(f"{folder} holds no training, expected the folder of a coopt run")
        self.folder = folder
        self.settings = settings_from_dict(CooptSettings, saved["coopt"])
        self._workshop = Workshop(settings_from_dict(RobotOptions, saved["robot"]))
        self._best: tuple[DesignGaitPair, Actor] | None = None

    def written_at(self) -> tuple[int | None, ...]:
        """When each file that a training renews was written, to see whether something changed."""
        names = (METRICS_FILE, NEWEST)
        return tuple(_written_at(self.folder / TRAINING_FOLDER / name) for name in names)

    def snapshot(self) -> TrainingSnapshot:
        """Return what the training is now."""
        return training_snapshot(self.folder / TRAINING_FOLDER, self.settings)

    def view(self, snapshot: TrainingSnapshot) -> dict[str, Any]:
        """Return what the page shows of a snapshot."""
        best = self._crawling(snapshot.pairs[0]) if snapshot.pairs else None
        return training_view_data(snapshot, self.settings.space, best, self._baseline_cm())

    def _baseline_cm(self) -> float | None:
        """Return the distance of the expert's best phase, where the sweep is done."""
        file = self.folder / "phase_sweep.npz"
        return float(PhaseSweep.load(file).distance_cm.max()) if file.exists() else None

    def _crawling(self, pair: DesignGaitPair) -> Actor:
        same = self._best is not None and (self._best[0].design, self._best[0].distance_cm) == (
            pair.design,
            pair.distance_cm,
        )
        if self._best is None or not same:
            task = self.settings.task
            design = self.settings.space[pair.design]
            action_s = task.action_step_count * self._workshop.simulation.time_step_s
            trajectory = self._workshop.recorded(
                design, pair.gait(action_s, task), settling_steps=task.settling_step_count
            )
            self._best = pair, Actor.of(trajectory, str(design))
        return self._best[1]


def watch(options: WatchOptions, folder: RunFolder) -> dict[str, Any]:
    """Serve the page until the keyboard says stop, or write it once; return the last snapshot."""
    run = WatchedRun(options.run)
    snapshot = run.snapshot()
    written = {}
    if options.once:
        page = training_view_page(str(options.run), run.view(snapshot))
        path = write_page_file(folder / "watch.html", page)
        written = {"page": str(path)}
    elif not folder.summary_only:
        snapshot = _served(run, options, folder)
    return {"run": str(options.run), **_summary(snapshot, run.settings), **written}


def _served(run: WatchedRun, options: WatchOptions, folder: RunFolder) -> TrainingSnapshot:
    """Send every change to the page until Ctrl-C; return the last snapshot."""
    seen: tuple[int | None, ...] = ()
    snapshot = run.snapshot()
    title = str(options.run)
    with LivePage(training_view_page(title, None), options.port) as live:
        folder.progress.say(f"watching {title} at {live.address} until Ctrl-C")
        try:
            while True:
                now = run.written_at()
                if now != seen:
                    seen, snapshot = now, run.snapshot()
                    live.send("snapshot", run.view(snapshot), replace=True)
                    folder.progress(snapshot.timestep, snapshot.timesteps, "training")
                time.sleep(options.interval_s)
        except KeyboardInterrupt:
            live.send("end", {})
    return snapshot


def _written_at(file: Path) -> int | None:
    try:
        return file.stat().st_mtime_ns
    except FileNotFoundError:
        return None  # not yet, or between two renames


def _summary(snapshot: TrainingSnapshot, settings: CooptSettings) -> dict[str, Any]:
    last = snapshot.metrics[-1] if snapshot.metrics else {}
    names = ("return_mean_cm", "best_distance_cm", "design_entropy", "design_entropy_target")
    return {
        "finished": snapshot.is_finished,
        "timestep": snapshot.timestep,
        "timesteps": snapshot.timesteps,
        **{name: last.get(name) for name in names},
        "last_round_s_ago": snapshot.last_round_s_ago,
        "best_designs": [
            {
                "design": str(settings.space[pair.design]),
                "distance_cm": pair.distance_cm,
                "source": pair.source,
                "timestep": pair.timestep,
            }
            for pair in snapshot.pairs[:SHOWN_DESIGNS]
        ],
        "checkpoint_timestep": snapshot.pairs_timestep,
    }


VERB = Verb(WatchOptions, watch, folder=lambda options: options.run / "watch", alone=False)
