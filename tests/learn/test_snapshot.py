"""A training's folder tells how it stands, while it is written and when it is finished."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from helpers.toy_coopt import make_simulator, toy_settings

from pneumorph.base.artefact import ArtefactError, read_json
from pneumorph.base.result import result_from_dict
from pneumorph.gait.gait_file import read_gait
from pneumorph.learn.checkpoint import NEWEST, PREVIOUS
from pneumorph.learn.coopt_result import SUMMARY_FILE, CooptResult
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.metrics import METRICS_FILE
from pneumorph.learn.snapshot import TrainingSnapshot, training_snapshot

SETTINGS = toy_settings(round_count=4)


@pytest.fixture(scope="module")
def folder_and_moments(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, list[TrainingSnapshot]]:
    """A finished training, and the snapshots taken after each of its rounds."""
    folder = tmp_path_factory.mktemp("training")
    moments = [training_snapshot(folder / "not there yet", SETTINGS)]

    def look(done: int, total: int, message: str) -> None:
        moments.append(training_snapshot(folder, SETTINGS))

    learn_in_folder(
        crawling(lambda design: design, make_simulator, SETTINGS), SETTINGS, folder, progress=look
    )
    return folder, moments


def test_snapshots_follow_a_training(
    folder_and_moments: tuple[Path, list[TrainingSnapshot]],
) -> None:
    _, (before, *rounds, last) = folder_and_moments
    assert (before.timestep, before.pairs, before.last_round_s_ago) == (0, [], None)
    step = SETTINGS.timesteps_per_round
    assert [each.timestep for each in rounds] == [step, 2 * step, 3 * step, 4 * step]
    # Checkpoints are made every round here, so the pairs are those of the same moment.
    for each in rounds:
        assert each.pairs_timestep == each.timestep
        best = each.metrics[-1]["best_distance_cm"]
        assert each.pairs[0].distance_cm == pytest.approx(best)
        assert len(each.pairs) <= SETTINGS.kept_pair_count
    assert [each.is_finished for each in (before, *rounds, last)] == [False] * 4 + [True] * 2


def test_a_finished_training_shows_what_it_found(
    folder_and_moments: tuple[Path, list[TrainingSnapshot]], tmp_path: Path
) -> None:
    """Also where its checkpoints hold no pairs, as of robots in drawn worlds."""
    folder, _ = folder_and_moments
    shutil.copytree(folder, tmp_path / "run")
    found = result_from_dict(CooptResult, read_json(folder / SUMMARY_FILE, "JSON"))
    for name in (NEWEST, PREVIOUS):
        (tmp_path / "run" / name).unlink()
    shown = training_snapshot(tmp_path / "run", SETTINGS)
    assert shown.pairs_timestep is None
    assert [str(SETTINGS.space[each.design]) for each in shown.pairs] == [
        each.design for each in found.pairs
    ]
    assert [each.score_cm for each in shown.pairs] == [each.score_cm for each in found.pairs]
    gait, _ = read_gait(folder / found.pairs[0].gait)
    np.testing.assert_array_equal(shown.pairs[0].held_kPa, gait.held_kPa)


def test_a_damaged_checkpoint_is_left_alone_and_the_one_before_is_read(
    folder_and_moments: tuple[Path, list[TrainingSnapshot]], tmp_path: Path
) -> None:
    folder, _ = folder_and_moments
    for name in (NEWEST, PREVIOUS, METRICS_FILE):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    half = (folder / NEWEST).read_bytes()[:1000]
    (tmp_path / NEWEST).write_bytes(half)
    step = SETTINGS.timesteps_per_round
    assert training_snapshot(tmp_path, SETTINGS).pairs_timestep == 3 * step
    assert (tmp_path / NEWEST).read_bytes() == half
    (tmp_path / PREVIOUS).write_bytes(half)
    with pytest.raises(ArtefactError, match="truncated"):
        training_snapshot(tmp_path, SETTINGS)
