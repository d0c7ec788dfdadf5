"""Every flag of every verb with values that nobody should ask for: no call may end in a traceback.

All calls are made in this process. A verb whose work is long ends where its options are checked and
its robot is specified; what is quick is done in earnest, on a small leg, and so are files that are
none, for they are refused at once::

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
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints
from unittest.mock import patch

import numpy as np

from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part
from pneumorph.base.layers import _flags
from pneumorph.base.settings import dataclass_of
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import VERBS, run
from pneumorph.command.verb import CommonOptions
from pneumorph.study.training_options import TrainingOptions

VALUES = ("nan", "inf", "-inf", "-1", "0", "1e300", "99999999999999999999", "nonsense", "")
"""What each flag is given."""

PATHS = ("nonsense", "", "{folder}", "{file}")
"""What each flag that names a file is given besides: a folder, and a file of random bytes."""

LIMIT_S = 5.0
"""A call that takes longer is stopped: it does what it was asked for."""


@dataclass(frozen=True)
class Call:
    """One call, and what came of it.

    Attributes:
        arguments: What stands on the command line.
        ended: Exit status, ``stopped`` at the limit of time, or the traceback.
        said: The end of standard error.
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
    (folder / "here").mkdir()
    (folder / "bytes").write_bytes(np.random.default_rng(0).bytes(300))
    return folder


def needed(verb: str, folder: Path) -> list[str]:
    """Positional arguments without which a verb does nothing, and flags that keep it short."""
    return {
        "evaluate": [str(folder / "run")],
        "analyse": [str(folder / "run")],
        "certify": [str(folder / "run")],
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

UNUSED = ("--out", "--full.", "--wandb")
"""Flags of files that are not read where reduced robots walk, or not at all."""


def all_calls(folder: Path) -> list[tuple[tuple[str, ...], bool]]:
    """Every flag of every verb with every value, and every positional argument.

    Returns:
        Arguments, and whether the verb's work is to be done.
    """
    calls: list[tuple[tuple[str, ...], bool]] = []
    for verb in VERBS:
        module = import_module(f"pneumorph.command.{verb}")
        begin, earnest = needed(verb, folder), verb in IN_EARNEST
        positional = False
        for kind in (module.VERB.options, CommonOptions):
            for path, flag in _flags(kind):
                if flag is None:
                    positional = True
                    continue
                calls += [((verb, *begin, f"{flag}={value}"), earnest) for value in VALUES]
                if _names_files(kind, path):
                    reads = earnest or not flag.startswith(UNUSED)
                    calls += [((verb, *begin, f"{flag}={value}"), reads) for value in PATHS]
        if positional:
            calls += [((verb, value, *begin[1:]), True) for value in PATHS]
        if module.VERB.presets:
            calls += [((verb, *begin, f"--preset={value}"), earnest) for value in VALUES]
    there = {"{folder}": str(folder), "{file}": str(folder / "bytes")}
    for old, new in there.items():
        calls = [(tuple(each.replace(old, new) for each in each_call), earnest)
                 for each_call, earnest in calls]  # fmt: skip
    return calls


def _names_files(kind: Any, path: tuple[str, ...]) -> bool:
    """Whether an option of a settings class holds paths."""
    for name in path[:-1]:
        kind = dataclass_of(get_type_hints(kind, include_extras=True)[name])
    return "Path" in str(get_type_hints(kind)[path[-1]])


def make_call(
    arguments: Sequence[str], earnest: bool, folder: Path, limit_s: float = LIMIT_S
) -> Call:
    """Make one call, and return what came of it.

    Args:
        arguments: The command line.
        earnest: Whether the verb's work is done.
        folder: Where `ground` has put what it reads; outputs are written there.
        limit_s: It is stopped then.
    """
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
        chdir(folder / "here"),
        redirect_stderr(said),
        redirect_stdout(io.StringIO()),
        patch.object(module, "VERB", module.VERB if earnest else stub),
    ):
        try:
            with _limit(limit_s):
                ended = run(list(arguments))
        except SystemExit as leave:
            ended = int(leave.code or 0)
        except _Stopped:
            ended = "stopped"
        except Exception:
            ended = traceback.format_exc()
    shutil.rmtree(out, ignore_errors=True)
    return Call(arguments, ended, said.getvalue()[-2000:])


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


def draw(calls: list[Any], count: int | None, seed: int) -> list[Any]:
    """Some of the calls, or all where no count is given."""
    if count is None:
        return calls
    chosen = np.random.default_rng(seed).permutation(len(calls))[:count]
    return [calls[number] for number in chosen]


def main() -> int:
    """Make the calls that are asked for, print those that failed, and say how all ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, help="how many, drawn by the seed; all by default")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--verbs", nargs="+", default=list(VERBS))
    asked = parser.parse_args()
    ended: Counter[str] = Counter()
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = ground(Path(temporary))
        calls = [each for each in all_calls(folder) if each[0][0] in asked.verbs]
        for arguments, earnest in draw(calls, asked.calls, asked.seed):
            call = make_call(arguments, earnest, folder)
            ended["traceback" if call.failed else str(call.ended)] += 1
            if call.failed or call.ended == "stopped":
                print(" ".join(map(repr, arguments)), call.ended, call.said, sep="\n", flush=True)
    print(f"{ended.total()} calls in {time.monotonic() - start:.0f} s: {dict(ended)}")
    return 1 if ended["traceback"] else 0


if __name__ == "__main__":
    sys.exit(main())
