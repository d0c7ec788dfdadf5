"""A toy co-optimisation that kills its own process at a chosen moment: `python killed_run.py`."""

import os
import signal
import sys
from dataclasses import replace
from pathlib import Path

from helpers.toy_coopt import TIME_STEP_S, make_simulator, toy_settings
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.learn.coopt_result import CooptResult
from pneumorph.learn.cooptimise import learn_in_folder
from pneumorph.learn.environments import crawling

_SETTINGS = toy_settings(round_count=7, environment_count=4)
SETTINGS = replace(_SETTINGS, checkpoint_interval_timesteps=2 * _SETTINGS.timesteps_per_round)


def finish(folder: Path, said: list[str] | None = None) -> CooptResult:
    """Begin the run, or go on with it, to its end."""
    return learn_in_folder(
        crawling(viscous_crawler_robot, make_simulator, SETTINGS),
        SETTINGS,
        folder,
        time_step_s=TIME_STEP_S,
        resume=True,
        say=None if said is None else said.append,
    )


def die_at_call(number: int, of: object, name: str) -> None:
    """Let the process die, without a chance to tidy up, at the n-th call of a function."""
    function, calls = getattr(of, name), iter(range(1, 10**9))

    def call(*arguments: object, **options: object) -> object:
        if next(calls) == number:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **options)

    setattr(of, name, call)


def main(folder: Path, moment: str) -> None:
    """Run until the moment."""
    if moment == "in an action of round 6":
        per_round = SETTINGS.task.action_count + 1  # and settling
        die_at_call(5 * per_round + 5, ViscousCrawler, "advance")
    elif moment == "while the second checkpoint is written":
        # settings.json, the empty metrics, then checkpoints.
        die_at_call(2 + 2, os, "fsync")
    elif moment == "between the renames of the second checkpoint":
        # settings.json, metrics, the first checkpoint's two renames, then three for each.
        die_at_call(1 + 1 + 2 + 3, os, "replace")
    finish(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
