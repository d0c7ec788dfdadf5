"""A training looked at in the browser, finished or still going on."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.run_folder import SUMMARY, TRAINING_FOLDER, RunFolder, read_settings
from pneumorph.gait.phase_sweep import PhaseSweep
from pneumorph.learn.checkpoint import NEWEST, read_checkpoint
from pneumorph.learn.coopt_result import SUMMARY_FILE
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.metrics import METRICS_FILE
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.snapshot import TrainingSnapshot, training_snapshot
from pneumorph.report.learning_figures import AS_IT_STANDS
from pneumorph.report.page import write_html
from pneumorph.report.physics_words import (
    MEAN_OVER_WORLDS,
    physics_name,
    physics_words,
    walked_in,
)
from pneumorph.report.plan import plans_of
from pneumorph.report.replay.live_server import LivePage
from pneumorph.report.scene import Actor
from pneumorph.report.training_view import SHOWN_DESIGNS, training_view_data, training_view_page
from pneumorph.study.baseline import SWEEP_FILE
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_walk import recorded_walk


@dataclass(frozen=True)
class SeenDesign:
    """One of the best designs so far, and when training saw it."""

    design: str
    distance_cm: float
    source: str
    timestep: int


@dataclass(frozen=True)
class WatchedMoment:
    """What a training was at one moment; no values before its first round."""

    run: str
    finished: bool
    timestep: int
    timesteps: int
    """When it will be finished."""
    return_mean_cm: float | None
    """Of the last round."""
    best_distance_cm: float | None
    design_entropy: float | None
    design_entropy_target: float | None
    last_round_s_ago: float | None
    best_designs: tuple[SeenDesign, ...]
    checkpoint_timestep: int | None
    page: str | None = None
    """The page of this moment, where one was written."""
    own_task: str | None = None
    """What a task of one's own is called, whose rewards these are; None before the first checkpoint
    or of none."""


class WatchedRun:
    """A run's training, and its best robot simulated once for as long as it is the best.

    Args:
        folder: Folder of a coopt run or a demo, finished or not.

    Raises:
        ArtefactError: It holds no training.
    """

    def __init__(self, folder: Path) -> None:
        # Perhaps still going on: settings, but no summary.
        run = FinishedRun(folder, {}, read_settings(folder))
        if "coopt" not in run.settings:
            raise ArtefactError(f"{folder} holds no training, expected the folder of a coopt run")
        self.folder = folder
        self.settings = run.structured("coopt", CooptSettings)
        self._spec, self._plan_of = run.spec(), plans_of(run.robot)
        self._has_drawn_worlds = run.has_drawn_worlds
        self._baseline_world = AS_IT_STANDS if run.has_drawn_worlds else ""
        self._best: tuple[DesignGaitPair, Actor] | None = None
        self._task: str | None = None
        self._task_is_known = False

    def moment(self) -> WatchedMoment:
        """What the training is now."""
        return self._moment(self._snapshot())

    def write(self, folder: RunFolder) -> WatchedMoment:
        """Write watch.html, one self-contained page of this moment."""
        snapshot = self._snapshot()
        page = training_view_page(str(self.folder), self._view(snapshot))
        path = write_html(folder / "watch.html", page)
        return replace(self._moment(snapshot), page=str(path))

    def serve(self, folder: RunFolder, port: int, interval_s: float) -> WatchedMoment:
        """Send every change to a page until Ctrl-C; return the last moment.

        Args:
            folder: Told the address and how far the training is.
            port: Port of 127.0.0.1; 0 takes a free one.
            interval_s: How often the run's files are looked at [s].
        """
        seen: tuple[int | None, ...] = ()
        snapshot, title = self._snapshot(), str(self.folder)
        with LivePage(training_view_page(title, None), port) as live:
            folder.progress.say(f"watching {title} at {live.address} until Ctrl-C")
            try:
                while True:
                    now = self._written_at()
                    if now != seen:
                        seen, snapshot = now, self._snapshot()
                        live.send("snapshot", self._view(snapshot), replace=True)
                        folder.progress(snapshot.timestep, snapshot.timesteps, "training")
                    time.sleep(interval_s)
            except KeyboardInterrupt:
                live.send("end", {})
        return self._moment(snapshot)

    def _snapshot(self) -> TrainingSnapshot:
        return training_snapshot(self.folder / TRAINING_FOLDER, self.settings)

    def _written_at(self) -> tuple[int | None, ...]:
        """When each file that a training renews was written, to see whether something changed."""
        training = self.folder / TRAINING_FOLDER
        return tuple(_written_at(training / name) for name in (METRICS_FILE, NEWEST, SUMMARY_FILE))

    def _moment(self, snapshot: TrainingSnapshot) -> WatchedMoment:
        last = snapshot.metrics[-1] if snapshot.metrics else {}
        return WatchedMoment(
            run=str(self.folder),
            finished=snapshot.is_finished,
            timestep=snapshot.timestep,
            timesteps=snapshot.timesteps,
            return_mean_cm=last.get("return_mean_cm"),
            best_distance_cm=last.get("best_distance_cm"),
            design_entropy=last.get("design_entropy"),
            design_entropy_target=last.get("design_entropy_target"),
            last_round_s_ago=snapshot.last_round_s_ago,
            best_designs=tuple(
                SeenDesign(
                    design=str(self.settings.space[pair.design]),
                    distance_cm=pair.distance_cm,
                    source=pair.source,
                    timestep=pair.timestep,
                )
                for pair in snapshot.pairs[:SHOWN_DESIGNS]
            ),
            checkpoint_timestep=snapshot.pairs_timestep,
            own_task=self._own_task(),
        )

    def _view(self, snapshot: TrainingSnapshot) -> dict[str, Any]:
        """What the page shows of a snapshot."""
        best = self._crawling(snapshot.pairs[0]) if snapshot.pairs else None
        return training_view_data(
            snapshot,
            self.settings.space,
            best,
            self._baseline(),
            self._plan_of,
            self.settings.task.goal,
            self._baseline_world,
            walked_in(physics_words(self._spec.physics), self._has_drawn_worlds),
            MEAN_OVER_WORLDS if self.settings.objective.is_robust else "",
            self._own_task(),
            self.settings.task.reward.takes_off,
        )

    def _own_task(self) -> str | None:
        """What a task of one's own is called, as the first checkpoint tells, or the summary."""
        if not self._task_is_known:
            # Of damage the snapshot tells.
            with suppress(FileNotFoundError, ArtefactError):
                self._task, self._task_is_known = self._read_own_task(), True
        return self._task

    def _read_own_task(self) -> str | None:
        if (self.folder / SUMMARY).exists():
            return FinishedRun.read(self.folder).own_task
        checkpoint = read_checkpoint(self.folder / TRAINING_FOLDER / NEWEST)
        told: str | None = checkpoint.metadata["provenance"].get("environment")
        return told

    def _baseline(self) -> float | None:
        """What the expert's best phase achieves, where the sweep is done."""
        file = self.folder / SWEEP_FILE
        counted = PhaseSweep.load(file).counted if file.exists() else np.zeros(0)
        walked = counted[np.isfinite(counted)]
        return float(walked.max()) if len(walked) else None

    def _crawling(self, pair: DesignGaitPair) -> Actor:
        same = self._best is not None and (self._best[0].design, self._best[0].distance_cm) == (
            pair.design,
            pair.distance_cm,
        )
        if self._best is None or not same:
            task = self.settings.task
            design = self.settings.space[pair.design]
            action_s = task.action_s(self._spec.physics.time_step_s)
            trajectory = recorded_walk(
                self._spec,
                design,
                pair.gait(action_s, task),
                settling_steps=task.settling_step_count,
            )
            label = f"{design}\n{physics_name(self._spec.physics)}"
            self._best = pair, Actor.of(trajectory, label, task.goal)
        return self._best[1]


def _written_at(file: Path) -> int | None:
    try:
        return file.stat().st_mtime_ns
    except FileNotFoundError:
        return None  # not yet, or between two renames
