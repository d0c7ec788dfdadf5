"""Finite elements beside the reduced robot, walked once and kept."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.boxes import box_robot as spec

from pneumorph.base.executor import Backend, ExecutorSettings
from pneumorph.base.run_folder import RunFolder
from pneumorph.environment.goal import FORWARD
from pneumorph.fem.time_integration import StepError
from pneumorph.gait.held_gait import HeldGait
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.study import certificate, certified_walks
from pneumorph.study.analysis import Walker
from pneumorph.study.certified_candidates import CertificateSettings
from pneumorph.study.certified_pairs import Band, CertifiedPair
from pneumorph.study.certified_walks import FullOrderWalk, KeptWalk, LaggingGait, full_order_walks
from pneumorph.study.robustness import WalksInWorlds
from pneumorph.trajectory import Trajectory

WORLD = World(0.7, 1.1, 0.9, 0.05, 1.0, mounting_angle_deg=1.0)
GAIT = HeldGait.evenly(np.array([[20.0, 0.0], [5.0, 30.0]]), 0.04)


def test_a_walk_is_made_once_in_its_world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, folder = spec(), RunFolder(tmp_path / "run", "certify")

    def walked(world: World | None, design: str = "1.2", settling: int = 2) -> KeptWalk:
        walker = Walker("L1", Design.parse(design), GAIT, settling)
        return full_order_walks(robot, [(walker, world)], folder)[0]

    nominal, drawn = walked(None), walked(WORLD)
    for file in (tmp_path / "run/full_order").glob("*.json"):  # as earlier versions kept them
        assert {"ground", "start"}.isdisjoint(json.loads(file.read_text())["made_of"]["physics"])
    assert (nominal.status, drawn.status) == ("completed", "completed")
    assert nominal.achieved != pytest.approx(drawn.achieved, abs=1e-6)
    # As the robot in that world walks the lagging commands.
    own = robot.in_world(WORLD)
    assert own.mounting_angle_deg == 1.0
    lagging = LaggingGait.of(GAIT, 0.05, 0.01)
    assert lagging.pressure_kPa(0.04)[0] != GAIT.pressure_kPa(0.04)[0]

    def never(*_: object, **__: object) -> None:
        raise AssertionError("walked again")

    monkeypatch.setattr(certified_walks, "resumable_rollout", never)
    assert walked(WORLD) == drawn
    # Finite elements know of no reduction, and threads change no bit.
    assert walked(replace(WORLD, reduction="other.npz")) == drawn
    robot = replace(robot, full_order=replace(robot.full_order, thread_count=2))
    assert walked(WORLD) == drawn
    with pytest.raises(AssertionError, match="walked again"):
        walked(None, "2.1")
    with pytest.raises(AssertionError, match="walked again"):
        walked(WORLD, settling=3)

    def fails(*_: object, **__: object) -> None:
        raise StepError("while it settles")

    monkeypatch.setattr(certified_walks, "resumable_rollout", fails)
    failed = walked(WORLD, "2.1")
    assert (failed.status, failed.achieved) == ("diverged", None)
    assert failed.reason == walked(WORLD, "2.1").reason == "while it settles"
    monkeypatch.setattr(certified_walks, "resumable_rollout", never)
    kept = robot
    for changed in (
        replace(kept, physics=replace(kept.physics, friction=0.3)),
        replace(kept, hub_model="soft"),
        replace(kept, mounting_angle_deg=1.0),
    ):
        robot = changed
        with pytest.raises(AssertionError, match="walked again"):
            walked(WORLD)


def test_a_walk_that_went_on_tells_the_time_of_what_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = certified_walks.resumable_rollout

    def went_on(*asked: Any, resumed: Callable[[float], None], **settings: Any) -> Trajectory:
        resumed(1e4)
        return whole(*asked, **settings)

    monkeypatch.setattr(certified_walks, "resumable_rollout", went_on)
    walker = Walker("L1", Design.parse("1.2"), GAIT, 2)
    (kept,) = full_order_walks(spec(), [(walker, None)], RunFolder(tmp_path, "certify"))
    assert kept.status == "completed"
    assert 1e4 < kept.wall_s < 2e4


def test_the_checkpoint_of_a_walk_stays_until_the_walk_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it cannot be written, as on a full disk, what was walked is not lost."""
    whole = certified_walks.resumable_rollout
    gait = HeldGait.evenly(np.repeat(GAIT.held_kPa, 2, axis=0), 0.04)  # of two frames
    walker = Walker("L1", Design.parse("1.2"), gait, 2)

    def often(*asked: Any, **settings: Any) -> Trajectory:
        return whole(*asked, **settings, checkpoint_every_s=0.0)

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    def walked() -> list[KeptWalk]:
        return full_order_walks(spec(), [(walker, None)], RunFolder(tmp_path, "certify"))

    monkeypatch.setattr(certified_walks, "resumable_rollout", often)
    with monkeypatch.context() as patch:
        patch.setattr(certified_walks, "write_json", full)
        with pytest.raises(OSError, match="no space left"):
            walked()
    told: list[float] = []

    def again(*asked: Any, resumed: Callable[[float], None], **settings: Any) -> Trajectory:
        return often(*asked, resumed=told.append, **settings)

    monkeypatch.setattr(certified_walks, "resumable_rollout", again)
    (kept,) = walked()
    assert (kept.status, len(told)) == ("completed", 1)
    assert not list(tmp_path.rglob("*_on_its_way.npz"))


def test_a_walk_that_an_earlier_version_gave_up_is_walked_again(tmp_path: Path) -> None:
    """Steps are halved more often now; a reason that is kept says that this was tried."""
    robot, walker, folder = (
        spec(),
        Walker("L1", Design.parse("1.2"), GAIT, 2),
        RunFolder(tmp_path, "certify"),
    )
    (found,) = full_order_walks(robot, [(walker, None)], folder)
    (file,) = tmp_path.glob("full_order/*.json")
    kept = json.loads(file.read_text())
    fewer = replace(robot, full_order=replace(robot.full_order, step_halvings=4))
    assert full_order_walks(fewer, [(walker, None)], folder) == [found]  # the same file
    given_up = {**kept, "status": "diverged", "distance_cm": None}
    file.write_text(json.dumps({**given_up, "reason": "why"}))
    (again,) = full_order_walks(robot, [(walker, None)], folder)
    assert (again.status, again.reason) == ("diverged", "why")
    file.write_text(json.dumps(given_up))
    (again,) = full_order_walks(robot, [(walker, None)], folder)
    assert replace(again, wall_s=0.0) == replace(found, wall_s=0.0)


@pytest.mark.parametrize("backend", ["processes", "ray"])
def test_walks_of_two_workers_are_those_of_one(tmp_path: Path, backend: Backend) -> None:
    """To the last digit, states included; one that is there is not made again."""
    if backend == "ray":
        pytest.importorskip("ray")
    robot, walker = spec(), Walker("L1", Design.parse("1.2"), GAIT, 2)
    asked = [(walker, None), (walker, WORLD), (replace(walker, design=Design.parse("2.1")), None)]
    alone, shared = RunFolder(tmp_path / "alone", "certify"), RunFolder(tmp_path / "two", "certify")
    in_turn = full_order_walks(robot, asked, alone, ExecutorSettings(process_count=1))
    full_order_walks(robot, asked[:1], shared)
    made = full_order_walks(robot, asked, shared, ExecutorSettings(backend, 2))
    assert [replace(each, wall_s=0.0) for each in made] == [
        replace(each, wall_s=0.0) for each in in_turn
    ]
    for walk in made:
        assert walk.states is not None
        one, two = (np.load(folder / walk.states) for folder in (alone, shared))
        for name in set(one) - {"metadata"}:
            np.testing.assert_array_equal(one[name], two[name])


@pytest.mark.parametrize(
    ("full", "reduced", "agrees"),
    [(20.0, 20.55, True), (20.0, 20.65, False), (1.0, 0.71, True), (1.0, 0.6, False),
     (None, 1.0, False), (1.0, None, False)],
)  # fmt: skip
def test_agreement_is_by_share_or_by_length(
    full: float | None, reduced: float | None, agrees: bool
) -> None:
    walk = FullOrderWalk.of(None, KeptWalk(full, "completed", 1.0), reduced)
    assert walk.agrees is agrees
    assert walk.parts is (not agrees and full is not None)


def test_finite_elements_stand_beside_the_robots_own_legs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in a world that has another reduction of them, where the pair achieves least."""
    asked: list[list[World]] = []

    def walked(spec: object, walkers: Sequence[Walker], worlds: list[World], *_: object) -> Any:
        asked.append(worlds)
        unknown = np.full((len(worlds), len(walkers)), np.nan)
        return WalksInWorlds(np.full_like(unknown, 3.0), unknown, unknown)

    kept = KeptWalk(3.1, "completed", 1.0)
    monkeypatch.setattr(certificate, "_walked", walked)
    monkeypatch.setattr(
        certificate, "full_order_walks", lambda spec, asked, *_: [kept for _ in asked]
    )
    band = Band.of(np.zeros(10))
    pair = CertifiedPair(
        "L1", "1.2", "gait.csv", 5.0, band, 1.0, None, None, 0.0, None, (), 0.0, ()
    )
    worlds = [WORLD, replace(WORLD, reduction="other.npz"), replace(WORLD, friction=0.4)]
    settings = CertificateSettings(worst_world_count=2)
    (found,) = certificate._with_full_order(
        spec(),
        settings,
        [Walker("L1", Design.parse("1.2"), GAIT, 2)],
        [pair],
        0,
        worlds,
        np.array([[4.0], [1.0], [2.0]]),
        RunFolder(tmp_path, "certify"),
        FORWARD,
    )
    assert asked[0] == [WORLD]  # the second, on the robot's own legs
    reduced = [(each.world, each.reduced) for each in found.full_order]
    assert reduced == [(None, 5.0), (1, 3.0), (2, 2.0)]
    near = [round(worlds[0].friction, 1) for worlds in asked[1:]]
    assert near == [round(spec().physics.friction, 1), 0.7, 0.4]
    assert {each.reduction for worlds in asked[1:] for each in worlds} == {""}
    said = [(each.near_low, each.near_high, each.repeats) for each in found.full_order]
    assert said == [(3.0, 3.0, False), (3.0, 3.0, True), (3.0, 3.0, False)]
