"""In which worlds the candidates of a search walk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.learn.objective import Objective
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import RandomisedSimulator
from pneumorph.study import search as study
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings


class _MadeError(Exception):
    """The environment is there."""


def test_a_search_begins_in_the_nominal_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until its objective's timestep, as a training does; then worlds are drawn, the same again for
    all that is walked again."""
    made: list[CrawlingEnvironment] = []

    def instead(_: Any, environment: CrawlingEnvironment, *__: Any, **___: Any) -> None:
        made.append(environment)
        raise _MadeError

    monkeypatch.setattr(study, "run_search", instead)
    objective = Objective("mean_minus_deviations", worlds_per_design=4, nominal_until_timestep=16)
    asked = SearchSettings(
        method="random", timesteps=32, environment_count=4, objective=objective, seed=3
    )
    robot = paper_robot("published")
    with pytest.raises(_MadeError):
        search(asked, robot, RunFolder(tmp_path, "search"))
    simulator = made[0].simulator
    assert isinstance(simulator, RandomisedSimulator)
    nominal = World.nominal(robot.physics)
    for seed in (0, 15):
        made[0].reset(seed=seed)
        assert simulator.worlds == [nominal] * 4
    made[0].reset(seed=16)
    drawn = simulator.worlds
    assert nominal not in drawn
    made[0].reset(seed=2**40)
    made[0].reset(seed=16)
    assert simulator.worlds == drawn
