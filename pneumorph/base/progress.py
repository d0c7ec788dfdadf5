"""How far a run is and how long it still takes, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

ProgressReport = Callable[[int, int, str], None]
"""What long work calls: how much is done, of how much, and what it is. `Progress` is one."""

_PAUSE_TERMINAL_S = 0.2
_PAUSE_LOG_S = 10.0


class Progress:
    """Prints one line that renews itself on a terminal, or a line now and then into a log.

    It is called as ``progress(done, total, message)``. A verb of several stages names each with
    `stage`; the time left is that of the stage.

    Args:
        stream: Where to print; standard error by default, so that JSON stays alone on the output.
            Where that is closed, nothing is printed.
        quiet: Print nothing.
    """

    def __init__(self, stream: TextIO | None = None, quiet: bool = False) -> None:
        self._stream: TextIO | None = stream or sys.stderr
        self._quiet = quiet or self._stream is None
        self._terminal = self._stream is not None and self._stream.isatty()
        self._title = ""
        self._start = self._shown = self._first_s = time.monotonic()
        self._first = self._done = 0
        self._total: int | None = None
        self._open_line = False

    def stage(self, title: str) -> None:
        """Begin a stage; times count from here."""
        self._end_line()
        self._title = title
        self._start = time.monotonic()
        self._shown = 0.0
        self._first = self._done = 0
        self._total = None
        self.say(f"{title} ...")

    def say(self, text: str) -> None:
        """Print a line of its own."""
        if not self._quiet:
            self._end_line()
            print(text, file=self._stream, flush=True)

    def __call__(self, done: int, total: int, message: str = "") -> None:
        """Show that ``done`` of ``total`` are done."""
        now = time.monotonic()
        other = total != self._total or done < self._done
        if self._total is not None and other:
            self._start = now  # other work, which takes its own time
        if self._shown == 0.0 or other:
            # What a resumed run did before does not tell how fast this one is.
            self._first, self._first_s, self._shown = done, now, now
        self._total, self._done = total, done
        finished = done >= total
        pause = _PAUSE_TERMINAL_S if self._terminal else _PAUSE_LOG_S
        if self._quiet or (not finished and now - self._shown < pause):
            return
        self._shown = now
        spent = now - self._start
        line = (
            f"  {message or self._title}: {100 * done / max(total, 1):3.0f} %, {clock(spent)} spent"
        )
        if not finished and done > self._first:
            each_s = (now - self._first_s) / (done - self._first)
            line += f", {clock(each_s * (total - done))} left"
        if self._terminal:
            print(f"\r\x1b[K{line}", end="", file=self._stream, flush=True)
            self._open_line = True
            if finished:
                self._end_line()
        elif not finished or spent > pause:
            print(line, file=self._stream, flush=True)

    def _end_line(self) -> None:
        if self._open_line:
            print(file=self._stream, flush=True)
            self._open_line = False


def clock(seconds: float) -> str:
    """Return a duration as minutes and seconds, with hours where there are any."""
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
