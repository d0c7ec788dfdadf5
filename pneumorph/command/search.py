"""Search for gaits or designs without learning a policy, to see how good the learned ones are.

--method gaits looks for the best gait of each design alone, by CMA-ES over all numbers of the gait:
of the expert's design, of a coopt run's best pairs (--run), of --designs, and of designs drawn at
random. With --run the policy's own distance stands beside each. --method random and --method
genetic search designs and gaits together, with as much simulated time as a coopt run of equal
--timesteps; their learning curves compare with its own. All robots walk side by side in the reduced
model. A stopped search goes on with the same --out.

Writes search.jsonl, learning_curve.json and the best gaits as gaits/DESIGN.csv.

Example: pneumorph search --method genetic --timesteps 1000000 --out runs/genetic
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions, described_robot
from pneumorph.command.verb import Verb, flat
from pneumorph.study.finished_run import FinishedRun, TakenOver
from pneumorph.study.search import SearchFindings, SearchSettings, search


@dataclass(frozen=True)
class SearchOptions:
    """What is searched, and which robots walk."""

    run: Path | None = None
    """A coopt run, whose robots, task and space are taken over."""
    search: Annotated[SearchSettings, flat] = field(default_factory=SearchSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        """The designs and the regulators that a robot's file brings with it."""
        robot = described_robot(content)
        return {} if robot is None else {"search": robot.training_settings()}


def run(options: SearchOptions, folder: RunFolder) -> SearchFindings:
    """Search as the options say."""
    learned = None if options.run is None else FinishedRun.read(options.run)
    return search(options.search, options.robot.spec(), folder, learned)


def taken_over(options: SearchOptions) -> TakenOver | None:
    """Robots, task and space of the run."""
    if options.run is None:
        return None
    learned = FinishedRun.read(options.run)
    asked = {"task": settings_to_dict(learned.task), "space": settings_to_dict(learned.space)}
    return learned.handed_on(
        {**learned.taken_over("robot"), "search": asked}, "leg, physics, task and designs"
    )


VERB = Verb(SearchOptions, run, taken_over=taken_over)
