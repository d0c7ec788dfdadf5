"""In which worlds the candidates of a search walk, and what it took."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.learn.objective import Objective
from pneumorph.learn.search_run import LOG_FILE, SearchResult
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import RandomisedSimulator
from pneumorph.study import search as study
from pneumorph.study.search import SPENT_FILE, search
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


def test_what_a_stopped_search_took_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a folder that is refused nothing is written, and a search that begins anew has no time
    behind it."""
    ends: list[Exception | None] = []

    def instead(*asked: Any, progress: Any, **_: Any) -> SearchResult:
        end = ends.pop(0)
        if isinstance(end, ValueError):  # a search of other settings is there
            raise end
        (asked[4] / LOG_FILE).touch()
        progress(0, 8, "searching")
        time.sleep(0.05)
        progress(8, 8, "searching")
        if end is not None:
            raise end
        return SearchResult({}, np.array([8]), np.array([np.nan]), {}, 0)

    monkeypatch.setattr(study, "run_search", instead)
    asked = SearchSettings(method="random", timesteps=8, environment_count=1)
    robot, folder = paper_robot("published"), RunFolder(tmp_path, "search")

    def took_s(*ending: Exception | None) -> float:
        ends[:] = [*ending, None]
        for each in ending:
            with pytest.raises(type(each)):
                search(asked, robot, folder)
        return search(asked, robot, folder).wall_s

    ends[:] = [ValueError("other settings")]
    with pytest.raises(ValueError, match="other settings"):
        search(asked, robot, folder)
    assert list(tmp_path.iterdir()) == []
    assert took_s(_MadeError(), _MadeError()) >= 0.15
    kept = json.loads((tmp_path / SPENT_FILE).read_text())
    assert kept["wall_s"] >= 0.15
    (tmp_path / SPENT_FILE).write_text(json.dumps({"wall_s": 1e6}))
    assert took_s() > 1e6
    (tmp_path / LOG_FILE).unlink()
    assert took_s() < 1e6
