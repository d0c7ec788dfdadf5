"""What the best pairs of a coopt run do: rewards of each step, tilt, load and friction of each leg.

The run's best pairs and, for comparison, the expert's best phase walk once more in the reduced
model, with the floor's forces recorded. They also walk over a range of friction coefficients, by
default that of the worlds they were trained in, which shows how much each gait depends on it.

Writes analysis.json, the trajectories, and the figures steps, margin, friction, pairs and a cycle
of each robot.

Example: pneumorph analyse runs/paper --out runs/paper-analysis
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.analysis_figures import draw_analysis
from pneumorph.study.analysis import Analysis, AnalysisSettings, analyse
from pneumorph.study.finished_run import FinishedRun, TakenOver


@dataclass(frozen=True)
class AnalyseOptions:
    """The run, its pairs, and over which frictions they walk."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run."""
    afresh: bool = False
    """Take leg and physics only from the flags. Otherwise they are the run's, changed by the flags
    that are given."""
    analysis: Annotated[AnalysisSettings, flat] = field(default_factory=AnalysisSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def run(options: AnalyseOptions, folder: RunFolder) -> Analysis:
    """Analyse, and draw the figures."""
    learned, spec = FinishedRun.read(options.run), options.robot.spec()
    options.robot.refuse_full_options()
    found = analyse(learned, options.analysis, spec, folder)
    draw_analysis(found, options.analysis, learned, spec, folder)
    return found


def taken_over(options: AnalyseOptions) -> TakenOver | None:
    """Leg and physics of the run."""
    learned = FinishedRun.read(options.run)
    learned.refuse_other_robot(options.robot, options.afresh)
    return None if options.afresh else learned.handed_on(learned.taken_over("robot"))


VERB = Verb(AnalyseOptions, run, taken_over=taken_over)
