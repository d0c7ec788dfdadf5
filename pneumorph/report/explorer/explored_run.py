"""Every design of a space on one page, with what a run found of each."""

from __future__ import annotations

import shlex
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.report.explorer.page import write_explorer
from pneumorph.report.explorer.scored_designs import (
    ScoredDesigns,
    recorded_walks,
    scored_by_evaluation,
    scored_by_training,
    unscored,
)
from pneumorph.report.plan import paper_plan, plans_of
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.sheet import PAGE_REPLAY
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.evaluation import EvaluationSettings, evaluate
from pneumorph.study.finished_run import FinishedRun

_TRAININGS = ("coopt", "demo")
"""Verbs that leave a design distribution and a policy."""
ROBOT_FILE = "robot.json"
"""Settings of a robot that its names alone do not tell, for the command that walks a design."""


@dataclass(frozen=True)
class Explorer:
    """What an explorer's page shows, and where it is."""

    page: str
    page_bytes: int
    design_count: int
    scored_count: int
    """Designs with a score."""
    replay_count: int
    """Walks that can be replayed."""
    wall_s: float


def explore(
    folder: RunFolder,
    run: FinishedRun | None = None,
    space: DesignSpace | None = None,
    *,
    replays: tuple[Path, ...] = (),
    pair_count: int = 5,
    replay: ReplaySettings = PAGE_REPLAY,
    described: Path | None = None,
    threads: int = 0,
) -> Explorer:
    """Write explorer.html.

    Args:
        folder: Where to write.
        run: A coopt run or an evaluation, which gives designs a score; None for designs alone.
        space: The designs, where no run says which; see `said_space`.
        replays: Run folders whose trajectories are shown as well.
        pair_count: Best pairs of a coopt run to walk for their replays, a second or two each.
        replay: How exact replays are.
        described: File of the robot whose designs they are, where no run says it; None for the
            paper's.
        threads: The engine's, where pairs walk; 0 for as many as the run's.

    Raises:
        ValueError: The run is of a verb that gives designs no score, or stands beside a robot.
        ArtefactError: It is damaged.
    """
    start = time.monotonic()
    if run is not None and described is not None:
        raise ValueError(
            f"--robot {described} is given beside the run {run.folder}, expected one of them: a "
            "run's designs are those of its own robot"
        )
    scored, title, flags = _scored(run, space or DesignSpace(), folder)
    robot = None if run is None else run.robot
    if described is not None:
        robot = layered(RobotOptions(), [{"described": str(described)}])
        flags = f"--robot {shlex.quote(str(described))} "
    walked = list(replays)
    if run is not None and scored.probability is not None and scored.pairs and pair_count:
        pairs = RunFolder(folder.path / "pairs", "evaluate", folder.progress)
        count = min(pair_count, len(scored.pairs))
        walkers = run.spec()
        walkers = replace(walkers, thread_count=threads or walkers.thread_count)
        evaluate(run, EvaluationSettings(pair_count=count, record=True), walkers, pairs)
        walked.append(pairs.path)
    # What the run itself recorded is shown where nothing newer is.
    own = {} if run is None else recorded_walks(scored.space, [run.folder])
    walks = {**own, **recorded_walks(scored.space, walked)}
    folder.progress.stage("writing the page")
    command = f"pneumorph simulate {flags}--design DESIGN --out runs/DESIGN"
    scored = replace(scored, trajectories=walks)
    plans = paper_plan if robot is None else plans_of(robot)
    path = write_explorer(folder / "explorer.html", scored, title, command, replay, plans)
    return Explorer(
        page=str(path),
        page_bytes=path.stat().st_size,
        design_count=len(scored.space),
        scored_count=int(np.isfinite(scored.score_cm).sum()),
        replay_count=sum(len(each) for each in walks.values()),
        wall_s=time.monotonic() - start,
    )


def said_space(run: FinishedRun) -> DesignSpace | None:
    """The designs of a training, or of the one that an evaluation looks at; None where the run does
    not say them: that training is gone, and the robot is of no file.

    Raises:
        ArtefactError: It is damaged.
        FileNotFoundError: The training and the robot's file are gone.
    """
    if run.verb in _TRAININGS:
        return run.space
    if run.verb != "evaluate":
        return None
    if run.source is not None:
        return run.source.space
    return None if run.robot.description is None else run.robot.description.space


def _scored(
    run: FinishedRun | None, space: DesignSpace, folder: RunFolder
) -> tuple[ScoredDesigns, str, str]:
    """The designs, the page's title, and flags of the command that walks a design."""
    if run is None:
        return unscored(space), f"{len(space)} designs", ""
    if run.verb in _TRAININGS:
        scored = scored_by_training(run)
        return scored, f"{len(scored.space)} designs of {run.folder}", _flags(run, run, folder)
    if run.verb != "evaluate":
        raise ValueError(
            f"{run.folder} holds a run of `pneumorph {run.verb}`, expected one of coopt, demo or "
            "evaluate, which give designs a score"
        )
    scored = scored_by_evaluation(run, said_space(run) or space)
    return scored, f"Designs of {run.folder}", _flags(run, run.source, folder)


def _flags(run: FinishedRun, training: FinishedRun | None, folder: RunFolder) -> str:
    """Flags of the command that walks a design: the gait of a training's policy, which brings its
    robot, and the run's robot where that is another; where that takes more than its names, as the
    settings of a file in the folder."""
    flags, brought = "", RobotOptions()
    if training is not None and training.verb in _TRAININGS:
        policy = shlex.quote(str(training.folder / "training" / "policy.npz"))
        flags, brought = f"--gait {policy} ", training.robot
    # How it is computed is the reader's own.
    robot = replace(run.robot, threads=brought.threads, executor=brought.executor)
    if robot == brought:
        return flags
    names = (
        {"described": robot.described}
        if robot.described is not None
        else {name: getattr(robot, name) for name in ("based_on", "part", "calibration")}
    )
    layer = {name: str(v) for name, v in names.items() if v not in (None, getattr(brought, name))}
    if layered(brought, [layer]) != robot:
        layer = {"settings": str(folder / ROBOT_FILE)}
        write_json(folder / ROBOT_FILE, {"robot": settings_to_dict(robot)})
    of_robot = {"described": "robot", "based_on": "physics"}
    return flags + "".join(
        f"--{of_robot.get(name, name)} {shlex.quote(value)} " for name, value in layer.items()
    )
