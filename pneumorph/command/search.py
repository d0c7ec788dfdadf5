"""Search for gaits or designs without learning a policy, to see how good the learned ones are.

--method gaits looks for the best gait of each design alone, by CMA-ES over all numbers of the gait:
of the expert's design, of a coopt run's best pairs (--run), of --designs, and of designs drawn at
random. With --run the policy's own distance stands beside each. --method random and --method
genetic search designs and gaits together, with as much simulated time as a coopt run of equal
--timesteps; their learning curves compare with its own. In the measured physics they have the
worlds, the objective and the reward of a training there. All robots walk side by side in the
reduced model. A stopped search goes on with the same --out.

Writes search.jsonl, learning_curve.json and the best gaits as gaits/DESIGN.csv.

Example: pneumorph search --method genetic --timesteps 1000000 --out runs/genetic
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import USUAL, RobotOptions, described_robot
from pneumorph.command.verb import Verb, flat
from pneumorph.learn.objective import Objective
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.finished_run import FinishedRun, TakenOver
from pneumorph.study.search import SearchFindings, SearchSettings, search
from pneumorph.study.usual_aim import other_physics, usual_aim, usual_worlds


@dataclass(frozen=True)
class SearchOptions:
    """What is searched, and which robots walk."""

    run: Path | None = None
    """A coopt run, whose robots, task and space are taken over."""
    search: Annotated[SearchSettings, flat] = field(
        default_factory=lambda: settings_from_dict(SearchSettings, usual_aim(USUAL))
    )
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    randomisation: Randomisation = field(default_factory=measured_worlds)
    """What worlds are drawn from, where --objective.worlds-per-design asks for several."""

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """Worlds, objective and reward that the physics brings, as for a training; the designs and
        the regulators that a robot's file brings."""
        robot, physics = described_robot(content), other_physics(content, below)
        of_physics = (
            {}
            if physics is None
            else {"search": usual_aim(physics), "randomisation": usual_worlds(physics)}
        )
        of_robot = {} if robot is None else {"search": robot.training_settings()}
        return laid_over(of_physics, of_robot)


def run(options: SearchOptions, folder: RunFolder) -> SearchFindings:
    """Search as the options say."""
    learned = None if options.run is None else FinishedRun.read(options.run)
    return search(options.search, options.robot.spec(), folder, learned, options.randomisation)


def taken_over(options: SearchOptions) -> TakenOver | None:
    """Robots, task, space, objective and worlds of the run."""
    if options.run is None:
        return None
    learned = FinishedRun.read(options.run)
    ranked_by = learned.objective or Objective()
    asked = {
        "task": settings_to_dict(learned.task),
        "space": settings_to_dict(learned.space),
        "objective": settings_to_dict(ranked_by),
    }
    return learned.handed_on(
        {**learned.taken_over("robot", "randomisation"), "search": asked},
        "leg, physics, worlds, task and designs",
    )


VERB = Verb(SearchOptions, run, taken_over=taken_over)
