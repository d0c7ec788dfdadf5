"""Seconds that a piece of work has taken, over all processes that were at it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pneumorph.base.artefact import read_json, write_json


@contextmanager
def spent_s(file: Path, interval_s: float = 10.0) -> Iterator[float]:
    """Keep what the block takes in a file, also of a process that is killed; yields the seconds
    that earlier ones took.

    Args:
        file: The file.
        interval_s: How often it is written [s].
    """
    earlier_s = float(read_json(file, "JSON")["wall_s"]) if file.exists() else 0.0
    start, ended = time.monotonic(), threading.Event()

    def keep() -> None:
        write_json(file, {"wall_s": earlier_s + time.monotonic() - start})

    def watch() -> None:
        while not ended.wait(interval_s):
            with suppress(OSError):  # the work itself tells of a full disk
                keep()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield earlier_s
    finally:
        ended.set()
        thread.join()
        with suppress(OSError):
            keep()
