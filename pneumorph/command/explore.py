"""Put every design of a space on one page: filter, search, sort, and look at each.

RUN is a coopt run (scores and probabilities of its design distribution) or an evaluation (distances
of its pairs); without one the page shows only the designs of --space or of a robot's file
(--robot). Search for a design by name, such as 1.0.0.2.2.0.0.1, filter by legs, regulators and
symmetry, and sort by score. Click a design to see it from above with its replay, or the command
that simulates it. The best pairs of a coopt run are simulated again for their replays; --replays
adds trajectories of other runs.

Writes explorer.html into RUN/explorer, or --out: one file that opens from disk without a network.

Example: pneumorph explore runs/quick
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.base.checked import Checked, CountOrNone
from pneumorph.base.run_folder import RunFolder, default_folder
from pneumorph.catalogue.robot_settings import described_robot
from pneumorph.command.verb import Verb
from pneumorph.report.explorer.explored_run import Explorer, explore, said_space
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.sheet import PAGE_REPLAY
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun


@dataclass(frozen=True)
class ExploreOptions(Checked):
    """Whose designs, and which replays."""

    run: tyro.conf.Positional[Path | None] = None
    """Folder of a coopt run or an evaluation; none to show only the designs."""
    replays: tuple[Path, ...] = ()
    """Run folders whose trajectories are also shown."""
    pair_count: CountOrNone = 5
    """Best pairs of a coopt run to simulate for their replays, a second or two each."""
    space: DesignSpace = field(default_factory=DesignSpace)
    """The designs, if there is no run to say which."""
    replay: ReplaySettings = PAGE_REPLAY
    described: Annotated[Path | None, tyro.conf.arg(name="robot")] = None
    """TOML file of a robot, see docs/own_robot.md, whose designs are shown; a run has its own."""
    threads: CountOrNone = 0
    """Threads of the engine for these pairs; 0 takes as many as the run did."""

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        """The designs that a robot's file brings with it."""
        robot = described_robot({"robot": content})
        return {} if robot is None else {"space": robot.training_settings()["space"]}

    def idle_settings(self) -> dict[str, str]:
        """The designs, where a run says them."""
        said = None if self.run is None else said_space(FinishedRun.read(self.run))
        return {} if said is None else {"space": f"beside {self.run}, whose designs are its own"}


def run(options: ExploreOptions, folder: RunFolder) -> Explorer:
    """Write the page."""
    return explore(
        folder,
        None if options.run is None else FinishedRun.read(options.run), options.space,
        replays=options.replays, pair_count=options.pair_count, replay=options.replay,
        described=options.described, threads=options.threads,
    )  # fmt: skip


VERB = Verb(
    ExploreOptions,
    run,
    folder=lambda asked: default_folder("explore") if asked.run is None else asked.run / "explorer",
)
