"""Every flag of every verb with values that nobody should ask for: no call may end in a traceback.

All calls are made in this process. A verb whose work is long ends where its options are checked and
its robot is specified; what is quick is done in earnest, on a small leg::

    PYTHONPATH=tests python -m helpers.command_line_fuzz            # every call, half an hour
    PYTHONPATH=tests python -m helpers.command_line_fuzz --calls 300 --seed 1
"""

from __future__ import annotations

import argparse
import io
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part
from pneumorph.base.layers import _flags
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import VERBS, run
from pneumorph.command.verb import CommonOptions
from pneumorph.study.training_options import TrainingOptions

VALUES = ("nan", "inf", "-inf", "-1", "0", "1e-300", "1e300", "99999999999999999999", "nonsense",
          "", "{folder}", "{file}")  # fmt: skip
"""What each flag is given; a folder and a file of random bytes among it."""

LIMIT_S = 5.0
"""A call that takes longer is stopped: it does what it was asked for."""


@dataclass(frozen=True)
class Call:
    """One call, and what came of it.

    Attributes:
        arguments: What stands on the command line.
        ended: Exit status, ``stopped`` at the limit of time, or the traceback.
        said: Last line on standard error.
    """

    arguments: tuple[str, ...]
    ended: int | str
    said: str

    @property
    def failed(self) -> bool:
        """Whether it ended in a traceback, or failed without a word."""
        if isinstance(self.ended, str):
            return self.ended != "stopped"
        return self.ended != 0 and not self.said.strip()


class _Stopped(BaseException):
    """The limit of time is over."""


def ground(folder: Path) -> Path:
    """What the calls read: a finished run, a small leg, bytes that are no file of ours."""
    write_run(folder / "run", "coopt", TrainingOptions(), best_design="1.0.0.2.2.0.0.1")
    synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(folder / "leg.npz")
    (folder / "bytes").write_bytes(np.random.default_rng(0).bytes(300))
    return folder


def needed(verb: str, folder: Path) -> list[str]:
    """Positional arguments without which a verb does nothing, and flags that keep it short."""
    return {
        "evaluate": [str(folder / "run")],
        "analyse": [str(folder / "run")],
        "transfer": [str(folder / "run")],
        "fabricate": ["1.0.0.2.2.0.0.1"],
        "exchange": [str(folder / "run/training/gaits/L1.csv")],
        "watch": [str(folder / "run"), "--once"],
        "replay": [str(folder / "run")],
        "report": [str(folder / "run")],
        "simulate": ["--part", str(folder / "leg.npz"), "--expert.duration-s", "0.1"],
        "deploy": ["--dry-run"],
    }.get(verb, [])


IN_EARNEST = ("simulate", "deploy", "exchange", "transfer", "replay")
"""Verbs whose work is done, as `needed` keeps it short."""


def all_calls(folder: Path) -> list[tuple[str, ...]]:
    """Every flag of every verb with every value, and every positional argument."""
    calls: list[tuple[str, ...]] = []
    for verb in VERBS:
        kinds = (import_module(f"pneumorph.command.{verb}").VERB.options, CommonOptions)
        flags = [flag for kind in kinds for _, flag in _flags(kind) if flag is not None]
        if import_module(f"pneumorph.command.{verb}").VERB.presets:
            flags.append("--preset")
        begin = needed(verb, folder)
        for value in VALUES:
            value = value.format(folder=folder, file=folder / "bytes")
            calls.append((verb, value, *begin[1:]))
            calls += [(verb, *begin, f"{flag}={value}") for flag in flags]
    return calls


def make_call(arguments: Sequence[str], folder: Path) -> Call:
    """Make one call, and return what came of it."""
    out = folder / "out"
    verb = arguments[0]
    module = import_module(f"pneumorph.command.{verb}")
    stub = replace(module.VERB, run=lambda options, _: _specified(options))
    arguments = tuple(arguments)
    if not any(each.startswith("--out") for each in arguments):
        arguments = (*arguments, f"--out={out}")
    said = io.StringIO()
    ended: int | str
    with (
        redirect_stderr(said),
        redirect_stdout(io.StringIO()),
        patch.object(module, "VERB", module.VERB if verb in IN_EARNEST else stub),
    ):
        try:
            with _limit(LIMIT_S):
                ended = run(list(arguments))
        except SystemExit as leave:
            ended = int(leave.code or 0)
        except _Stopped:
            ended = "stopped"
        except Exception:
            ended = traceback.format_exc()
    shutil.rmtree(out, ignore_errors=True)
    return Call(arguments, ended, said.getvalue()[-400:])


def _specified(options: Any) -> dict[str, Any]:
    """Stands for a verb's work: the robot that is asked for is specified, and nothing walks."""
    robot = getattr(options, "robot", None)
    if isinstance(robot, RobotOptions):
        robot.spec()
    return {}


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise _Stopped

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, help="how many, drawn by the seed; all by default")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--verbs", nargs="+", default=list(VERBS))
    asked = parser.parse_args()
    ended: dict[str, int] = {}
    failed: list[Call] = []
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = ground(Path(temporary))
        calls = [each for each in all_calls(folder) if each[0] in asked.verbs]
        if asked.calls is not None:
            chosen = np.random.default_rng(asked.seed).permutation(len(calls))[: asked.calls]
            calls = [calls[number] for number in chosen]
        for arguments in calls:
            call = make_call(arguments, folder)
            name = "traceback" if call.failed else str(call.ended)
            ended[name] = ended.get(name, 0) + 1
            if call.failed:
                failed.append(call)
                last = call.ended.strip().splitlines()[-1] if isinstance(call.ended, str) else ""
                print(" ".join(map(repr, arguments)), "|", last, flush=True)
            elif call.ended == "stopped":
                print("stopped:", " ".join(arguments), flush=True)
    print(f"{len(calls)} calls in {time.monotonic() - start:.0f} s: {ended}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
