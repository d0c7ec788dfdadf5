"""One value of a file in the place of another: each verb that reads it succeeds, or says in one
line which file is damaged.

Files are those of a run, a rig, a calibration, a robot and a reduced leg; values are what an
editor, a script or a half-done conversion leaves there. Calls are made in this process and stopped
after a while, for a verb that was given a sound number does what it was asked for::

    PYTHONPATH=tests python -m helpers.damaged_values             # every value of every file
    PYTHONPATH=tests python -m helpers.damaged_values --calls 300 --seed 1 --files summary.json
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from helpers.command_line_fuzz import Call, draw, make_call
from helpers.corruption import places
from helpers.result_example import example
from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part
from pneumorph.base.artefact import write_json
from pneumorph.base.result import result_to_dict
from pneumorph.base.settings import save_settings
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.hardware.rig import RigSettings
from pneumorph.learn.metrics import HISTOGRAM_EDGES_CM
from pneumorph.physics.air import Air
from pneumorph.physics.calibration import Calibration
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_result import LearnedPair, TrainingResult

VALUES: dict[str, Any] = {
    "null": None, "3": 3, "[]": [], "x": "x", "nan": math.nan, "huge": 10**6,
}  # fmt: skip
"""What stands where something else stood, by its name."""

RUN_VERBS: tuple[tuple[str, ...], ...] = (
    ("evaluate", "{run}", "--pair-count=1"),
    ("report", "{run}", "--figure-files"),
    ("simulate", "--gait", "{run}"),
    ("deploy", "{run}", "--dry-run"),
    (
        "analyse",
        "{run}",
        "--pair-count=1",
        "--cycle-s=1",
        "--lowest-friction=1",
        "--highest-friction=1",
    ),
    ("watch", "{run}", "--once"),
    (
        "certify",
        "{run}",
        "--pair-count=1",
        "--world-count=4",
        "--tuning-world-count=1",
        "--cycle-s=1",
    ),
    (
        "search",
        "--run",
        "{run}",
        "--method=random",
        "--timesteps=96",
        "--random.population=8",
    ),
)
VERBS: dict[str, tuple[tuple[str, ...], ...]] = {
    "run/summary.json": RUN_VERBS,
    "run/settings.json": RUN_VERBS,
    "run/training/metrics.jsonl": (RUN_VERBS[1], RUN_VERBS[5]),
    "rig.json": (("deploy", "--rig", "{folder}/rig.json", "--dry-run"),),
    "calibration.json": (
        ("simulate", "--part", "{folder}/leg.npz", "--calibration", "{folder}/calibration.json",
         "--expert.duration-s=0.1"),
        ("deploy", "--physics=published", "--calibration", "{folder}/calibration.json",
         "--dry-run"),
    ),
    "robot.json": (("simulate", "--robot", "{folder}/robot.json", "--expert.duration-s=0.1"),),
    "leg.npz": (
        ("simulate", "--part", "{folder}/leg.npz", "--expert.duration-s=0.1"),
        ("evaluate", "{run}", "--pair-count=1"),
    ),
}  # fmt: skip
"""Who reads each file."""


LIMIT_S = 20.0
"""A call that takes longer is stopped: it does what it was asked for."""


@dataclass(frozen=True)
class Damage:
    """A value of a file in the place of another, and a call that reads it."""

    file: str
    place: tuple[str | int, ...]
    value: str
    arguments: tuple[str, ...]


def whole_files(folder: Path) -> Path:
    """Write the files as they should be; return their folder."""
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(folder / "leg.npz")
    options = TrainingOptions(robot=RobotOptions.of("published", part=leg))
    run = write_run(folder / "run", "coopt", options, (BASELINE_DESIGN, "1.0.0.2.2.0.0.3"))
    files = [f"training/gaits/L{rank}.csv" for rank in (1, 2)]
    found = TrainingResult(**{
        **vars(example(TrainingResult)),
        "baseline_design": BASELINE_DESIGN,
        "baseline_best_phase_deg": 60.0,
        "phases_deg": (0.0, 60.0),
        "distances_cm": (0.5, 3.0),
        "phases_achieved": (0.5, 3.0),
        "backsliding_cm": (0.2, 0.1),
        "best_design": BASELINE_DESIGN,
        "best_gait": files[0],
        "pairs": tuple(
            LearnedPair(design, 9.0, "training", 1, gait, 9.0)
            for design, gait in zip((BASELINE_DESIGN, "1.0.0.2.2.0.0.3"), files, strict=True)
        ),
        "seen_pairs": (LearnedPair(BASELINE_DESIGN, 9.0, "training", 1),),
        "certificate": None,
        "leg": None,
        "own_task": None,
    })  # fmt: skip
    write_json(run / "summary.json", {"verb": "coopt", **result_to_dict(found)})
    shares = [1.0 / (len(HISTOGRAM_EDGES_CM) - 1)] * (len(HISTOGRAM_EDGES_CM) - 1)
    (run / "training/metrics.jsonl").write_text(
        "".join(
            json.dumps({
                "timestep": 10 * number, "return_mean_cm": 1.0, "best_distance_cm": 2.0,
                "design_entropy": 3.0, "design_entropy_target": 3.0, "score_histogram": shares,
            }) + "\n"
            for number in (1, 2)
        )
    )  # fmt: skip
    (folder / "here").mkdir()
    save_settings(folder / "rig.json", RigSettings())
    Calibration(air=Air(), measured={"friction sheet": (0.6, 0.1)}).save(
        folder / "calibration.json"
    )
    plate = Path(__file__).parents[2] / "examples" / "plate.toml"
    write_json(folder / "robot.json", tomllib.loads(plate.read_text()))
    return folder


def all_damages(folder: Path) -> list[Damage]:
    """Every value at every place of every file, before every verb that reads it."""
    there = {"{folder}": str(folder), "{run}": str(folder / "run")}
    found = []
    for file, verbs in VERBS.items():
        for verb in verbs:
            arguments = verb
            for old, new in there.items():
                arguments = tuple(each.replace(old, new) for each in arguments)
            found += [
                Damage(file, place, value, arguments)
                for place in _places(folder / file)
                for value in VALUES
            ]
    return found


def _places(path: Path) -> Iterator[tuple[str | int, ...]]:
    if path.suffix == ".npz":
        with np.load(path) as archive:
            yield from ((name,) for name in archive.files if archive[name].dtype.kind == "i")
    else:
        # Of a list of numbers the first stands for all.
        for place in places(_read(path)):
            if not (isinstance(place[-1], int) and place[-1] > 1):
                yield place


def _read(path: Path) -> Any:
    text = path.read_text()
    return list(map(json.loads, text.splitlines())) if path.suffix == ".jsonl" else json.loads(text)


def write_damaged(path: Path, place: tuple[str | int, ...], value: str) -> None:
    """Write a file with a value at a place."""
    if path.suffix == ".npz":
        _write_damaged_array(path, str(place[0]), value)
        return
    content = _read(path)
    inner = content
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = VALUES[value]
    lines = content if path.suffix == ".jsonl" else [content]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))


def _write_damaged_array(path: Path, name: str, value: str) -> None:
    with np.load(path) as archive:
        arrays = {each: archive[each] for each in archive.files}
    old = arrays.pop(name)
    if value == "huge":
        now = old.copy()
        now.flat[0] = VALUES[value]
        arrays[name] = now
    elif value == "nan":
        arrays[name] = np.full(old.shape, np.nan)
    elif value != "null":
        arrays[name] = np.array(VALUES[value])
    np.savez(path, **arrays)


def call_with(damage: Damage, folder: Path, limit_s: float = LIMIT_S) -> Call:
    """Make the call on the damaged file, and put the whole one back."""
    path = folder / damage.file
    whole = path.read_bytes()
    try:
        write_damaged(path, damage.place, damage.value)
        return make_call(damage.arguments, True, folder, limit_s)
    finally:
        path.write_bytes(whole)


def call_on_whole_files(folder: Path) -> list[Call]:
    """Make each call once on whole files, and return those that did not succeed.

    It imports what a call that is stopped must not leave half imported.
    """
    arguments = dict.fromkeys(each.arguments for each in all_damages(folder))
    calls = [make_call(each, True, folder, limit_s=600.0) for each in arguments]
    return [call for call in calls if call.ended != 0]


def complaint(damage: Damage, call: Call) -> str:
    """What is wrong with how a call ended; nothing where it succeeded or named the file."""
    if call.ended in (0, "stopped"):
        return ""
    if isinstance(call.ended, str):
        return call.ended
    lines = call.said.rstrip().splitlines()
    first = next((n for n, line in enumerate(lines) if line.startswith("pneumorph: ")), None)
    if call.ended != 1 or first is None or first != len(lines) - 1:
        return f"no message of one line: {call.said}"
    # A limit of the settings may make a gait beside them wrong, which is then named.
    named = (Path(damage.file).name, f"{Path(damage.file).parts[0]}/training/gaits/")
    if not any(name in lines[-1] for name in named):
        return f"the file is not named: {lines[-1]}"
    if "' object " in lines[-1] or "<built-in" in lines[-1]:
        return f"in Python's words: {lines[-1]}"
    return ""


def main() -> int:
    """Make the calls that are asked for, print what is wrong, and say how all ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, help="how many, drawn by the seed; all by default")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--files", nargs="+", default=list(VERBS))
    parser.add_argument("--verbs", nargs="+")
    asked = parser.parse_args()
    ended: Counter[str] = Counter()
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = whole_files(Path(temporary))
        assert call_on_whole_files(folder) == []
        damages = [
            each for each in all_damages(folder)
            if any(each.file.endswith(file) for file in asked.files)
            and (asked.verbs is None or each.arguments[0] in asked.verbs)
        ]  # fmt: skip
        for damage in draw(damages, asked.calls, asked.seed):
            call = call_with(damage, folder)
            said = complaint(damage, call)
            ended["wrong" if said else str(call.ended)] += 1
            if said:
                place = ".".join(map(str, damage.place))
                print(damage.arguments[0], damage.file, place, damage.value, said, flush=True)
    print(f"{ended.total()} calls in {time.monotonic() - start:.0f} s: {dict(ended)}")
    return 1 if ended["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
