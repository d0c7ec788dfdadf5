"""Worlds that robots are trained in, and the simulators that draw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_simulator import CrawlingSimulator, SimulatorFactory
from pneumorph.learn.objective import Objective
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import RandomisedSimulator, reduction_digests
from pneumorph.study.finished_run import FinishedRun


@dataclass(frozen=True)
class TrainingWorlds(Checked):
    """Worlds that robots are trained in, drawn anew every round."""

    randomisation: Randomisation = field(default_factory=Randomisation)
    """What they are drawn from."""
    world_count: Count = 8
    """Worlds side by side in a round."""
    nominal_until: CountOrNone = 0
    """Timestep of each beginning until which all robots walk in the nominal world."""

    @classmethod
    def of_objective(
        cls, randomisation: Randomisation, objective: Objective, world_count: int
    ) -> TrainingWorlds:
        """As many worlds as each design of a round walks in, where those are several.

        Args:
            randomisation: What they are drawn from.
            objective: What designs are ranked by.
            world_count: Worlds where designs walk in one each.
        """
        if not objective.is_robust:
            return cls(randomisation, world_count)
        return cls(randomisation, objective.worlds_per_design, objective.nominal_until_timestep)

    @classmethod
    def of_run(cls, run: FinishedRun, objective: Objective) -> TrainingWorlds | None:
        """Those of a finished training; None where it was made in one.

        Args:
            run: The run.
            objective: What its designs were ranked by.
        """
        if run.worlds is None:
            return None
        return cls.of_objective(run.worlds, objective, run.of_settings("world_count", int))

    def as_dict(self) -> dict[str, Any]:
        """Distributions and count by name, for summaries and checkpoints."""
        digests = reduction_digests(self.randomisation)
        return {
            **self.randomisation.described(),
            "world_count": self.world_count,
            **({"nominal_until": self.nominal_until} if self.nominal_until else {}),
            **({"reduction_digests": digests} if digests else {}),
        }


def simulator_factory(
    spec: RobotSpec, worlds: TrainingWorlds | None, seed: int
) -> SimulatorFactory:
    """What makes the simulator of a training's robots.

    Args:
        spec: The robots.
        worlds: Worlds that are drawn anew every round; None for one.
        seed: Of their draws.
    """
    if worlds is None:
        return lambda robots: spec.simulator_in_worlds(robots, None)

    def make(robots: Sequence[Any]) -> CrawlingSimulator:
        return RandomisedSimulator(
            robots,
            spec.physics,
            worlds.randomisation,
            seed,
            worlds.world_count,
            make=spec.simulator_in_worlds,
            nominal_until=worlds.nominal_until,
        )

    return make
