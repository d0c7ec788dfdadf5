"""A search beside a run compares gaits in one set of worlds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.short_training import SHORT_FINETUNING
from helpers.synthetic_part import synthetic_reduced_part
from jax.random import PRNGKey

from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.learn.evaluation import EVALUATION_SEED
from pneumorph.learn.gait_search import GaitSearchSettings
from pneumorph.learn.networks import Policy
from pneumorph.learn.objective import Objective
from pneumorph.learn.policy_file import load_policy
from pneumorph.simulation.randomised_simulator import worlds_of_round
from pneumorph.study import run_beside_search
from pneumorph.study import search as study
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.search import search
from pneumorph.study.search_findings import DesignsBestGait, SearchFindings
from pneumorph.study.search_options import SearchOptions
from pneumorph.study.search_settings import SearchSettings

SEED = 3


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """A robust training of another seed than searches have."""
    folder = tmp_path_factory.mktemp("learned")
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(folder / "leg.npz")
    robust = (
        "--randomize --randomisation.mass-factor U(0.8,1.2) --randomisation.modulus-factor 1 "
        f"--objective.kind mean_minus_deviations --objective.worlds-per-design 4 --seed {SEED} "
        "--objective.evaluation-worlds 4 "
        "--certified-world-count 0"
    )
    asked = f"coopt --part {leg} --out {folder / 'run'} {SHORT_FINETUNING} {robust}"
    assert run(asked.split()) == 0
    return FinishedRun.read(folder / "run")


def searched(learned: FinishedRun, folder: Path, **changes: Any) -> SearchFindings:
    """The gaits of the run's designs, with the settings that it hands on but for some."""
    settings = SearchSettings(
        timesteps=200,
        random_design_count=0,
        environment_count=8,
        gaits=GaitSearchSettings(population=4),
        task=learned.task,
        space=learned.space,
        objective=learned.objective or Objective(),
    )
    asked = replace(settings, **changes)
    place = RunFolder(folder, "search")
    return search(asked, learned.spec(), place, learned, learned.worlds)


def by_run(found: SearchFindings, rank: int) -> DesignsBestGait:
    (row,) = [row for row in found.designs or () if row.why == f"L{rank}"]
    return row


def test_the_runs_worlds_are_handed_on(learned: FinishedRun, tmp_path: Path) -> None:
    """By its seed: its pairs achieve there what it says that they do."""
    taken = SearchOptions(run=learned.folder).taken_over
    assert taken is not None
    assert taken.settings["search"]["seed"] == SEED
    found = searched(learned, tmp_path, seed=SEED)
    for rank, pair in enumerate(learned.pairs(), 1):
        # Its gait's file has pressures to a thousandth.
        assert by_run(found, rank).learned_distance_cm == pytest.approx(pair.distance_cm, abs=0.01)


def test_of_another_seed_the_runs_pairs_walk_in_the_worlds_of_the_search(
    learned: FinishedRun, tmp_path: Path
) -> None:
    """Those that its gaits and the policy are judged in."""
    found, drawn = searched(learned, tmp_path, seed=5), learned.worlds
    assert drawn is not None
    worlds = worlds_of_round(drawn, 5, EVALUATION_SEED, 4)
    for rank, pair in enumerate(learned.pairs(), 1):
        achieved, *_ = walks_in_worlds(
            learned.spec(), [pair.design], [pair.gait], worlds,
            learned.task.settling_step_count, RunFolder(tmp_path, "walks"), learned.goal,
        )  # fmt: skip
        there = float(np.nan_to_num(achieved).mean())
        row = by_run(found, rank)
        assert row.learned_distance_cm == pytest.approx(there, abs=1e-3)
        assert row.learned_achieved == row.learned_distance_cm
        assert abs(there - (pair.distance_cm or 0.0)) > 0.005
    (note,) = [note for note in found.notes if "fine-tuned policy" in note]
    assert note.startswith("own gait, shared policy and fine-tuned policy of a design are in the "
                           "same 4 worlds")  # fmt: skip


def test_in_one_world_they_walk_in_that(learned: FinishedRun, tmp_path: Path) -> None:
    found = searched(learned, tmp_path, objective=Objective())
    for rank, pair in enumerate(learned.pairs(), 1):
        told = by_run(found, rank).learned_distance_cm
        assert told is not None
        assert abs(told - (pair.distance_cm or 0.0)) > 0.005
    (note,) = [note for note in found.notes if "fine-tuned policy" in note]
    assert "are in the world as it stands" in note


def test_a_policy_of_other_observations_is_left_out(
    learned: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A task of one's own may show more than the robots of the package do."""
    _, settings, _ = load_policy(learned.folder / "training" / "policy.npz")
    size = settings.task.state_size + settings.space.feature_count
    policy = Policy(size + 3, settings.task.regulator_count, settings.sac.hidden_sizes, PRNGKey(0))
    monkeypatch.setattr(run_beside_search, "load_policy", lambda _: (policy, settings, {}))
    found = searched(learned, tmp_path, objective=Objective())
    said = f"it observes {size + 3} numbers, and robots that crawl here show {size}"
    assert [said in note for note in found.notes].count(True) == 1
    assert by_run(found, 1).policy_distance_cm is None
    assert by_run(found, 1).learned_distance_cm is not None


@pytest.mark.parametrize(("method", "every"), [("gaits", True), ("random", False)])
def test_a_search_of_gaits_asks_for_the_best_of_every_design(
    learned: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, every: bool
) -> None:
    asked: dict[str, Any] = {}

    def instead(*_: Any, **options: Any) -> None:
        asked.update(options)
        raise InterruptedError

    monkeypatch.setattr(study, "run_search", instead)
    with pytest.raises(InterruptedError):
        searched(learned, tmp_path, method=method)
    assert asked["every_design"] is every
