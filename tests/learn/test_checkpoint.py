"""A checkpoint is whole or it is not used, and that is said."""

from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.learn.checkpoint import load_checkpoint, save_checkpoint


def save(folder: Path, number: int) -> Path:
    noise = np.random.default_rng(number).normal(size=1000)
    return save_checkpoint(folder, {"noise": noise}, {"number": number})


def test_newest_is_read_and_previous_is_kept(tmp_path: Path) -> None:
    for number in range(3):
        save(tmp_path, number)
    checkpoint = load_checkpoint(tmp_path)
    assert checkpoint.metadata["number"] == 2
    assert checkpoint.remark is None
    np.testing.assert_array_equal(
        checkpoint.arrays["noise"], np.random.default_rng(2).normal(size=1000)
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "checkpoint.npz",
        "checkpoint.previous.npz",
    ]


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.99])
def test_truncated_newest_is_replaced_by_the_previous(tmp_path: Path, kept: float) -> None:
    save(tmp_path, 0)
    newest = save(tmp_path, 1)
    content = newest.read_bytes()
    newest.write_bytes(content[: int(kept * len(content))])
    with pytest.warns(UserWarning, match="previous checkpoint is used.*newest one fails"):
        checkpoint = load_checkpoint(tmp_path)
    assert checkpoint.metadata["number"] == 0
    assert "truncated" in str(checkpoint.remark)


def test_damage_inside_is_noticed(tmp_path: Path) -> None:
    save(tmp_path, 0)
    newest = save(tmp_path, 1)
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 0xFF
    newest.write_bytes(content)
    with pytest.warns(UserWarning, match="previous checkpoint is used"):
        assert load_checkpoint(tmp_path).metadata["number"] == 0


def test_kill_between_the_two_renames_leaves_the_previous(tmp_path: Path) -> None:
    save(tmp_path, 0)
    save(tmp_path, 1).unlink()
    with pytest.warns(UserWarning, match=r"checkpoint\.npz does not exist"):
        assert load_checkpoint(tmp_path).metadata["number"] == 0


def test_nothing_readable_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="holds no checkpoint"):
        load_checkpoint(tmp_path)
    save(tmp_path, 0).write_bytes(b"")
    with pytest.raises(ArtefactError, match="no previous checkpoint"):
        load_checkpoint(tmp_path)
    save(tmp_path, 1).write_bytes(b"PK")
    with pytest.raises(ArtefactError, match="previous checkpoint fails too"):
        load_checkpoint(tmp_path)


def test_after_a_fallback_a_kill_still_leaves_the_good_one(tmp_path: Path) -> None:
    save(tmp_path, 0)
    newest = save(tmp_path, 1)
    newest.write_bytes(newest.read_bytes()[:-100])
    with pytest.warns(UserWarning, match="previous checkpoint is used"):
        load_checkpoint(tmp_path)
    save(tmp_path, 2).unlink()  # as if killed between the two renames
    with pytest.warns(UserWarning, match=r"checkpoint\.npz does not exist"):
        assert load_checkpoint(tmp_path).metadata["number"] == 0
    assert (tmp_path / "checkpoint.damaged.npz").exists()
