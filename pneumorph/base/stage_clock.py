"""Where the time of a step goes."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import ParamSpec, TypeVar

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class StageClock:
    """Seconds spent in named stages; a stage must not be timed within another."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        """Wall time of each stage since the last `clear` [s]."""

    def timed(
        self, stage: str, function: Callable[_Arguments, _Result]
    ) -> Callable[_Arguments, _Result]:
        """The function, its time added to a stage at every call."""

        def call(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds[stage] += time.perf_counter() - start

        return call

    def clear(self) -> None:
        """Start again from zero."""
        self.seconds.clear()
