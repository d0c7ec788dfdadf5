"""One way to write and read every saved thing: an npz file whose ``metadata`` entry is JSON.

The metadata names the kind of artefact, the version of its format, its units and the settings that
made it. Files are written beside their target and renamed, so a reader never sees half of one.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

UNITS = {"length": "mm", "mass": "kg", "time": "s", "force": "mN", "pressure": "kPa"}


class ArtefactError(ValueError):
    """A file is not the artefact it was asked to be: wrong kind, version or mesh, or truncated."""


def write_atomically(path: Path | str, write: Callable[[BinaryIO], object]) -> Path:
    """Write a file through a temporary sibling and rename it over ``path``; return ``path``."""
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
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return path


def write_json(path: Path | str, content: Mapping[str, Any]) -> Path:
    """Write ``content`` as indented JSON, atomically; NaN and infinity are refused."""
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    return write_atomically(path, lambda stream: stream.write(text.encode()))


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
        ArtefactError: The file is truncated, of another kind or of another format version.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"{kind} file {path} does not exist")
    try:
        with np.load(path, allow_pickle=False) as archive:
            names = [name for name in archive.files if name not in ("metadata", *leave)]
            arrays = {name: archive[name] for name in names}
            metadata = json.loads(str(archive["metadata"]))
    except (zipfile.BadZipFile, zlib.error, ValueError, KeyError, EOFError, OSError) as error:
        raise ArtefactError(
            f"{path} is not a readable {kind} file ({error}); it is truncated or was not written "
            "by pneumorph"
        ) from error
    if metadata.get("kind") != kind:
        raise ArtefactError(f"{path} holds a {metadata.get('kind')}, expected a {kind}")
    if metadata.get("format_version") not in versions:
        raise ArtefactError(
            f"{path} has {kind} format version {metadata.get('format_version')}, this pneumorph "
            f"reads version {' and '.join(map(str, versions))}; make the file again or install the "
            "matching release"
        )
    return arrays, metadata


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
    except (zipfile.BadZipFile, zlib.error, ValueError, KeyError, EOFError, OSError) as error:
        if isinstance(error, ArtefactError):
            raise
        raise ArtefactError(f"{name} of {path} is truncated or missing ({error})") from error
