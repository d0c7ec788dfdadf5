"""A checkpoint is whole or it is not used, and that is said."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.corruption import Reader, damaged_npz, few
from helpers.toy_coopt import make_simulator, toy_settings
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_to_dict
from pneumorph.learn.checkpoint import (
    KIND,
    VERSION,
    load_checkpoint,
    read_checkpoint,
    save_checkpoint,
)
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling
from pneumorph.learn.training import Training

SETTINGS = toy_settings(round_count=2)
new_training = partial(
    Training, crawling(lambda design: design, make_simulator, SETTINGS), SETTINGS
)


def whole(timestep: int = 0) -> dict[str, Any]:
    """What a training says beside its arrays."""
    return {
        **new_training().metadata(),
        "timestep": timestep,
        "settings": settings_to_dict(SETTINGS),
        "provenance": {},
        "wall_s": 0.0,
        "remarks": ["resumed"],
    }


METADATA = whole()


def save(folder: Path, number: int) -> Path:
    noise = np.random.default_rng(number).normal(size=1000)
    return save_checkpoint(folder, {"noise": noise}, {**METADATA, "timestep": number})


def test_newest_is_read_and_previous_is_kept(tmp_path: Path) -> None:
    for number in range(3):
        save(tmp_path, number)
    checkpoint = load_checkpoint(tmp_path)
    assert checkpoint.metadata["timestep"] == 2
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
    assert checkpoint.metadata["timestep"] == 0
    assert "truncated" in str(checkpoint.remark)


def test_damage_inside_is_noticed(tmp_path: Path) -> None:
    save(tmp_path, 0)
    newest = save(tmp_path, 1)
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 0xFF
    newest.write_bytes(content)
    with pytest.warns(UserWarning, match="previous checkpoint is used"):
        assert load_checkpoint(tmp_path).metadata["timestep"] == 0


def test_kill_between_the_two_renames_leaves_the_previous(tmp_path: Path) -> None:
    save(tmp_path, 0)
    save(tmp_path, 1).unlink()
    with pytest.warns(UserWarning, match=r"checkpoint\.npz does not exist"):
        assert load_checkpoint(tmp_path).metadata["timestep"] == 0


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
        assert load_checkpoint(tmp_path).metadata["timestep"] == 0
    assert (tmp_path / "checkpoint.damaged.npz").exists()


def without(name: str) -> dict[str, Any]:
    return {key: value for key, value in METADATA.items() if key != name}


@pytest.mark.parametrize(
    ("metadata", "what"),
    [
        *((without(name), rf"required field missing @ \$\.{name}") for name in (
            "timestep", "update_count", "failure_count", "seconds", "random_state", "settings",
            "provenance", "wall_s", "remarks")),
        (METADATA | {"timestep": 1.5}, r"expected int @ \$\.timestep"),
        (METADATA | {"timestep": "1"}, r"expected int @ \$\.timestep"),
        (METADATA | {"update_count": None}, r"expected int @ \$\.update_count"),
        (METADATA | {"seconds": {"learn": "long"}}, r"expected float @ \$\.seconds\['learn'\]"),
        (METADATA | {"seconds": 3}, r"expected a mapping @ \$\.seconds"),
        (METADATA | {"remarks": [1]}, r"expected str @ \$\.remarks\[0\]"),
        (METADATA | {"settings": "usual"}, r"expected a mapping @ \$\.settings"),
        (METADATA | {"random_state": {}}, r"expected str @ \$\.random_state"),
    ],
)  # fmt: skip
def test_metadata_that_lack_or_mistake_a_field_are_refused_with_file_and_field(
    tmp_path: Path, metadata: dict[str, Any], what: str
) -> None:
    save_checkpoint(tmp_path, {"noise": np.zeros(3)}, metadata)
    with pytest.raises(ArtefactError, match=rf"(?s)checkpoint\.npz.*{what}.*no previous"):
        load_checkpoint(tmp_path)


def test_metadata_that_are_no_json_are_refused_with_the_file(tmp_path: Path) -> None:
    for text in ("{", "[]", "\0"):
        np.savez(tmp_path / "checkpoint.npz", metadata=np.array(text), noise=np.zeros(3))
        with pytest.raises(ArtefactError, match=r"checkpoint\.npz .*(not a readable|expected)"):
            load_checkpoint(tmp_path)


def test_damaged_metadata_of_the_newest_are_replaced_by_the_previous(tmp_path: Path) -> None:
    save(tmp_path, 0)
    save_checkpoint(tmp_path, {"noise": np.zeros(3)}, without("random_state"))
    with pytest.warns(UserWarning, match=r"previous checkpoint is used.*\$\.random_state"):
        assert load_checkpoint(tmp_path).metadata["timestep"] == 0


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"random_state": "{}"}, "random_state"),
        ({"random_state": "three"}, "random_state"),
        ({"random_state": json.dumps({"bit_generator": "PCG64", "state": 1})}, "random_state"),
        ({"round_level": {}}, "seen is missing"),
        ({"settings": {"seed": "first"}}, "seed: expected int, got 'first'"),
        ({"settings": {"sed": 1}}, "sed"),
    ],
)
def test_a_training_does_not_go_on_from_damaged_metadata(
    tmp_path: Path, changed: dict[str, Any], what: str
) -> None:
    save_checkpoint(tmp_path, new_training().arrays(), METADATA | changed)
    with pytest.raises(ArtefactError, match=rf"checkpoint\.npz .*{what}"):
        learn_in_folder(
            crawling(lambda design: design, make_simulator, SETTINGS),
            SETTINGS,
            tmp_path,
            resume=True,
        )


TRAINING = new_training()
CHECKPOINT = Reader(
    "checkpoint.npz",
    lambda path: save_checkpoint(path.parent, TRAINING.arrays(), METADATA),
    lambda path: TRAINING.take_over(read_checkpoint(path)),
)


@few
@given(data=st.data())
def test_whatever_a_checkpoint_lacks_or_mistakes_it_is_read_or_refused_by_name(
    data: st.DataObject,
) -> None:
    CHECKPOINT.refusal(data.draw(damaged_npz(CHECKPOINT.whole)))


def test_an_older_checkpoint_without_a_round_level_is_read(tmp_path: Path) -> None:
    assert (KIND, VERSION) == ("CooptCheckpoint", 1)
    save_checkpoint(tmp_path, new_training().arrays(), without("round_level"))
    training = new_training()
    training.take_over(load_checkpoint(tmp_path))
    assert training.timestep == 0
