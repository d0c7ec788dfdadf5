"""Robots on Ray's workers: those of this process, bit for bit, whatever happens to the workers."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.base.executor import ExecutorSettings, WorkerError
from pneumorph.base.workers import connected
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.robot.robot import Robot
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.shared_simulator import SharedSimulator

DESIGNS = ("1.0.0.2.2.0.0.1", "0.1.2.0.2.0.3.0", "1.0.2.0.3.0.0.0", "1.2.0.0.0.0.3.3")
TOLD = ("forward_position_mm", "left_position_mm", "heading_deg", "status", "range_ratio",
        "hub_load_share", "tilt_deg")  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def local_ray() -> Iterator[None]:
    pytest.importorskip("ray")
    with connected(2, None):
        yield


@pytest.fixture(scope="module")
def spec() -> RobotSpec:
    return RobotOptions.of("measured").spec()


@pytest.fixture(scope="module")
def robots(spec: RobotSpec) -> list[Robot]:
    return [spec.assembly(design) for design in DESIGNS]


@pytest.fixture(scope="module")
def worlds() -> list[World]:
    rng = np.random.default_rng(3)
    return [measured_worlds().draw(rng) for _ in DESIGNS]


def shared(spec: RobotSpec, count: int, attempts: int = 3) -> RobotSpec:
    return replace(spec, executor=ExecutorSettings("ray", count, attempt_limit=attempts))


def walked(simulator, count: int) -> list[np.ndarray]:
    """What a simulator says on a way with robots that stand still and are put back."""
    rng, found = np.random.default_rng(1), []

    def note() -> None:
        found.extend(np.array(getattr(simulator, name)) for name in TOLD)

    note()
    for some in (None, np.arange(count) % 3 != 1):
        simulator.advance(90.0 * rng.random((count, 3)), 12, some)
        note()
    simulator.reset(np.arange(count) == 1)
    note()
    simulator.advance(90.0 * rng.random((count, 3)), 7)
    note()
    simulator.forget_range(np.arange(count) % 2 == 0)
    note()
    simulator.reset()
    simulator.advance(90.0 * rng.random((count, 3)), 6)
    note()
    return found


def same(one: list[np.ndarray], two: list[np.ndarray]) -> None:
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(("drawn", "counts"), [(True, (1, 6)), (False, (3,))])
def test_any_number_of_workers_has_the_same_bits(
    drawn: bool, counts: tuple[int, ...], spec: RobotSpec, robots: list[Robot], worlds: list[World]
) -> None:
    """Of six workers two have no robot."""
    own = worlds if drawn else None
    expected = walked(spec.simulator_in_worlds(robots, own), len(robots))
    assert np.ptp(expected[7]) > 0.0
    for count in counts:
        same(walked(shared(spec, count).simulator_in_worlds(robots, own), len(robots)), expected)


def test_other_robots_take_their_place(
    spec: RobotSpec, robots: list[Robot], worlds: list[World]
) -> None:
    here, there = (each.simulator_in_worlds(robots, worlds) for each in (spec, shared(spec, 2)))
    for chosen in ([2, 0, 1, 1, 3], [3], [0, 1, 2, 3]):
        for simulator in (here, there):
            simulator.set_robots(
                [robots[number] for number in chosen], [worlds[number] for number in chosen]
            )
        same(walked(there, len(chosen)), walked(here, len(chosen)))
    for simulator in (here, there):
        simulator.set_robots(robots[::-1])  # the worlds stay
    same(walked(there, 4), walked(here, 4))


def kill(simulator: SharedSimulator, number: int) -> None:
    remote = simulator._workers[number]
    process = simulator._place.fetch(remote._object.__ray_call__.remote(lambda _: os.getpid()))
    os.kill(process, signal.SIGKILL)


def test_a_lost_worker_is_taken_over(
    spec: RobotSpec, robots: list[Robot], worlds: list[World]
) -> None:
    here, there = (each.simulator_in_worlds(robots, worlds) for each in (spec, shared(spec, 2)))
    rng = np.random.default_rng(5)
    assert isinstance(there, SharedSimulator)
    other = there._workers[0]._object
    for action in range(4):
        command = 90.0 * rng.random((4, 3))
        if action == 2:
            kill(there, 1)
        for simulator in (here, there):
            simulator.advance(command, 8, np.arange(4) != action)
        np.testing.assert_array_equal(there.forward_position_mm, here.forward_position_mm)
    assert there._workers[0]._object is other


def test_workers_that_always_die_are_given_up(
    spec: RobotSpec, robots: list[Robot], worlds: list[World]
) -> None:
    there = shared(spec, 2, attempts=1).simulator_in_worlds(robots, worlds)
    assert isinstance(there, SharedSimulator)
    kill(there, 0)
    with pytest.raises(WorkerError, match="worker of some robots died 1 times"):
        there.advance(np.zeros((4, 3)), 5)


def test_a_refused_robot_is_refused_as_here(spec: RobotSpec, robots: list[Robot]) -> None:
    there = shared(spec, 1).simulator_in_worlds(robots[:1], None)
    with pytest.raises(ValueError, match="expected"):
        there.advance(np.zeros((1, 2)), 5)
