"""Files that were whole once, and what may become of them: drawn by hypothesis."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

few = settings(
    derandomize=True,
    database=None,
    deadline=None,
    max_examples=int(os.environ.get("EXAMPLES", "15")),
    suppress_health_check=list(HealthCheck),
)
"""The same few examples everywhere; EXAMPLES=2000 for a night of them."""


@dataclass(frozen=True)
class Reader:
    """A kind of file: how it is written and how it is read."""

    name: str
    """With its suffix."""
    write: Callable[[Path], object]
    read: Callable[[Path], object]

    @cached_property
    def whole(self) -> bytes:
        """What a file holds that is as it should be."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.name
            self.write(path)
            self.read(path)
            return path.read_bytes()

    def refusal(self, content: bytes) -> str | None:
        """Read bytes, and return what the refusal says; None where they are read.

        Raises:
            AssertionError: They are refused without the file's name.
        """
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.name
            path.write_bytes(content)
            try:
                self.read(path)
            except (ValueError, OSError) as error:
                if path.name not in str(error):
                    raise AssertionError(f"the refusal does not name {path.name}") from error
                return str(error)
            return None


def any_bytes() -> st.SearchStrategy[bytes]:
    """Bytes, text, and JSON of any shape."""
    values = st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
        max_leaves=6,
    )
    return (
        st.binary(max_size=200)
        | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass"))
        | values.map(lambda value: json.dumps(value).encode())
    )


def damaged(whole: bytes) -> st.SearchStrategy[bytes]:
    """The file cut short, with a byte turned, or with a stretch doubled, lost or overwritten."""
    place = st.integers(0, max(len(whole) - 1, 0))

    @st.composite
    def turned(draw: st.DrawFn) -> bytes:
        begin, end = sorted((draw(place), draw(place)))
        middle = draw(
            st.sampled_from([b"", whole[begin:end] * 2, b"\0" * (end - begin)])
            | st.binary(max_size=8)
        )
        return whole[:begin] + middle + whole[end:]

    flipped = st.tuples(place, st.integers(1, 255)).map(
        lambda each: whole[: each[0]] + bytes([whole[each[0]] ^ each[1]]) + whole[each[0] + 1 :]
    )
    return place.map(lambda end: whole[:end]) | flipped | turned()


def damaged_text(whole: bytes) -> st.SearchStrategy[bytes]:
    """One word of a text in the place of another, or a line lost or doubled."""
    lines = whole.decode().splitlines()
    number = st.integers(0, len(lines) - 1)
    words = st.sampled_from(["", "nan", "-1", "1e400", "word", "ü", '"', ",,,,", "0"])

    @st.composite
    def changed(draw: st.DrawFn) -> bytes:
        place, now = draw(number), list(lines)
        cells = now[place].split(",")
        cells[draw(st.integers(0, len(cells) - 1))] = draw(words)
        now[place] = draw(st.sampled_from([",".join(cells), ""]))
        if draw(st.booleans()):
            now.insert(draw(number), lines[place])
        return "\n".join(now).encode()

    return changed()


def damaged_json(whole: bytes) -> st.SearchStrategy[bytes]:
    """A value at some place taken away or of another type."""
    all_places = list(places(json.loads(whole)))
    others = st.sampled_from([None, True, -1, 0, 1e300, "word", "", [], {}, [1, "a"], {"a": 1}])

    @st.composite
    def changed(draw: st.DrawFn) -> bytes:
        content = json.loads(whole)
        *above, last = draw(st.sampled_from(all_places))
        inner: Any = content
        for name in above:
            inner = inner[name]
        if draw(st.booleans()):
            del inner[last]
        else:
            inner[last] = draw(others)
        return json.dumps(content).encode()

    return changed()


def places(content: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where the values of JSON content stand: names and numbers from the top, tables as well."""
    items = content.items() if isinstance(content, dict) else enumerate(content)
    for name, value in items:
        yield (*above, name)
        if isinstance(value, dict | list):
            yield from places(value, (*above, name))


def damaged_npz(whole: bytes) -> st.SearchStrategy[bytes]:
    """An array lost, of another type, shape or number; or metadata that lack something."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.npz"
        path.write_bytes(whole)
        with np.load(path) as archive:
            arrays = {name: archive[name] for name in archive.files}
    metadata = str(arrays["metadata"]).encode()
    names = st.sampled_from([name for name in arrays if name != "metadata"])
    hows: list[Callable[[np.ndarray], Any]] = [
        lambda a: None,
        lambda a: a[:0],
        lambda a: a[..., None],
        lambda a: a.ravel()[:1],
        lambda a: np.array("word"),
        lambda a: np.full(a.shape, np.nan),
        lambda a: np.full(a.shape, -(10**6)),
        lambda a: a.astype(complex) if a.dtype.kind in "fiu" else None,
        lambda a: np.full(a.shape, "word"),
    ]

    def saved(now: dict[str, Any]) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "now.npz"
            np.savez(path, **{name: value for name, value in now.items() if value is not None})
            return path.read_bytes()

    @st.composite
    def changed(draw: st.DrawFn) -> bytes:
        name, how = draw(names), draw(st.sampled_from(hows))
        return saved({**arrays, name: how(np.atleast_1d(arrays[name]))})

    renamed = damaged_json(metadata).map(
        lambda text: saved({**arrays, "metadata": np.array(text.decode())})
    )
    return changed() | renamed
