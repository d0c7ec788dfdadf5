"""Everything that decides a search, as the settings of its run hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pneumorph.base.flags import flat
from pneumorph.base.idle_settings import within
from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_settings import USUAL, described_robot
from pneumorph.learn.objective import Objective
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.brought_learning import brought_learning
from pneumorph.study.finished_run import FinishedRun, TakenOver
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.usual_aim import implied_worlds, other_physics, usual_aim


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
        the regulators that a robot's file brings, and the pressures of legs that were reduced
        for lower ones."""
        robot, physics = described_robot(content), other_physics(content, below)
        of_robot = brought_learning(content, below, robot)
        if robot is not None:
            of_robot["usual_design"] = robot.usual_design
        of_physics = {} if physics is None else usual_aim(physics)
        return {
            "search": laid_over(of_physics, of_robot),
            "randomisation": implied_worlds(content, below),
        }

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: of other methods, of worlds that nobody
        draws, and of an objective over one world."""
        asked = self.search
        of_methods = {
            "gaits": ("gaits", "designs", "random_design_count", "usual_design"),
            "random": ("random",),
            "genetic": ("genetic",),
        }
        found = {
            f"search.{name}": f"without --method {method}"
            for method, names in of_methods.items()
            for name in names
            if method != asked.method
        }
        if asked.method == "gaits":
            found["search.kept_pair_count"] = "without --method random or genetic"
        found |= within("search.objective", asked.objective)
        if asked.objective.centring_rounds:
            found["search.objective.centring_rounds"] = (
                "of a search, whose generations get better without easier worlds"
            )
        if not asked.objective.is_robust:
            several = "where candidates walk in one world (--objective.worlds-per-design 1)"
            found |= {"search.finalist_count": several, "randomisation": several}
        return found

    @property
    def taken_over(self) -> TakenOver | None:
        """Robots, task, space, objective, worlds and seed of the run; None without one. By its seed
        the worlds of an evaluation are those that the run ranked its pairs in.

        Raises:
            ArtefactError: The run is damaged.
        """
        if self.run is None:
            return None
        learned = FinishedRun.read(self.run)
        asked = {
            "task": settings_to_dict(learned.task),
            "space": settings_to_dict(learned.space),
            "objective": settings_to_dict(learned.objective or Objective()),
            "usual_design": learned.settings.get("baseline", {}).get("design", BASELINE_DESIGN),
        }
        if "seed" in learned.summary:
            asked["seed"] = learned.of_summary("seed", int)
        return learned.handed_on(
            {**learned.taken_over("robot", "randomisation"), "search": asked},
            "leg, physics, worlds, task and designs",
        )
