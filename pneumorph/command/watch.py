"""Look at a training in the browser while it runs, or when it is finished.

Shows the returns, the entropy of the design distribution against its target, the five best designs
from above and the best robot crawling. The page's address is printed, and the page updates with
every round and checkpoint until Ctrl-C. --once writes one self-contained file instead, watch.html;
with --json only the current numbers are printed. TensorBoard reads the same run: tensorboard
--logdir RUN/training/tensorboard.

Example: pneumorph watch runs/quick
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.base.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.report.watched_run import WatchedMoment, WatchedRun


@dataclass(frozen=True)
class WatchOptions(Checked):
    """Which training, and how to show it."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run or a demo, finished or not."""
    once: bool = False
    """Write one self-contained page of the current state instead of serving one."""
    port: Annotated[int, Bounds(0, 65535)] = 0
    """Port on 127.0.0.1; 0 takes a free one."""
    interval_s: Positive = 2.0
    """How often the run's files are checked [s]."""

    def idle_settings(self) -> dict[str, str]:
        """Those of a page that is served, where one is written instead."""
        return dict.fromkeys(("port", "interval_s"), "with --once") if self.once else {}


def run(options: WatchOptions, folder: RunFolder) -> WatchedMoment:
    """Serve the page until the keyboard says stop, or write it once; return the last moment."""
    watched = WatchedRun(options.run)
    if options.once:
        return watched.write(folder)
    if folder.summary_only:
        return watched.moment()
    return watched.serve(folder, options.port, options.interval_s)


VERB = Verb(WatchOptions, run, folder=lambda options: options.run / "watch", alone=False)
