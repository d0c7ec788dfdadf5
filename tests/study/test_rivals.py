"""What shares nothing with learning gets the time, the worlds and the goal of the training."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example
from helpers.short_training import SHORT_FINETUNING
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.learn.objective import Objective
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.study import rivals
from pneumorph.study.certified_candidates import CertificateSettings, worlds_of_training
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.rivals import (
    METHODS,
    Found,
    Method,
    learned,
    learned_timesteps,
    searched,
    uniform,
    worlds_of,
)
from pneumorph.study.robustness import WalksInWorlds, walks_in_worlds
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.search_settings import SearchSettings

WORLDS = 6


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """A robust training of robots that are to turn."""
    folder = tmp_path_factory.mktemp("turning")
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(folder / "leg.npz")
    robust = (
        "--randomize --randomisation.mass-factor U(0.8,1.2) --randomisation.modulus-factor 1 "
        "--objective.kind mean_minus_deviations --objective.worlds-per-design 4 "
        "--objective.evaluation-worlds 4 "
        "--certified-world-count 0 --task.reward.goal turn_left"
    )
    asked = f"coopt --part {leg} --out {folder / 'run'} {SHORT_FINETUNING} {robust}"
    assert run(asked.split()) == 0
    return FinishedRun.read(folder / "run")


def test_searches_get_the_time_of_the_training(turning: FinishedRun, tmp_path: Path) -> None:
    asked = learned_timesteps(turning)
    assert asked == 60 + 2 * 20
    for method in METHODS:
        contender = searched(turning, method, tmp_path)
        if contender is not None:  # some robots may have failed in every world
            # Whole generations, which of the few actions here may be several times as many.
            assert contender.timesteps >= asked
            achieved = contender.walked(turning, RunFolder(tmp_path, "walks"), WORLDS)
            found = Found.of(contender, achieved, np.full(WORLDS, -1e9))
            assert found.band.low <= found.band.high
            assert found.share_beyond_expert == 1.0


def asked_of(run: FinishedRun, method: Method, monkeypatch: pytest.MonkeyPatch, work: Path) -> Any:
    """What is asked of a search beside a training."""

    class AskedError(Exception):
        pass

    asked: list[SearchSettings] = []

    def instead(settings: SearchSettings, *_: Any) -> None:
        asked.append(settings)
        raise AskedError

    monkeypatch.setattr(rivals, "search", instead)
    with pytest.raises(AskedError):
        searched(run, method, work)
    return asked[0]


@pytest.mark.parametrize("method", METHODS)
def test_walks_that_rank_gaits_are_within_the_time(
    turning: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: Method
) -> None:
    """20 actions rank a gait: 5 in each of 4 worlds. 24 gaits are ranked where the time is long, no
    more than a third of it counts for that where it is short, but for one of each design."""
    evaluations = turning.of_summary("evaluation_timesteps", int)
    # Of the end: four designs first in a quarter of the worlds or all, and the two finalists.
    assert evaluations >= 6 * 20
    for told, count in ((10_000, 24), (20 * 15 - 100, 5)):
        longer = replace(turning, summary={**turning.summary, "evaluation_timesteps": told})
        assert learned(longer).timesteps == 100 + told
        asked = asked_of(longer, method, monkeypatch, tmp_path / str(told))
        assert asked.finalist_count == count
        assert asked.timesteps == 100 + told - count * 20


def test_beside_a_training_of_an_earlier_version_neither_counts_them(
    turning: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that what was kept beside it is of the same settings."""
    summary = {k: v for k, v in turning.summary.items() if k != "evaluation_timesteps"}
    earlier = replace(turning, summary=summary)
    assert learned(earlier).timesteps == learned_timesteps(earlier) == 100
    asked = asked_of(earlier, "random", monkeypatch, tmp_path)
    assert (asked.timesteps, asked.finalist_count) == (100, SearchSettings().finalist_count)


def test_the_genetic_algorithm_has_generations_where_the_time_is_short(
    turning: FinishedRun, tmp_path: Path
) -> None:
    """100 timesteps are 5 candidates in 4 worlds of 5 actions."""
    _ = searched(turning, "genetic", tmp_path)
    (settings,) = tmp_path.glob("*/genetic/settings.json")
    asked = json.loads(settings.read_text())["search"]
    assert asked["genetic"]["population"] == 2
    (curve,) = tmp_path.glob("*/genetic/learning_curve.json")
    assert len(json.loads(curve.read_text())["timesteps"]) >= 3


def test_searches_get_as_much_time_in_the_nominal_world(
    turning: FinishedRun, tmp_path: Path
) -> None:
    """Each beginning of a training has its own."""
    coopt = {**turning.settings["coopt"], "restarts": 2}
    coopt["objective"] = {**coopt["objective"], "nominal_until_timestep": 30}
    twice = replace(turning, settings={**turning.settings, "coopt": coopt})
    _ = searched(twice, "random", tmp_path)
    (settings,) = tmp_path.glob("*/random/settings.json")
    objective = json.loads(settings.read_text())["search"]["objective"]
    assert objective["nominal_until_timestep"] == 60


def test_a_learned_pair_is_told_in_the_unit_of_its_goal(
    turning: FinishedRun, tmp_path: Path
) -> None:
    pair = learned(turning)
    achieved = pair.walked(turning, RunFolder(tmp_path, "walks"), WORLDS)
    forward = pair.walked(_forward(turning), RunFolder(tmp_path, "walks"), WORLDS)
    assert achieved.shape == (WORLDS,)
    assert (achieved != forward).all()


def _forward(run: FinishedRun) -> FinishedRun:
    """The run as if its robots had been asked to go forward."""
    coopt = dict(run.settings["coopt"])
    task = {**coopt["task"], "reward": {**coopt["task"]["reward"], "goal": "forward"}}
    return replace(run, settings={**run.settings, "coopt": {**coopt, "task": task}})


def test_the_best_uniform_robot_is_chosen_as_the_training_chose(
    turning: FinishedRun, tmp_path: Path
) -> None:
    """Counted anew: of so few, each walks in all of the training's worlds."""
    designs, phases = ("1.0.0.2.2.0.0.1", "0.1.0.2.0.1.0.0"), (0.0, 90.0)
    best = uniform(turning, designs, phases, tmp_path)
    objective, lasting = turning.objective, turning.pairs(1)[0].gait.duration_s
    assert isinstance(objective, Objective)
    worlds, _ = worlds_of_training(objective, worlds_of(turning), 0, CertificateSettings())
    scores = {}
    for design in designs:
        for phase in phases:
            gait = replace(turning.baseline.gait, phase_deg=phase, duration_s=lasting)
            achieved, *_ = walks_in_worlds(
                turning.spec(), [Design.parse(design)], [gait], worlds,
                turning.task.settling_step_count, RunFolder(tmp_path, "walks"), turning.goal,
            )  # fmt: skip
            scores[design, phase] = float(objective.of(np.nan_to_num(achieved).T)[0])
    expected = max(scores, key=lambda each: scores[each])
    assert (str(best.design), best.gait.phase_deg) == expected
    # Kept: the same call walks nothing.
    again = uniform(turning, designs, phases, tmp_path)
    assert again.wall_s == best.wall_s


def test_uniform_robots_walk_for_as_long_as_the_pairs(turning: FinishedRun, tmp_path: Path) -> None:
    """As the expert of a certificate does, whatever the run's own baseline lasts."""
    lasting = turning.pairs(1)[0].gait.duration_s
    best = uniform(turning, ["1.0.0.2.2.0.0.1"], [0.0], tmp_path)
    assert best.gait.duration_s == lasting != turning.baseline.gait.duration_s
    # One that an earlier version kept, of the baseline's duration, is not taken for it.
    (kept,) = tmp_path.glob("*/uniform/settings.json")
    asked = json.loads(kept.read_text())
    assert asked.pop("duration_s") == lasting
    kept.write_text(json.dumps(asked))
    with pytest.raises(ValueError, match=r"other settings \(duration_s is None there"):
        uniform(turning, ["1.0.0.2.2.0.0.1"], [0.0], tmp_path)


def test_what_learning_took_is_without_its_certificate(turning: FinishedRun) -> None:
    """Which searches have not either; the training's own time has it."""
    certified = {**turning.summary, "wall_s": turning.of_summary("wall_s", float) + 1e4}
    took = learned(replace(turning, summary=certified)).wall_s
    assert 0.0 < took == learned(turning).wall_s < turning.of_summary("wall_s", float)


def test_a_uniform_robot_that_fails_is_behind_one_that_goes_backward(
    turning: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What failed in some worlds is no better for it; what failed in all has no score."""
    designs, nan = ("1.0.0.2.2.0.0.1", "0.1.0.2.0.1.0.0", "1.1.0.2.2.0.0.1"), np.nan
    told = {
        "some": np.array([[nan, -1.0, nan], [nan, -1.0, -3.0], [nan, -1.0, nan], [nan, -1.0, nan]]),
        "none": np.full((4, 3), nan),
    }

    def walked(_: Any, chosen: Any, __: Any, worlds: Any, *___: Any) -> WalksInWorlds:
        columns = [designs.index(str(each)) for each in chosen]
        achieved = told[name][: len(worlds), columns]
        return WalksInWorlds(achieved, np.ones_like(achieved), np.zeros_like(achieved))

    monkeypatch.setattr(rivals, "walks_in_worlds", walked)
    for name, best, score in (("some", designs[1], -1.0), ("none", designs[0], None)):
        work = tmp_path / name
        for _ in range(2):  # made, and read
            assert str(uniform(turning, designs, [0.0], work).design) == best
        (kept,) = work.glob("*/uniform/summary.json")
        assert json.loads(kept.read_text())["score"] == score


def test_rivals_of_a_leg_that_was_written_again_are_refused(
    turning: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its file is called as before. Earlier versions did not keep what it was."""
    nothing = replace(example(SearchFindings), status="completed", pairs=(), designs=None)
    monkeypatch.setattr(rivals, "search", lambda *_: nothing)
    part = turning.robot.part
    assert part is not None
    before, own = part.read_bytes(), ReducedPart.load(part)
    _ = uniform(turning, ["1.0.0.2.2.0.0.1"], [0.0], tmp_path)
    _ = searched(turning, "random", tmp_path)
    try:
        scaled_part(own, 0.97, 1.0).save(part)
        with pytest.raises(ValueError, match=r"uniform holds a run of other settings \(leg "):
            uniform(turning, ["1.0.0.2.2.0.0.1"], [0.0], tmp_path)
        with pytest.raises(ValueError, match=r"random holds a run of other settings \(leg "):
            searched(turning, "random", tmp_path)
        for file in tmp_path.glob("*/*/settings.json"):
            asked = json.loads(file.read_text())
            assert all(asked.pop(name, file) != file for name in ("leg", "identity", "calibration"))
            file.write_text(json.dumps(asked))
        _ = uniform(turning, ["1.0.0.2.2.0.0.1"], [0.0], tmp_path)
        _ = searched(turning, "random", tmp_path)
    finally:
        part.write_bytes(before)
