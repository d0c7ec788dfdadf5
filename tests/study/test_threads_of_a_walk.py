"""Finite elements of one robot take every processor, unless asked for a number of threads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.full_module import full_module

from pneumorph.catalogue import robot_spec
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.study import simulated_walk
from pneumorph.study.simulated_walk import WalkSettings, simulate
from pneumorph.study.study_once import study_folder


class Walked(Exception):
    """Stands for the walk, which is not looked at here."""


@pytest.mark.parametrize(("asked", "taken"), [(0, 5), (1, 1), (2, 2)])
def test_threads_of_a_walk(
    asked: int, taken: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def walk(robot: RobotSpec, *_: object, **__: object) -> None:
        assert robot.full_order == FullOrderSettings(thread_count=taken)
        raise Walked

    monkeypatch.setattr(robot_spec, "processor_count", lambda: 5)
    monkeypatch.setattr(simulated_walk, "recorded_walk", walk)
    robot = paper_robot("published")
    # Of modules that are known as finite elements alone too.
    module = full_module("a leg", robot.module.full)
    sites = tuple(replace(site, modules=(module,)) for site in robot.sites)
    full_order = replace(robot.full_order, thread_count=asked)
    robot = replace(robot, sites=sites, full_order=full_order)
    with pytest.raises(Walked):
        simulate(WalkSettings(model="full"), robot, study_folder(tmp_path, "simulate"))


def test_nobody_asks_for_a_number_of_threads_by_default() -> None:
    assert RobotOptions.of("measured").spec().full_order.thread_count == 0
