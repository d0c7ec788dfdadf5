"""After training each of the best designs gets a policy that learned on it alone."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.toy_coopt import (
    SPACE,
    TASK,
    TIME_STEP_S,
    best_distances_cm,
    make_simulator,
    toy_settings,
)

from pneumorph.environment.viscous_crawler import viscous_crawler_robot
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.walk import walk
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.networks import Policy
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.settings import FinetuningSettings
from pneumorph.robot.design import Design

SETTINGS = replace(
    toy_settings(round_count=12),
    finetuning=FinetuningSettings(finalist_count=2, timesteps=4_000, updates_per_vector_step=4),
    kept_pair_count=1,
)


class Killed(Exception):
    """Stands for the end of the process."""


def run(folder: Path, **options: Any) -> CooptResult:
    return learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, SETTINGS),
        SETTINGS,
        folder,
        time_step_s=TIME_STEP_S,
        **options,
    )


def walk_of(policy: Policy, design: Design) -> tuple[np.ndarray, float]:
    """Pressures that the policy holds for a design, which sees its own last actions alone [kPa],
    and how far they walk it [cm]."""
    memory, held = np.zeros(TASK.state_size, np.float32), []
    for _ in range(TASK.action_count):
        seen = np.concatenate([memory, design.one_hot(TASK.regulator_count)])[None]
        action = np.asarray(policy.mode(seen))[0]
        held.append(TASK.pressure_kPa(action))
        memory = np.concatenate([action, memory[: -TASK.regulator_count]])
    gait = HeldGait.evenly(np.array(held), TASK.action_step_count * TIME_STEP_S)
    return gait.held_kPa, distance_cm(gait, design)


def distance_cm(gait: HeldGait, design: Design) -> float:
    walked = walk(
        make_simulator([design]),
        [gait],
        duration_s=gait.duration_s,
        time_step_s=TIME_STEP_S,
        settling_step_count=TASK.settling_step_count,
    )
    return float(walked.distance_cm[0])


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was killed where its fine-tuning would have begun."""
    folder = tmp_path_factory.mktemp("trained")

    def progress(done: int, total: int, message: str) -> None:
        if message == "evaluating the best designs":
            raise Killed

    with pytest.raises(Killed):
        run(folder, progress=progress)
    return folder


@pytest.fixture(scope="module")
def finetuned(trained: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("finetuned")
    shutil.copytree(trained, folder, dirs_exist_ok=True)
    return folder, run(folder, resume=True)


def test_finetuning_improves_a_policy_that_has_not_converged(
    finetuned: tuple[Path, CooptResult],
) -> None:
    folder, summary = finetuned
    # The trained policy is the one that was evaluated and kept; what is better came after it.
    assert summary.policy_best_design is not None
    policy, _, _ = load_policy(folder / "policy.npz")
    _, far_cm = walk_of(policy, Design.parse(summary.policy_best_design))
    # float32 sums of a batch of one and of sixteen differ in their last digits.
    assert summary.policy_best_distance_cm == pytest.approx(far_cm, abs=1e-4)
    assert summary.best.distance_cm > summary.policy_best_distance_cm
    assert summary.best.distance_cm < 1.05 * best_distances_cm().max()
    assert summary.finetuning_timesteps == 2 * 4096  # whole rounds of 256 timesteps
    # The evaluation, of a design or its image, and the two finalists.
    designs = len(set(map(SPACE.twin, range(len(SPACE)))))
    assert summary.evaluation_timesteps == (designs + 2) * TASK.action_count
    assert summary.timesteps == SETTINGS.total_timesteps


def test_the_pair_is_the_own_gait_of_the_better_finetuned_policy(
    finetuned: tuple[Path, CooptResult],
) -> None:
    folder, summary = finetuned
    (pair,) = summary.pairs
    assert pair.source == "policy"
    gait, _ = read_gait(folder / pair.gait)
    walks = {}
    for file in (folder / "finetuned").iterdir():
        policy, _, _ = load_policy(file)
        walks[file.stem] = walk_of(policy, Design.parse(file.stem))
    best_kPa, best_cm = walks[pair.design]
    assert best_cm == max(far_cm for _, far_cm in walks.values())
    # float32 sums of a batch of one and of sixteen differ in their last digits.
    np.testing.assert_allclose(gait.held_kPa, best_kPa, atol=1e-3)
    assert distance_cm(gait, Design.parse(pair.design)) == pytest.approx(pair.distance_cm, abs=1e-9)
    # No design is the other's mirror image.
    finalists = {SPACE.index(Design.parse(design)) for design in walks}
    assert len({min(index, int(SPACE.mirror_index[index])) for index in finalists}) == 2


def test_a_run_killed_while_fine_tuning_goes_on_with_the_next_design(
    trained: Path, finetuned: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    def progress(done: int, total: int, message: str) -> None:
        if message == "fine-tuning" and done > total / 2:
            raise Killed

    shutil.copytree(trained, tmp_path, dirs_exist_ok=True)
    with pytest.raises(Killed):
        run(tmp_path, resume=True, progress=progress)
    (first,) = (tmp_path / "finetuned").iterdir()
    written = first.stat().st_mtime_ns
    summary = run(tmp_path, resume=True)
    assert first.stat().st_mtime_ns == written
    assert summary.pairs == finetuned[1].pairs
