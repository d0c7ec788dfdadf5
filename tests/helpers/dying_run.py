"""A campaign's run whose process dies once, in the middle of its training."""

import os
import signal
from pathlib import Path
from typing import Any

from pneumorph.learn import cooptimise
from pneumorph.study.campaign import run_one


def dies_once(shared: tuple[str, Any, int], task: tuple[str, dict[str, Any]]) -> str | None:
    """Make the run; the first process to try is killed after its second checkpoint."""
    marker = Path(shared[0]) / f"{task[0]}.died"
    if not marker.exists():
        save, calls = cooptimise.save_checkpoint, []

        def save_and_die(*arguments: Any) -> Path:
            path = save(*arguments)
            calls.append(path)
            if len(calls) == 2:
                marker.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            return path

        cooptimise.save_checkpoint = save_and_die
    return run_one(shared, task)
