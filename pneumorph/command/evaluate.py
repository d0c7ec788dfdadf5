"""Simulate the design-gait pairs of a coopt run once more.

With the reduced model all pairs walk side by side in a second, in the nominal world: a run trained
in one world must be repeated; one trained over worlds reported means over these. With --model full
each pair walks as finite elements, which takes half an hour to an hour (published physics: ten
minutes) and shows how far the reduction can be trusted for these gaits. Leg, physics and worlds are
the run's unless a flag says otherwise, such as --physics.friction 0.8; a run without worlds has the
usual ones of its physics, or those of its robot's file. With --randomize the pairs also walk in
worlds drawn from --randomisation (friction, modulus, mass, regulator lag and floor slope, written
like "U(0.9, 1.5)").

With --record or --model full, writes each pair's trajectory and replay.html, which shows them side
by side. Finished walks of finite elements are kept in full_order, and the same ones are read.

Example: pneumorph evaluate runs/quick --model full --pair-count 1 --out runs/check
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.base.idle_settings import within
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.evaluated_walks import write_evaluated_walks
from pneumorph.study.evaluation import Evaluation, EvaluationSettings, evaluate
from pneumorph.study.finished_run import FinishedRun, TakenOver
from pneumorph.study.usual_aim import implied_worlds


@dataclass(frozen=True)
class EvaluateOptions:
    """The run, and how to walk its pairs."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run."""
    afresh: bool = False
    """Take leg and physics only from the flags. Otherwise they are the run's, changed by the flags
    that are given."""
    evaluation: Annotated[EvaluationSettings, flat] = field(default_factory=EvaluationSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """The worlds that the physics brings, or the robot's file, as for a training."""
        return {"evaluation": {"randomisation": implied_worlds(content, below)}}

    def idle_settings(self) -> dict[str, str]:
        """Those of the evaluation."""
        return within("evaluation", self.evaluation)


def run(options: EvaluateOptions, folder: RunFolder) -> Evaluation:
    """Evaluate, and show the walks that were recorded side by side."""
    settings = options.evaluation
    if settings.model == "reduced":
        options.robot.refuse_full_options()
    evaluated = evaluate(options.run, settings, options.robot.spec(), folder)
    if settings.records:
        write_evaluated_walks(evaluated, settings.model, folder.path)
    return evaluated


def taken_over(options: EvaluateOptions) -> TakenOver | None:
    """Leg and physics of the run, and the worlds that it was trained in."""
    learned = FinishedRun.read(options.run)
    learned.refuse_other_robot(options.robot, options.afresh)
    return None if options.afresh else learned.handed_on_with_worlds("evaluation")


VERB = Verb(EvaluateOptions, run, taken_over=taken_over)
