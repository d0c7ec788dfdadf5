"""Put every design of a space on one page: filter, search, sort, and look at each.

RUN is a coopt run (scores and probabilities of its design distribution) or an evaluation
(distances of its pairs); without one the page shows the designs of --space alone. A design can be
named, such as 1.0.0.2.2.0.0.1, filtered by legs, regulators and symmetry, and sorted by score. One
click shows it from above and its replay, or the command that walks it. The best pairs of a coopt
run are walked anew for their replays; trajectories of other runs are added with --replays.

Writes explorer.html into RUN/explorer, or --out: one file that opens from disk with no network.

Example: pneumorph explore runs/quick
"""

from __future__ import annotations

import shlex
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.command.evaluate import EvaluateOptions, evaluate
from pneumorph.command.run_folder import RunFolder, default_folder, read_settings, read_summary
from pneumorph.command.verb import Verb
from pneumorph.report.explorer.page import write_explorer
from pneumorph.report.explorer.scored_designs import (
    ScoredDesigns,
    recorded_walks,
    scored_by_evaluation,
    scored_by_training,
    unscored,
)
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.run import Run
from pneumorph.report.sheet import PAGE_REPLAY
from pneumorph.robot.design_space import DesignSpace


@dataclass(frozen=True)
class ExploreOptions:
    """Whose designs, and which replays."""

    run: tyro.conf.Positional[Path | None] = None
    """Folder of a coopt run or an evaluation; none for the designs alone."""
    replays: tuple[Path, ...] = ()
    """Run folders whose trajectories are shown as well."""
    pair_count: int = 5
    """Best pairs of a coopt run to walk for their replays, a second or two each."""
    space: DesignSpace = field(default_factory=DesignSpace)
    """The designs, where no run says which."""
    replay: ReplaySettings = PAGE_REPLAY

    def __post_init__(self) -> None:
        if self.pair_count < 0:
            raise ValueError(f"pair_count is {self.pair_count}, expected 0 or more")


def explore(options: ExploreOptions, folder: RunFolder) -> dict[str, Any]:
    """Write the page and return what is on it."""
    start = time.monotonic()
    scored, title, gait = _scored(options)
    folders = list(options.replays)
    if options.run is not None and scored.probability is not None and scored.pairs:
        count = min(options.pair_count, len(scored.pairs))
        if count:
            pairs = RunFolder(folder.path / "pairs", "evaluate", folder.progress)
            evaluate(EvaluateOptions(options.run, pair_count=count, record=True), pairs)
            folders.append(pairs.path)
    walks = recorded_walks(scored.space, folders)
    # What the run itself recorded is shown where nothing newer is.
    own = {} if options.run is None else recorded_walks(scored.space, [options.run])
    scored = replace(scored, trajectories={**own, **walks})
    folder.progress.stage("writing the page")
    command = f"pneumorph simulate {gait}--design DESIGN --out runs/DESIGN"
    path = write_explorer(folder / "explorer.html", scored, title, command, options.replay)
    return {
        "page": str(path),
        "page_bytes": path.stat().st_size,
        "design_count": len(scored.space),
        "scored_count": int(np.isfinite(scored.score_cm).sum()),
        "replay_count": sum(len(walks) for walks in scored.trajectories.values()),
        "wall_s": time.monotonic() - start,
    }


def _scored(options: ExploreOptions) -> tuple[ScoredDesigns, str, str]:
    """The designs, the page's title, and the gait's flag of the command that walks a design."""
    if options.run is None:
        return unscored(options.space), f"{len(options.space)} designs", ""
    run = Run(options.run, read_summary(options.run), read_settings(options.run))
    verb = run.summary["verb"]
    if verb in ("coopt", "demo"):
        policy = shlex.quote(str(options.run / "training" / "policy.npz"))
        scored = scored_by_training(run)
        return scored, f"{len(scored.space)} designs of {options.run}", f"--gait {policy} "
    if verb != "evaluate":
        raise ValueError(
            f"{options.run} holds a run of `pneumorph {verb}`, expected one of coopt, demo or "
            "evaluate, which give designs a score"
        )
    scored = scored_by_evaluation(run, options.space)
    return scored, f"Designs of {options.run}", ""


def _folder(options: ExploreOptions) -> Path:
    return default_folder("explore") if options.run is None else options.run / "explorer"


VERB = Verb(ExploreOptions, explore, folder=_folder)
