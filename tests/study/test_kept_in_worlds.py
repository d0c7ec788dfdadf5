"""Walks in worlds that were stopped go on where they were, and read what is finished."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.study import robustness
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.robustness import KEPT_WALKS, WalksInWorlds, walks_in_worlds

WORLDS = unseen_worlds(Randomisation(), 6, 0)
DESIGNS = [Design.parse("1.0.0.2.2.0.0.1"), Design.parse("1.0.0.2.0.0.0.3")]
GAITS = [ExpertGait(duration_s=0.8), ExpertGait(phase_deg=60.0, duration_s=0.8)]
TOGETHER = 2


@pytest.fixture
def spec(tmp_path: Path) -> RobotSpec:
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(tmp_path / "leg.npz")
    return RobotOptions.of("published", part=leg, threads=1).spec()


class _Walks:
    """`walk`, which fails after a number of calls, and loses the first robot of each."""

    def __init__(self, calls: int | None) -> None:
        self.made, self._calls, self._walk = 0, calls, robustness.walk

    def __call__(self, *args, **kwargs):
        if self.made == self._calls:
            raise KeyboardInterrupt
        self.made += 1
        found = self._walk(*args, **kwargs)

        def achieved(goal: Goal) -> np.ndarray:
            return np.where(np.arange(len(found.range_ratio)) == 0, np.nan, found.achieved(goal))

        return SimpleNamespace(
            achieved=achieved, range_ratio=found.range_ratio, lean_deg=found.lean_deg
        )


def _walked(
    spec: RobotSpec,
    folder: Path,
    worlds: list[World] = WORLDS,
    gaits: list[OpenLoopGait] = GAITS,
    settling_steps: int = 2,
    goal: Goal = FORWARD,
    keep: bool = True,
) -> WalksInWorlds:
    run = RunFolder(folder, "certify")
    return walks_in_worlds(spec, DESIGNS, gaits, worlds, settling_steps, run, goal, keep=keep)


def test_stopped_walks_go_on(
    spec: RobotSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robustness, "SIDE_BY_SIDE", TOGETHER * len(DESIGNS))
    stopped = _Walks(2)
    monkeypatch.setattr(robustness, "walk", stopped)
    with pytest.raises(KeyboardInterrupt):
        _walked(spec, tmp_path / "run")
    again = _Walks(None)
    again._walk = stopped._walk
    monkeypatch.setattr(robustness, "walk", again)
    achieved, ratios, lean_deg = _walked(spec, tmp_path / "run")
    assert again.made == 1  # of three
    # To the bit what is walked without keeping anything, with what failed.
    plain, plain_ratios, plain_lean_deg = _walked(spec, tmp_path / "plain", keep=False)
    np.testing.assert_array_equal(achieved, plain)
    np.testing.assert_array_equal(ratios, plain_ratios)
    np.testing.assert_array_equal(lean_deg, plain_lean_deg)
    assert 0.0 < np.nanmin(lean_deg) < np.nanmax(lean_deg) < 180.0
    assert np.isnan(achieved[::TOGETHER, 0]).all()
    assert not np.isnan(achieved[1::TOGETHER]).any()
    assert not (tmp_path / "plain" / KEPT_WALKS).exists()


def test_what_decides_a_walk_tells_it_from_others(
    spec: RobotSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, walks = tmp_path / "run", _Walks(None)
    monkeypatch.setattr(robustness, "walk", walks)
    _walked(spec, folder)
    _walked(replace(spec, thread_count=2), folder)
    assert walks.made == 1  # threads change no bit
    other_worlds = [replace(world, damping_factor=1.3) for world in WORLDS]
    others = [
        {"worlds": other_worlds},
        {"gaits": [replace(gait, amplitude_kPa=44.0) for gait in GAITS]},
        {"settling_steps": 3},
        {"goal": Goal("turn_left")},
    ]
    specs = [
        replace(spec, physics=replace(spec.physics, gravity_mm_per_s2=9810.0)),
        replace(spec, stepper=replace(spec.stepper, contact_sweeps=99)),
        replace(spec, hub=spec.hub.scaled(1.1)),
        spec.scaled(modulus_factor=1.1),
        replace(spec, mounting_angle_deg=1.0),
    ]
    for count, changed in enumerate(others, start=2):
        _walked(spec, folder, **changed)
        assert walks.made == count
    for count, each in enumerate(specs, start=2 + len(others)):
        _walked(each, folder)
        assert walks.made == count
