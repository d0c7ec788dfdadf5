"""Seconds that a piece of work has taken, over all processes that were at it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.meanwhile import meanwhile


@contextmanager
def spent_s(file: Path, interval_s: float = 10.0) -> Iterator[float]:
    """Keep what the block takes in a file, also of a process that is killed; yields the seconds
    that earlier ones took.

    Args:
        file: The file.
        interval_s: How often it is written [s].
    """
    earlier_s = float(read_json(file, "JSON")["wall_s"]) if file.exists() else 0.0
    start = time.monotonic()

    def keep() -> None:
        write_json(file, {"wall_s": earlier_s + time.monotonic() - start})

    try:
        with meanwhile(keep, interval_s):
            yield earlier_s
    finally:
        with suppress(OSError):  # the work itself tells of a full disk
            keep()
