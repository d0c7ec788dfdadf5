"""Something small that is done again and again beside a piece of work."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress


@contextmanager
def meanwhile(do: Callable[[], object], interval_s: float) -> Iterator[None]:
    """Do something in a thread of its own while the block lasts; never once it has ended.

    Args:
        do: What is done; where a file fails it for the moment, it is tried again.
        interval_s: How long to wait before each time [s].
    """
    ended = threading.Event()

    def watch() -> None:
        while not ended.wait(interval_s):
            with suppress(OSError):
                do()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
