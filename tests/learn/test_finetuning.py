"""After training each of the best designs gets a policy that learned on it alone."""

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
from pneumorph.gait.walk import walk
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import cooptimise
from pneumorph.learn.environments import crawling
from pneumorph.learn.policy_file import load_policy
from pneumorph.learn.settings import FinetuningSettings
from pneumorph.robot.design import Design

SETTINGS = replace(
    toy_settings(round_count=12),
    finetuning=FinetuningSettings(finalist_count=3, timesteps=4_000, updates_per_vector_step=4),
    kept_pair_count=2,
)


class Killed(Exception):
    """Stands for the end of the process."""


def run(folder: Path, finetune: bool = True, **options: Any) -> CooptResult:
    settings = SETTINGS if finetune else replace(SETTINGS, finetuning=FinetuningSettings(3, 0))
    return cooptimise(
        crawling(viscous_crawler_robot, make_simulator, settings),
        settings,
        folder,
        time_step_s=TIME_STEP_S,
        **options,
    )


@pytest.fixture(scope="module")
def finetuned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CooptResult]:
    folder = tmp_path_factory.mktemp("finetuned")
    return folder, run(folder)


def test_finetuning_improves_a_policy_that_has_not_converged(
    finetuned: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    _, summary = finetuned
    plain = run(tmp_path, finetune=False)
    # Both evaluate the same trained policy; what differs came after it.
    assert summary.policy_best_distance_cm == plain.policy_best_distance_cm
    assert summary.best.distance_cm > plain.policy_best_distance_cm
    assert summary.best.distance_cm < 1.05 * best_distances_cm().max()
    assert plain.finetuning_timesteps == 0
    assert summary.finetuning_timesteps == 3 * 4096  # whole rounds of 256 timesteps
    assert summary.timesteps == plain.timesteps


def test_pairs_are_the_finetuned_policies_own_gaits(
    finetuned: tuple[Path, CooptResult],
) -> None:
    folder, summary = finetuned
    assert len(summary.pairs) == 2
    assert len(list((folder / "finetuned").iterdir())) == 3
    for pair in summary.pairs:
        assert pair.source == "policy"
        gait, _ = read_gait(folder / pair.gait)
        design = Design.parse(pair.design)
        # The design's own policy sees its own last actions alone: the gait follows from it.
        policy, _, _ = load_policy(folder / "finetuned" / f"{design}.npz")
        memory, held = np.zeros(TASK.state_size, np.float32), []
        for _ in range(TASK.action_count):
            seen = np.concatenate([memory, design.one_hot(TASK.regulator_count)])[None]
            action = np.asarray(policy.mode(seen))[0]
            held.append(TASK.pressure_kPa(action))
            memory = np.concatenate([action, memory[: -TASK.regulator_count]])
        # float32 sums of a batch of one and of sixteen differ in their last digits.
        np.testing.assert_allclose(gait.held_kPa, held, atol=1e-3)
        walked = walk(
            make_simulator([design]),
            [gait],
            duration_s=gait.duration_s,
            time_step_s=TIME_STEP_S,
            settling_step_count=TASK.settling_step_count,
        )
        np.testing.assert_allclose(walked.distance_cm[0], pair.distance_cm, atol=1e-9)
    twins = {SPACE.index(Design.parse(pair.design)) for pair in summary.pairs}
    assert len({min(twin, int(SPACE.mirror_index[twin])) for twin in twins}) == 2


def test_a_run_killed_while_fine_tuning_goes_on_with_the_next_design(
    finetuned: tuple[Path, CooptResult], tmp_path: Path
) -> None:
    def progress(done: int, total: int, message: str) -> None:
        if message == "fine-tuning" and done > total / 2:
            raise Killed

    with pytest.raises(Killed):
        run(tmp_path, progress=progress)
    (first,) = (tmp_path / "finetuned").iterdir()
    written = first.stat().st_mtime_ns
    summary = run(tmp_path, resume=True)
    assert first.stat().st_mtime_ns == written
    assert summary.pairs == finetuned[1].pairs
