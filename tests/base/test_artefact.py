"""Files are written whole or not at all, and what is wrong with one is told with its name."""

from __future__ import annotations

import resource
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import (
    ArtefactError,
    load_artefact,
    read_json,
    read_text,
    reading,
    save_artefact,
    write_json,
    write_text,
)


@contextmanager
def room_for(byte_count: int) -> Iterator[None]:
    """Files may grow to this size only: the system refuses more, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (byte_count, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("kind", ["text", "table", "arrays"])
def test_a_file_that_finds_no_room_is_named_and_stays_as_it_was(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "kept"
    path.write_text("as it was")
    noise = np.random.default_rng(0).random(5000)
    write = {
        "text": lambda: write_text(path, str(noise.tolist())),
        "table": lambda: write_json(path, {"numbers": noise.tolist()}),
        "arrays": lambda: save_artefact(path, "Noise", 1, {"noise": noise}, {}),
    }[kind]
    with room_for(2000), pytest.raises(OSError, match=f"'{path}'"):
        write()
    assert path.read_text() == "as it was"
    assert list(tmp_path.iterdir()) == [path]


def test_text_is_written_as_it_is(tmp_path: Path) -> None:
    path = write_text(tmp_path / "made/text", "90 °\r\nand on\n")
    assert path.read_bytes() == b"90 \xc2\xb0\r\nand on\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x93\xff\x00", "gait file .*file is not text .* it is binary"),
        (b'{"a": 1', "gait file .*file is not valid JSON .* it is truncated"),
        (b"[" * 100_000, "gait file .*file is not valid JSON"),
        (b'{"a": {"b": 1, "c": 2, "b": 3}}', "gait file .*file has 'b' twice in one table"),
        (b"[1, 2]", "gait file .*file holds a list, expected a table"),
        (b'{"a": ' + 5000 * b"1" + b"}", "gait file .*file is not valid JSON .*4300 digits"),
    ],
)
def test_what_is_no_table_is_told_with_its_name(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(ArtefactError, match=message):
        read_json(path, "gait")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"gait file .*nowhere does not exist"):
        read_text(tmp_path / "nowhere", "gait")


def test_a_folder_in_place_of_a_file_is_told_with_the_file_that_it_holds(tmp_path: Path) -> None:
    """As a run's folder, which is not damaged; in it are files of other kinds, and any others."""
    run = tmp_path / "run"
    save_artefact(run / "a.npz", "Mesh", 1, {}, {})
    (run / "broken.npz").write_text("no archive")
    np.savez(run / "foreign.npz", nodes=np.zeros(3))
    np.savez(run / "list.npz", metadata=np.array("[]"))
    with pytest.raises(ArtefactError, match=r"run is a folder, expected a Part file: it holds non"):
        load_artefact(run, "Part", 1)
    part = save_artefact(run / "leg.npz", "Part", 1, {}, {})
    with pytest.raises(ArtefactError) as told:
        load_artefact(run, "Part", 1)
    assert str(told.value) == (
        f"{run} is a folder, expected a Part file: give {part}, which is one"
    )
    assert load_artefact(part, "Part", 1)[1]["kind"] == "Part"


def test_what_goes_wrong_inside_a_file_is_told_with_its_name() -> None:
    def trip(error: Exception) -> None:
        with reading("some.npz", "mesh"):
            raise error

    with pytest.raises(ArtefactError, match=r"mesh file some\.npz cannot be read \(nodes is miss"):
        trip(KeyError("nodes"))
    with pytest.raises(ArtefactError, match=r"mesh file some\.npz cannot be read \(a value is"):
        trip(TypeError("unhashable"))
    with pytest.raises(ValueError, match=r"^some\.npz is too large$"):
        trip(ValueError("some.npz is too large"))
    with pytest.raises(AssertionError):
        trip(AssertionError())


def test_an_array_whose_shape_has_no_end_is_refused_with_the_files_name(tmp_path: Path) -> None:
    """As one wrong byte may make it."""
    path = save_artefact(tmp_path / "part.npz", "part", 1, {"nodes": np.zeros((2, 3))}, {})
    damaged = tmp_path / "damaged.npz"
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(damaged, "w") as written:
        for name in whole.namelist():
            written.writestr(name, whole.read(name).replace(b"(2, 3)", b"(2, 3 "))
    with pytest.raises(ArtefactError, match=r"damaged\.npz"):
        load_artefact(damaged, "part", 1)
