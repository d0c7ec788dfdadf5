"""One way to write and read every saved thing: an npz file whose ``metadata`` entry is JSON.

The metadata names the kind of artefact, the version of its format, its units and the settings that
made it. Files are written beside their target and renamed, so a reader never sees half of one.
"""

from __future__ import annotations

import csv
import json
import lzma
import math
import os
import tempfile
import tokenize
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

UNITS = {"length": "mm", "mass": "kg", "time": "s", "force": "mN", "pressure": "kPa"}


# What zipfile and numpy raise for bytes that are no npz; a byte may turn into another compression
# (NotImplementedError), a password (RuntimeError), an array of objects (ValueError) or a shape
# without an end (TokenError).
_UNREADABLE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, ValueError, LookupError, TypeError,
    AttributeError, ArithmeticError, EOFError, OSError, RuntimeError, SyntaxError, MemoryError,
    tokenize.TokenError,
)  # fmt: skip


class ArtefactError(ValueError):
    """A file is not the artefact it was asked to be: wrong kind, version or mesh, or truncated."""


@contextmanager
def reading(path: Path | str, kind: str) -> Iterator[None]:
    """Whatever goes wrong with what a file holds is told with the file's name.

    Args:
        path: The file.
        kind: What it should hold, such as ``gait``.

    Raises:
        ArtefactError: What is done meanwhile found a value missing, of the wrong type or out of
            range.
    """
    try:
        yield
    except (
        ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError,
        csv.Error,
    ) as error:  # fmt: skip
        if isinstance(error, ValueError) and str(path) in str(error):
            raise
        what = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        if isinstance(error, TypeError | AttributeError):
            what = "a value is of another kind than expected"  # Python's words help nobody
        raise ArtefactError(
            f"{kind} file {path} cannot be read ({what}); it is damaged or was written by another "
            "program"
        ) from error


def read_text(path: Path | str, kind: str) -> str:
    """Text of a file, UTF-8 with or without a byte order mark.

    Args:
        path: The file.
        kind: What it should hold, such as ``gait``.

    Raises:
        FileNotFoundError: No such file.
        IsADirectoryError: It is a folder.
        ArtefactError: It is no text.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"{kind} file {path} does not exist")
    if path.is_dir():
        raise IsADirectoryError(f"{kind} file {path} is a folder, expected a file")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ArtefactError(
            f"{kind} file {path} is not text ({error}); it is binary or damaged"
        ) from error


def read_json(path: Path | str, kind: str) -> dict[str, Any]:
    """Table of values of a JSON file.

    Args:
        path: The file.
        kind: What it should hold, such as ``calibration``.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It is no JSON, or not a table.
    """
    return table_of_json(read_text(path, kind), path, kind)


def table_of_json(text: str, path: Path | str, kind: str) -> dict[str, Any]:
    """Table of values of a JSON file's text; as `read_json`."""
    try:
        content = json.loads(text, object_pairs_hook=_named_once)
    except _NamedTwice as error:
        raise ArtefactError(
            f"{kind} file {path} has {error} twice in one table, expected once: it is not known "
            "which of the two is meant"
        ) from error
    except (ValueError, RecursionError) as error:  # also a number of thousands of digits
        raise ArtefactError(
            f"{kind} file {path} is not valid JSON ({error}); it is truncated or of another format"
        ) from error
    if not isinstance(content, dict):
        raise ArtefactError(
            f"{kind} file {path} holds a {type(content).__name__}, expected a table of values"
        )
    return content


class _NamedTwice(Exception):
    """The name of a value that a JSON table holds two of."""


def _named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A table of JSON, which Python would fill with the last of values of one name."""
    content = dict(pairs)
    if len(content) < len(pairs):
        counted = Counter(name for name, _ in pairs)
        raise _NamedTwice(repr(counted.most_common(1)[0][0]))
    return content


def write_atomically(path: Path | str, write: Callable[[BinaryIO], object]) -> Path:
    """Write a file through a temporary sibling and rename it over ``path``; return ``path``.

    Raises:
        OSError: The disk is full or refuses; names the file, which stays as it was.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException as error:
        Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno is not None:
            raise OSError(error.errno, os.strerror(error.errno), str(path)) from error
        raise
    return path


def write_text(path: Path | str, text: str) -> Path:
    """Write ``text`` as UTF-8 with its line ends as they are, atomically; return ``path``.

    Raises:
        OSError: As of `write_atomically`.
    """
    return write_atomically(path, lambda stream: stream.write(text.encode()))


def write_json(path: Path | str, content: Mapping[str, Any]) -> Path:
    """Write ``content`` as indented JSON, atomically; NaN and infinity are refused."""
    return write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def save_artefact(
    path: Path | str,
    kind: str,
    version: int,
    arrays: Mapping[str, np.ndarray],
    metadata: Mapping[str, Any],
) -> Path:
    """Save named arrays and JSON metadata as one compressed npz file.

    Args:
        path: Where to write.
        kind: Name of the class, such as ``ReducedPart``.
        version: Version of the format of that kind.
        arrays: Named arrays; no object arrays.
        metadata: What else describes the artefact; JSON-serialisable.
    """
    header = {**metadata, "kind": kind, "format_version": version, "units": UNITS}
    content: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
    content["metadata"] = np.array(json.dumps(header))
    return write_atomically(path, lambda stream: np.savez_compressed(stream, **content))


def load_artefact(
    path: Path | str, kind: str, *versions: int, leave: Collection[str] = ()
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read what `save_artefact` wrote.

    Args:
        path: The file.
        kind: What it must hold.
        *versions: Format versions that are understood.
        leave: Arrays that are not read; `stream_rows` reads large ones in blocks.

    Returns:
        The arrays by name, and the metadata.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: The file is truncated, of another kind or of another format version, or it is
            a folder.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"{kind} file {path} does not exist")
    if path.is_dir():
        inside = next((each for each in sorted(path.glob("*.npz")) if _is_of(each, kind)), None)
        raise ArtefactError(
            f"{path} is a folder, expected a {kind} file: "
            + ("it holds none" if inside is None else f"give {inside}, which is one")
        )
    try:
        with np.load(path, allow_pickle=False) as archive:
            names = [name for name in archive.files if name not in ("metadata", *leave)]
            arrays = {name: archive[name] for name in names}
            metadata = json.loads(str(archive["metadata"]))
    except _UNREADABLE as error:
        raise ArtefactError(
            f"{path} is not a readable {kind} file ({_said(error)}); it is truncated or was not "
            "written by pneumorph"
        ) from error
    if not isinstance(metadata, dict):
        raise ArtefactError(
            f"{path} has a {type(metadata).__name__} as metadata, expected a table; it was not "
            "written by pneumorph"
        )
    if metadata.get("kind") != kind:
        raise ArtefactError(f"{path} holds a {metadata.get('kind')}, expected a {kind}")
    if metadata.get("format_version") not in versions:
        raise ArtefactError(
            f"{path} has {kind} format version {metadata.get('format_version')}, this pneumorph "
            f"reads version {' and '.join(map(str, versions))}; make the file again or install the "
            "matching release"
        )
    return arrays, metadata


def _is_of(path: Path, kind: str) -> bool:
    """Whether a file says that it holds an artefact of a kind."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return bool(json.loads(str(archive["metadata"]))["kind"] == kind)
    except _UNREADABLE:
        return False


def _said(error: BaseException) -> str:
    """What went wrong with bytes that are no npz, without numpy's advice to load them unsafely."""
    if "allow_pickle" in str(error):
        return "it is no npz archive of plain arrays"
    return " ".join(str(error).split())


def stream_rows(path: Path | str, name: str, row_count: int) -> Iterator[np.ndarray]:
    """Read an array of a file in blocks of rows, so that it never lies in memory as a whole.

    Args:
        path: A file that `save_artefact` wrote.
        name: The array.
        row_count: Rows in a block; the last may have fewer.

    Raises:
        ArtefactError: The file is truncated, or its rows do not follow one another.
    """
    try:
        with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as stream:
            version = np.lib.format.read_magic(stream)
            read_header = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, column_major, dtype = read_header(stream)
            if column_major:
                raise ArtefactError(f"{name} of {path} must be stored row after row")
            row_bytes = dtype.itemsize * math.prod(shape[1:])
            for start in range(0, shape[0], row_count):
                count = min(row_count, shape[0] - start)
                content = stream.read(count * row_bytes)
                yield np.frombuffer(content, dtype).reshape(count, *shape[1:])
    except _UNREADABLE as error:
        if isinstance(error, ArtefactError):
            raise
        raise ArtefactError(f"{name} of {path} is truncated or missing ({_said(error)})") from error
